"""Replays in a notebook: many in one page, the wheel, and files that can be kept from there."""

import pytest
from test_view_browser import WIDTHS, until

import gne_mj
from gne_mj.notebook import HEIGHT, replay_html

MANY = 20


@pytest.fixture(scope="module")
def replay():
    return replay_html(gne_mj.run("velocity-sync", {"simulation.duration": 0.5}))


def alive(page, number):
    """Scrolls to one of the replays, and waits until it is drawn."""
    page.evaluate(f"n => scrollTo(0, {HEIGHT + 40} * n)", number)
    frame = page.frames[1 + number]
    until(frame, "Boolean(window.gne && window.gne.ready && window.gne.alive())")
    return frame


@pytest.mark.slow  # 20 pages
def test_twenty_replays_live_when_they_are_scrolled_to(page, recorded, replay):
    page.set_viewport_size({"width": 720, "height": 600})
    cell = f"<div style=height:{HEIGHT + 40}px>{replay}</div>"
    page.set_content(f'<body style="margin:0">{cell * MANY}')
    for number in (*range(MANY), 3, 0):
        frame = alive(page, number)
        assert frame.evaluate("window.gne.time()") == 0.0
    has = "Boolean(window.gne && window.gne.alive())"
    assert sum(each.evaluate(has) for each in page.frames[1:]) <= 3
    frame.evaluate("window.gne.seek(0.25)")
    for width, _ in WIDTHS:
        page.set_viewport_size({"width": width, "height": 600})
        assert alive(page, MANY - 1).evaluate("innerWidth") <= width
        assert alive(page, 0).evaluate("window.gne.time()") == pytest.approx(0.25)
        assert frame.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert recorded.errors == []
    assert [text for text in recorded.complaints if "GL Driver" not in text] == []
    assert recorded.left() == []


@pytest.mark.parametrize("width", [1440, pytest.param(1920, marks=pytest.mark.slow)])
def test_the_wheel_scrolls_the_notebook_unless_the_view_has_the_focus(page, replay, width):
    page.set_viewport_size({"width": width, "height": 700})
    page.set_content(f"<div style=height:200px></div>{replay}<div style=height:3000px></div>")
    frame = page.frames[1]
    until(frame, "Boolean(window.gne && window.gne.ready)")
    box = frame.locator("#pane").bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 150)
    before = frame.evaluate("window.gne.zoom()")
    page.mouse.wheel(0, 60)
    until(page, "scrollY === 60")
    assert frame.evaluate("window.gne.zoom()") == pytest.approx(before)
    page.mouse.down()
    page.mouse.up()
    page.mouse.wheel(0, 60)
    until(frame, "before => window.gne.zoom() > 1.02 * before", arg=before)
    assert page.evaluate("scrollY") == 60
    page.keyboard.press("Escape")
    page.mouse.wheel(0, 60)
    until(page, "scrollY === 120")
