"""Chromium, driven by Playwright, and what its pages do; conftest.py has the fixtures."""

import asyncio
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")  # scripts/install-browser has them too
ARGUMENTS = (
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-gpu",
    "--disable-quic",
    "--disable-sync",
    "--enable-unsafe-swiftshader",
    "--no-first-run",
    "--use-angle=swiftshader",
    # Nothing leaves this machine, even where a page asks for it.
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE localhost, EXCLUDE 127.0.0.1, EXCLUDE [::1]",
    "--no-proxy-server",
)
WITHIN = ("about:", "blob:", "data:")  # what a page asks of itself alone


def find_browser():
    """The path of a browser. Without one the test is skipped, or fails where one is required."""
    for name in NAMES:
        if path := shutil.which(name):
            return path
    missing = "no Chromium on PATH: scripts/install-browser installs Debian's"
    if os.environ.get("GNE_MJ_BROWSER") == "required":
        pytest.fail(missing, pytrace=False)
    pytest.skip(missing)


@dataclass
class Recorded:
    """What a page, its frames and its workers did since the page was opened."""

    complaints: list[str] = field(default_factory=list)  # console errors and warnings
    errors: list[str] = field(default_factory=list)  # exceptions that the page did not catch
    requests: list[str] = field(default_factory=list)  # the URL of each, answered or not
    failures: list[tuple[str, str]] = field(default_factory=list)  # URLs not answered, and why

    def left(self, *origins):
        """The requests that left the page, but for those to these origins: http://127.0.0.1:80."""
        allowed = (*WITHIN, *(f"{origin.rstrip('/')}/" for origin in origins))
        return [url for url in self.requests if not f"{url}/".startswith(allowed)]

    def follow(self, context):
        """Records all that happens in a context of Playwright."""
        context.on("console", self._console)
        context.on("weberror", self._error)
        context.on("request", lambda request: self.requests.append(request.url))
        context.on("requestfailed", lambda r: self.failures.append((r.url, r.failure)))
        context.on("page", lambda page: page.on("websocket", self._socket))

    def _console(self, message):
        if message.type in ("error", "warning"):
            self.complaints.append(f"{message.type}: {message.text}")

    def _error(self, event):
        self.errors.append(f"{event.error.name}: {event.error.message}")

    def _socket(self, socket):
        self.requests.append(socket.url)


class Browser:
    """One running browser, for pages one after the other."""

    def __init__(self, chromium, loop):
        self._chromium = chromium
        self._loop = loop

    @contextmanager
    def page(self, recorded):
        """A page in a fresh context (no cookies, storage or cache of another), recorded."""
        with _running(self._loop):
            context = self._chromium.new_context()
            try:
                recorded.follow(context)
                yield context.new_page()
            finally:
                context.close()


@contextmanager
def launched() -> Iterator[Browser]:
    """A browser, which ends with the context, or with this process however that ends."""
    path = find_browser()
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(
            executable_path=path,
            args=ARGUMENTS,
            chromium_sandbox=os.geteuid() != 0,  # else Playwright says --no-sandbox
        )
        loop = asyncio.get_running_loop()
        try:
            with _running(None):
                yield Browser(chromium, loop)
        finally:
            chromium.close()


@contextmanager
def _running(loop):
    """Playwright marks its loop as running until it ends, so asyncio would not run another one.

    Hence the mark is there only while Playwright is used: other tests see nothing of it.
    """
    before = asyncio._get_running_loop()
    asyncio._set_running_loop(loop)
    try:
        yield
    finally:
        asyncio._set_running_loop(before)
