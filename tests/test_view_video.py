"""Videos of a stretch of a replay: a file that players open, with a picture at each exact time."""

import base64
import struct
from pathlib import Path

import pytest
from test_view_browser import WIDTHS, opened, origins, quiet, seek, until

import gne_mj
from gne_mj.viewer import serve

# Elements of Matroska (RFC 9559) that hold others, and those that are looked at
MASTERS = {0x18538067, 0x1549A966, 0x1654AE6B, 0xAE, 0xE0, 0x1F43B675, 0x1C53BB6B, 0xBB, 0xB7}
SEGMENT, DURATION, CLUSTER, TIMECODE, BLOCK = 0x18538067, 0x4489, 0x1F43B675, 0xE7, 0xA3
CODEC, CUE, WIDTH, HEIGHT = 0x86, 0xF1, 0xB0, 0xBA
MOST = 1280  # px


def elements(data, at=0, end=None):
    """(number, place, content) of all elements, one after the other."""
    end = len(data) if end is None else end
    while at < end:
        begin = at
        length = 9 - data[at].bit_length()
        number = int.from_bytes(data[at : at + length], "big")
        at += length
        length = 9 - data[at].bit_length()
        size = int.from_bytes(data[at : at + length], "big") - (1 << 7 * length)
        at += length
        yield number, begin, data[at : at + size]
        if number in MASTERS:
            yield from (
                (n, at + place, content) for n, place, content in elements(data[at : at + size])
            )
        at += size


@pytest.fixture(scope="module")
def run():
    return gne_mj.run("paper", {"simulation.duration": 4.0})


def saved(page):
    page.locator("#keep summary").click()
    with page.expect_download(timeout=120_000) as download:
        page.locator("#keep-video").click()
    return download.value


@pytest.mark.slow
def test_a_stretch_becomes_a_video(page, recorded, run):
    """Its elements are read here by RFC 9559, and a browser's own player plays it."""
    server = serve(run, "a paper: two")
    try:
        page.set_viewport_size({"width": 720, "height": 450})
        opened(page, server.url)
        seek(page, 3.0)
        page.evaluate("window.gne.show(1, 2)")
        page.locator("#speed").select_option("2")
        download = saved(page)
        assert download.suggested_filename == "a_paper_two_1.00-2.00_s.webm"
        data = Path(download.path()).read_bytes()
        assert data[:4] == b"\x1a\x45\xdf\xa3"
        found = list(elements(data))
        (duration,) = (struct.unpack(">d", content)[0] for n, _, content in found if n == DURATION)
        assert duration == 500.0  # 1 s at twice the speed
        assert [content for n, _, content in found if n == CODEC] == [b"V_VP8"]
        times = []
        for number, _, content in found:
            if number == TIMECODE:
                begin = int.from_bytes(content, "big")
            if number == BLOCK:
                times.append(begin + int.from_bytes(content[1:3], "big"))
        assert times == [round(1000 * n / 30) for n in range(15)]
        until(page, "!document.getElementById('recording').checkVisibility()")
        assert page.evaluate("window.gne.time()") == pytest.approx(3.0)
        quiet(recorded, *origins(server))
    finally:
        server.close()
    clusters = [place for n, place, _ in found if n == CLUSTER]
    (segment,) = (place for n, place, _ in found if n == SEGMENT)
    cues = [int.from_bytes(content, "big") for n, _, content in found if n == CUE]
    assert [segment + 12 + place for place in cues] == clusters
    played(page, data)


def played(page, data):
    """A browser plays it, and it moves."""
    page.goto("about:blank")
    page.set_content("<video muted></video>")
    page.evaluate(
        "text => { document.querySelector('video').src = 'data:video/webm;base64,' + text }",
        base64.b64encode(data).decode(),
    )
    until(page, "document.querySelector('video').readyState >= 2")
    duration, width, error = page.evaluate(
        """() => {
          const { duration, videoWidth, error } = document.querySelector("video");
          return [duration, videoWidth, error];
        }"""
    )
    assert error is None
    assert duration == pytest.approx(0.5)
    assert width == 720
    first, last = (
        page.evaluate(
            """async time => {
              const video = document.querySelector("video");
              video.currentTime = time;
              await new Promise(resolve => (video.onseeked = resolve));
              const canvas = document.createElement("canvas");
              [canvas.width, canvas.height] = [90, 60];
              canvas.getContext("2d").drawImage(video, 0, 0, 90, 60);
              return [...canvas.getContext("2d").getImageData(0, 0, 90, 60).data];
            }""",
            time,
        )
        for time in (0.01, 0.45)
    )
    assert len(set(first)) > 50
    assert sum(abs(a - b) > 20 for a, b in zip(first, last, strict=True)) > 50


@pytest.mark.slow  # several videos
def test_a_video_is_of_what_is_seen_at_every_width(page, recorded, run):
    """Of its view's shape, no wider than is allowed, with nothing over the view in the way."""
    server = serve(run, "paper")
    try:
        opened(page, server.url)
        page.evaluate("window.gne.show(1, 1.1)")
        for width, height in WIDTHS:
            page.set_viewport_size({"width": width, "height": height})
            seek(page, 1.0)
            view = page.locator("#view").bounding_box()
            found = list(elements(Path(saved(page).path()).read_bytes()))
            assert sum(number == BLOCK for number, *_ in found) == 3
            wide, high = (
                int.from_bytes(next(content for n, _, content in found if n == each), "big")
                for each in (WIDTH, HEIGHT)
            )
            assert wide <= MOST
            assert wide / high == pytest.approx(view["width"] / view["height"], rel=0.01)
            until(page, "!document.getElementById('recording').checkVisibility()")
        quiet(recorded, *origins(server))
    finally:
        server.close()


def test_what_cannot_be_a_video_is_told(page, run):
    server = serve(run, "paper")
    try:
        opened(page, server.url)
        page.evaluate("() => { window.encoder = window.VideoEncoder; delete window.VideoEncoder }")
        page.locator("#keep summary").click()
        page.locator("#keep-video").click()
        page.locator(".toast.error", has_text="This browser cannot make videos").wait_for()
        page.evaluate("() => { window.VideoEncoder = window.encoder; window.gne.speed(0.01) }")
        page.locator("#keep summary").click()
        page.locator("#keep-video").click()
        page.locator(".toast.error", has_text="A video has at most 120 s").wait_for()
    finally:
        server.close()
