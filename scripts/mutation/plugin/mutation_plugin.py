"""For pytest in a copy: chosen tests only, a time limit for each, and what became of them as JSON.

MUTATION_TESTS names a JSON list of the tests to run, in this order (all if it is not set),
MUTATION_REPORT a file that gets [test, outcome, seconds] line by line, MUTATION_LIMIT the seconds
that a test of plain Python may take, MUTATION_COVERAGE a file for the lines that each test executes
(of what its fixtures do: each test of its file). A mutant that fills the memory gets no more than
8 GiB.
"""

import json
import os
import resource
import signal
from pathlib import Path

import pytest

MEMORY = 2**33
LIMIT = float(os.environ.get("MUTATION_LIMIT", "0"))
COVERAGE = None
if path := os.environ.get("MUTATION_COVERAGE"):  # before the package is imported
    import coverage

    COVERAGE = coverage.Coverage(path, config_file=False, source=["gne_mj", "controllers"])
    COVERAGE.start()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_setup(item):
    """What fixtures do is done for all tests of a file."""
    if COVERAGE:
        COVERAGE.switch_context(item.nodeid.partition("::")[0])
    yield


def pytest_unconfigure():
    """Write down which lines were executed."""
    if COVERAGE:
        COVERAGE.stop()
        COVERAGE.save()


def pytest_configure():
    """Limit the memory."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


def pytest_collection_modifyitems(items):
    """Choose and order the tests."""
    if chosen := os.environ.get("MUTATION_TESTS"):
        order = {name: rank for rank, name in enumerate(json.loads(Path(chosen).read_text()))}
        items[:] = sorted(
            (item for item in items if item.nodeid in order), key=lambda item: order[item.nodeid]
        )


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_call(item):
    """Let a test of plain Python take no longer than it may."""
    if COVERAGE:
        COVERAGE.switch_context(item.nodeid)
    if LIMIT:
        signal.signal(signal.SIGALRM, _too_long)
        signal.setitimer(signal.ITIMER_REAL, LIMIT)
    yield
    if LIMIT:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def pytest_runtest_logreport(report):
    """Write down what became of a test."""
    if report.when == "call" or report.outcome != "passed":
        with Path(os.environ["MUTATION_REPORT"]).open("a", encoding="utf-8") as file:
            file.write(json.dumps([report.nodeid, report.outcome, report.duration]) + "\n")


def _too_long(signum, frame):
    raise TimeoutError(f"longer than {LIMIT:g} s")
