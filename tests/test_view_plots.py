"""Plots that one can work with: time and values, lines, scales, files, and the closest approach."""

import csv
import tomllib

import numpy as np
import pytest
from test_view_browser import opened, origins, quiet, seek, session, until

import gne_mj
from gne_mj.scenario import load_scenario
from gne_mj.viewer import serve


@pytest.fixture(scope="module")
def paper():
    return gne_mj.run("paper", {"simulation.duration": 4.0})


@pytest.fixture
def shown(page, recorded, paper):
    server = serve(paper, "the paper")
    opened(page, server.url)
    page.set_viewport_size({"width": 1440, "height": 900})
    yield page
    quiet(recorded, *origins(server))
    server.close()


def plot(page, number):
    return page.evaluate("n => window.gne.plots[n]", number)


def figure(page, number):
    return page.locator("figure.plot").nth(number)


def times(page):
    return plot(page, 0)["time"]


def wheel(page, figure_, x, y, delta):
    """Over a point of the lines' area, given in parts of its width and height."""
    box = figure_.locator(".u-over").bounding_box()
    page.mouse.move(box["x"] + x * box["width"], box["y"] + y * box["height"])
    page.mouse.wheel(0, delta)
    page.evaluate("() => new Promise(resolve => setTimeout(resolve, 60))")


def test_time_and_values_are_zoomed_and_moved(shown):
    first = figure(shown, 0)
    assert times(shown) == [0, 4]
    whole = plot(shown, 0)["values"]
    wheel(shown, first, 0.25, 1.1, -100)  # below: time, about the point
    begin, end = times(shown)
    assert end - begin == pytest.approx(0.7 * 4)
    assert begin + 0.25 * (end - begin) == pytest.approx(1.0, abs=0.02)
    assert [plot(shown, n)["time"] for n in range(6)] == [[begin, end]] * 6
    values = plot(shown, 0)["values"]
    wheel(shown, first, -0.05, 0.5, -100)  # beside: values, of this plot alone
    low, high = plot(shown, 0)["values"]
    assert high - low == pytest.approx(0.7 * (values[1] - values[0]), rel=0.05)
    wheel(shown, first, 0.5, 0.5, -100)  # over the lines it scrolls
    assert times(shown) == [begin, end]

    box = first.locator(".u-over").bounding_box()
    shown.keyboard.down("Shift")  # a stretch of time
    shown.mouse.move(box["x"] + 0.2 * box["width"], box["y"] + 20)
    shown.mouse.down()
    shown.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 20, steps=3)
    shown.mouse.up()
    shown.keyboard.up("Shift")
    wide = end - begin
    expected = [begin + 0.2 * wide, begin + 0.6 * wide]
    assert np.allclose(times(shown), expected, atol=0.02 * wide)
    shown.locator("#plot-tools button", has_text="All").click()
    assert times(shown) == [0, 4]
    assert plot(shown, 0)["values"] == whole


def touch(session, kind, *points):
    fingers = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(points)]
    session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})


def stroke(session, *fingers):
    """Fingers that go down, move and leave, each from one point to another."""
    for kind, part in (("touchStart", 0.0), ("touchMove", 0.5), ("touchMove", 1.0)):
        places = [(a + part * (c - a), b + part * (d - b)) for (a, b), (c, d) in fingers]
        touch(session, kind, *places)
    touch(session, "touchEnd")


