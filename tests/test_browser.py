"""The browser that other tests use: what a page does is recorded, and it can draw."""

import asyncio
import socket

import pytest


@pytest.fixture
def refusing():
    """An address of this machine, where nobody listens."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        yield f"127.0.0.1:{taken.getsockname()[1]}"


def data(script):
    return f"data:text/html,<!doctype html><title>Page</title><script>{script}</script>"


def test_a_quiet_page_leaves_no_trace(page, recorded):
    page.goto(data("console.log('all is well')"))
    assert page.title() == "Page"
    assert (recorded.complaints, recorded.errors, recorded.failures) == ([], [], [])
    assert recorded.left() == []


def test_complaints_and_errors_are_recorded(page, recorded):
    page.goto(data("console.error('one'); console.warn('two'); throw new Error('three')"))
    assert recorded.complaints == ["error: one", "warning: two"]
    assert recorded.errors == ["Error: three"]


@pytest.mark.parametrize(
    "script",
    [
        "fetch('URL').catch(() => { document.title = 'failed' })",
        "const image = new Image(); image.onerror = () => { document.title = 'failed' };"
        "image.src = 'URL'",
        "const code = `fetch('URL').catch(() => postMessage(0))`;"
        "const worker = new Worker(URL.createObjectURL(new Blob([code])));"
        "worker.onmessage = () => { document.title = 'failed' }",
        "const socket = new WebSocket('URL'.replace('http', 'ws'));"
        "socket.onclose = () => { document.title = 'failed' }",
    ],
    ids=["fetch", "image", "worker", "socket"],
)
def test_requests_that_leave_are_recorded(script, page, recorded, refusing):
    url = f"http://{refusing}/there"
    page.goto(data(script.replace("'URL'", f"'{url}'")))
    page.wait_for_function("document.title == 'failed'")
    (left,) = recorded.left()
    assert left in (url, url.replace("http", "ws"))
    assert recorded.left("http://127.0.0.1") == [left]  # another port is another origin
    assert recorded.left(f"http://{refusing}", f"ws://{refusing}") == []
    heard = (*recorded.complaints, *(why for _, why in recorded.failures))
    assert any("ERR_CONNECTION_REFUSED" in text for text in heard)


def test_no_request_leaves_this_machine(page, recorded, refusing):
    url = f"http://{refusing.replace('127.0.0.1', '127.0.0.2')}/"
    page.goto(data(f"fetch('{url}').catch(() => {{ document.title = 'failed' }})"))
    page.wait_for_function("document.title == 'failed'")
    assert recorded.failures == [(url, "net::ERR_NAME_NOT_RESOLVED")]


def test_a_page_can_draw(page, recorded):
    page.goto(data(""))
    pixel = page.evaluate("""() => {
        const gl = document.createElement("canvas").getContext("webgl2")
        gl.clearColor(1, 0, 1, 1)
        gl.clear(gl.COLOR_BUFFER_BIT)
        const pixel = new Uint8Array(4)
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel)
        return Array.from(pixel)
    }""")
    assert pixel == [255, 0, 255, 255]
    assert (recorded.complaints, recorded.errors) == ([], [])


def test_pages_share_nothing(browser, page, recorded):
    assert recorded.requests == []
    assert len(page.context.pages) == 1


def test_other_tests_see_no_running_loop(browser):
    asyncio.run(asyncio.sleep(0))
