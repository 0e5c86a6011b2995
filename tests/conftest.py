"""Settings and fixtures for all tests."""

import os
import signal

import pytest
from browser import Recorded, launched
from hypothesis import settings

from gne_mj import progress

# Compiling a native loop for the first time takes seconds: no deadline per example.
settings.register_profile("default", deadline=None, max_examples=50, derandomize=True)
settings.register_profile("thorough", deadline=None, max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "default"))

# On a slow machine too nothing is printed that a test does not expect.
progress.MINUTE = progress.LONG = 1e6

# A shell that starts the tests in the background has them, and all that they start, ignore Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def browser():
    """Chromium, one for each process that runs tests of pages."""
    with launched() as running:
        yield running


@pytest.fixture
def recorded():
    """What the test's page did, see browser.Recorded."""
    return Recorded()


@pytest.fixture
def page(browser, recorded):
    """An empty page of Playwright, in a context of its own, that is recorded in `recorded`."""
    with browser.page(recorded) as opened:
        yield opened