def test_fingers_go_to_a_time_pinch_move_and_scroll(shown):
    hands = shown.context.new_cdp_session(shown)
    hands.send("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2})
    shown.set_viewport_size({"width": 390, "height": 844})
    until(shown, "window.gne.plots[0].width < 390")
    figure(shown, 0).evaluate("figure => figure.scrollIntoView()")
    box = figure(shown, 0).locator(".u-over").bounding_box()

    def at(x, y=0.5):
        return box["x"] + x * box["width"], box["y"] + y * box["height"]

    stroke(hands, (at(0.5), at(0.25)))
    until(shown, "Math.abs(window.gne.time() - 1) < 0.05")
    stroke(hands, (at(0.4), at(0.3)), (at(0.6), at(0.7)))
    begin, end = times(shown)
    assert (end - begin, shown.evaluate("window.gne.time()")) == pytest.approx((2, 1), abs=0.1)
    stroke(hands, (at(0.5, 1.05), at(0.25, 1.05)))  # on the axis of time
    assert times(shown)[0] - begin == pytest.approx(0.5, abs=0.05)
    low, high = plot(shown, 0)["values"]
    scrolled = "document.getElementById('main').scrollTop"
    before = shown.evaluate(scrolled)
    stroke(hands, (at(-0.1, 0.3), at(-0.1, 0.8)))  # on that of values
    assert plot(shown, 0)["values"][0] - low == pytest.approx(0.5 * (high - low), rel=0.1)
    assert shown.evaluate(scrolled) == before
    stroke(hands, (at(0.5, 0.9), at(0.5, 0.2)))  # over the lines the page scrolls
    until(shown, f"before => {scrolled} > before", arg=before)
    assert shown.evaluate("window.gne.time()") == pytest.approx(1, abs=0.05)


def test_lines_are_switched_read_and_kept(shown, paper):
    data = paper["robots"]
    first = figure(shown, 0)
    high = plot(shown, 0)["values"][1]
    chip = first.locator(".plot-chip").nth(int(data["action"].to_numpy().max(axis=0).argmax()))
    chip.click()
    assert chip.get_attribute("aria-pressed") == "false"
    assert plot(shown, 0)["values"][1] < high
    first.locator(".plot-chip").nth(1).dblclick()
    assert plot(shown, 0)["hidden"] == [0, 2, 3, 4]

    first.locator(".chart").focus()
    shown.keyboard.press("Home")
    shown.keyboard.press("Shift+ArrowRight")
    said = first.locator("[role=status]").text_content()
    assert said == f"0.50 s: robot 2 {float(data['action'][10, 1]):.2f} m/s"
    assert shown.evaluate("window.gne.time()") == 0  # the key was the plot's
    shown.keyboard.press("Escape")

    shown.evaluate("document.activeElement.blur()")
    wheel(shown, first, 0.0, 1.1, -100)
    with shown.expect_download() as loading:
        first.get_by_text("CSV").click()
    assert loading.value.suggested_filename == "robots-action.csv"
    head, *rows = csv.reader(loading.value.path().read_text().splitlines())
    assert head == ["time (s)", "robot 2 (m/s)"]
    assert 20 < len(rows) < 81  # what is shown
    found = np.array(rows, dtype=float)
    assert np.allclose(found[:, 1], data["action"].sel(time=found[:, 0], method="nearest")[:, 1])
    with shown.expect_download() as loading:
        first.get_by_text("PNG").click()
    assert loading.value.path().read_bytes()[:4] == b"\x89PNG"


def test_margins_on_a_logarithmic_scale(shown, paper):
    number = 2
    assert plot(shown, number)["name"] == "constraint"
    figure(shown, number).locator(".plot-tools .toggle").click()
    margins = -paper["robots"]["constraint"].to_numpy()
    low, high = plot(shown, number)["values"]
    assert low == float(f"{margins.min() / 1.5:.2g}")  # which is written at the axis' end
    assert high == pytest.approx(margins.max() * 1.5, rel=1e-5)
    shown.keyboard.press("d")  # what is switched stays in another theme
    assert plot(shown, number)["log"]


def test_the_closest_approach_is_found(shown, paper):
    worst = paper.reports["robots"]["worst_constraint"]
    chip = shown.locator(".chip button.margin").first
    assert worst["name"] in chip.inner_text()
    seek(shown, 3.0)
    chip.click()
    until(shown, "t => Math.abs(window.gne.time() - t) < 1e-9", arg=worst["time"])
    begin, end = times(shown)
    assert begin <= worst["time"] <= end
    assert end - begin == pytest.approx(0.08 * 4)
    marks = shown.locator("#time-marks button")
    assert "channels: closest approach" in marks.nth(1).get_attribute("aria-label")


SIZES = ((390, 844), (720, 450), (900, 600), (1440, 900), (1920, 1080))
ON_TOP = """selector => {
    const own = document.querySelector(selector)
    own.scrollIntoView({ block: "nearest" })
    const box = own.getBoundingClientRect()
    const found = document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2)
    return own.contains(found) || own.parentElement === found
}"""


@pytest.mark.slow  # a browser at several widths
def test_nothing_covers_anything_at_any_size(page, recorded):
    with session() as live:
        opened(page, live.server.url)
        page.evaluate("document.getElementById('tuning').open = true")
        reference = page.get_by_label("reference v₀, as a number")
        for width, height in SIZES:
            page.set_viewport_size({"width": width, "height": height})
            reference.fill(f"{width}")  # is refused, with a note that covers no part either
            reference.press("Enter")
            page.locator(".toast.error", has_text="stays at 3").wait_for()
            page.evaluate("() => new Promise(resolve => requestAnimationFrame(resolve))")
            assert page.locator("#time-track").bounding_box()["width"] > 150
            assert page.evaluate("document.documentElement.scrollWidth") == width
            assert page.locator("#view").bounding_box()["height"] >= 150
            for part in ("#legend", "#legend .ramp", "#plots figure figcaption", "#plots .chart",
                         "#tuning-body", "#tuning-body .push", "#tools", "#play", "#fold", "#chips",
                         ".toast .icon"):  # fmt: skip
                assert page.evaluate(ON_TOP, part), (width, part)
        quiet(recorded, *origins(live.server))


def test_fit_shows_everything_after_one_was_followed(shown):
    shown.locator("#follow").select_option(index=2)
    assert shown.evaluate("window.gne.state().follow.kind") == "agent"
    shown.locator("#fit").click()
    assert shown.evaluate("window.gne.state().follow.kind") == "fleet"
    assert shown.locator("#follow").input_value() == "fleet"


def test_a_moment_a_run_and_what_was_done_are_kept(page, recorded, tmp_path):
    simulation = load_scenario("velocity-sync", {"simulation.duration": 1.0}).simulation_object()
    simulation.advance(100)
    simulation.change({"barrier.rho": 0.3})
    trajectory = simulation.run()
    server = serve(trajectory, "kept")
    opened(page, f"{server.url}#t=0.4")
    until(page, "window.gne.time() === 0.4")
    page.evaluate("location.hash = 't=0.1.2'")  # no moment
    until(page, "location.hash === '#t=0.1.2'")
    assert page.evaluate("window.gne.time()") == 0.4
    page.locator("#keep summary").click()
    with page.expect_download() as loading:
        page.locator("#keep-run").click()
    path = tmp_path / "run.html"
    loading.value.save_as(path)
    assert page.evaluate("document.getElementById('keep').open") is False
    page.evaluate("navigator.clipboard.writeText = text => { window.name = text }")
    page.locator("#keep summary").click()
    page.locator("#keep-scenario").click()
    until(page, "window.name.includes('interventions')")
    again = gne_mj.run(tomllib.loads(page.evaluate("window.name")))
    assert np.array_equal(again["robots"]["state"], trajectory["robots"]["state"])
    quiet(recorded, *origins(server))
    server.close()
    opened(page, path.as_uri())
    assert page.locator("#keep-run").is_hidden()
