"""The page in a real browser: live, replayed, and as a file from disk.

The scene graph is asked where it has each robot, which must be where the data has it.
"""

import io
import threading
import time
from contextlib import contextmanager

import mujoco
import numpy as np
import pytest
from browser import Recorded
from PIL import Image

import gne_mj
from gne_mj.notebook import notebook_html, replay_html
from gne_mj.plants.fleet import read_model
from gne_mj.scenario import load_scenario
from gne_mj.viewer import Session, serve, write_html
from gne_mj.viewer.surroundings import sky_of

READY = "window.gne && window.gne.ready"
CLOSE = 1e-6  # m
WIDTHS = ((390, 844), (720, 900), (1440, 900), (1920, 1080))
OUTSIDE = "rgb(219, 5, 41)"


@pytest.fixture(scope="module")
def paper():
    return gne_mj.run("paper", {"simulation.duration": 4.0})


@pytest.fixture
def served(paper):
    server = serve(paper, "the paper")
    yield server
    server.close()


@contextmanager
def session(scenario="velocity-sync", changes=None, speed=1.0, **options):
    """A live session in a thread, as in a terminal."""
    loaded = load_scenario(scenario, {"simulation.duration": 1000.0, **(changes or {})})
    live, stop = Session(loaded, "live", speed=speed, **options), threading.Event()

    def work():
        live.show(live.run(stop))
        live.linger(stop)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield live
    finally:
        stop.set()
        thread.join(30)
        live.server.close()
        assert not thread.is_alive()


def opened(page, url):
    page.goto(url)
    until(page, READY)
    return page


def until(page, expression, arg=None, patience=60.0):
    """Waits for an expression to hold; Playwright's own way needs an `eval` that pages refuse."""
    end = time.monotonic() + patience
    while not page.evaluate(expression, arg):
        assert time.monotonic() < end, expression
        page.evaluate("() => new Promise(resolve => setTimeout(resolve, 20))")


def position(page, item):
    return np.array(page.evaluate("item => window.gne.position(item)", item))


def seek(page, time):
    page.evaluate("time => window.gne.seek(time)", time)


def quiet(recorded, *origins):
    """No complaint, no error, and nothing asked of anybody else."""
    # what a software renderer says of its own speed is no complaint of the page
    assert [text for text in recorded.complaints if "GL Driver Message" not in text] == []
    assert recorded.errors == []
    assert recorded.left(*origins) == []


def origins(server):
    return f"http://127.0.0.1:{server.port}", f"ws://127.0.0.1:{server.port}"


def test_replayed_robots_are_where_the_trajectory_has_them(page, recorded, served, paper):
    opened(page, served.url)
    data = paper["robots"]
    times = data["time"].to_numpy()
    for sample in (0, 7, 40, -1):
        seek(page, times[sample])
        for agent in range(5):
            place = position(page, f"meshcat/robots/robot_{agent + 1}/main")
            assert np.allclose(place, [data["position"][sample, agent], 0, 0], atol=CLOSE)
            ball = position(page, f"meshcat/robots/robot_{agent + 1}/appendage")
            behind = data["position"][sample, agent] - data["extension"][sample, agent]
            assert np.allclose(ball, [behind, 0, 0], atol=CLOSE)
    seek(page, 0.5 * (times[10] + times[11]))  # between samples along a line
    between = 0.5 * (data["position"][10, 2] + data["position"][11, 2])
    place = position(page, "meshcat/robots/robot_3/main")
    assert np.allclose(place, [between, 0, 0], atol=CLOSE)
    assert page.title() == "the paper · gne_mj"
    quiet(recorded, *origins(served))


def test_the_page_defines_one_name(page, served):
    names = "Object.getOwnPropertyNames(window)"
    page.goto(served.url + "uPlot-LICENSE.txt")  # of the same origin, without scripts
    page.add_script_tag(url="meshcat.min.js")
    before = set(page.evaluate(names))
    opened(page, served.url)
    assert set(page.evaluate(names)) - before == {"gne"}


def test_the_slider_drives_scene_and_plots(page, served, paper):
    opened(page, served.url)
    page.locator("#time-slider").evaluate(
        "e => { e.value = 2; e.dispatchEvent(new Event('input', { bubbles: true })) }"
    )
    until(page, "Math.abs(window.gne.time() - 2) < 0.03")
    now = page.evaluate("window.gne.time()")
    data = paper["robots"].interp(time=now)
    place = position(page, "meshcat/robots/robot_5/main")
    assert np.allclose(place[0], data["position"][4], atol=CLOSE)
    until(page, "text => document.getElementById('time').textContent === text", arg=f"{now:.2f}")


def test_the_lane_has_its_sky_and_light_in_both_themes(page, recorded, served):
    """Its own colours, darkened or paled so that texts stay readable; light is white, and no more
    than a white surface can show."""
    opened(page, served.url)
    sky = sky_of(mujoco.MjModel.from_xml_string(read_model("lane.xml")))
    shown = {"dark": lambda v: 0.25 * v, "light": lambda v: 1 - 0.35 * (1 - v)}
    for _ in shown:
        in_theme = shown[page.evaluate("window.gne.state().theme")]
        expected = np.round(255 * in_theme(np.array(sky)))
        around = page.evaluate("window.gne.around()")
        drawn = [[int(part) for part in each[4:-1].split(",")] for each in around["sky"]]
        assert np.allclose(drawn, expected, atol=1)
        clip = {**page.locator("#pane").bounding_box(), "width": 4, "height": 4}
        corner = np.asarray(Image.open(io.BytesIO(page.screenshot(clip=clip))))[..., :3]
        assert np.allclose(corner.mean(axis=(0, 1)), expected[1], atol=12)  # near the horizon
        page.keyboard.press("d")
    above, head, sun = around["lights"]
    assert {each["colour"] for each in around["lights"]} == {"rgb(255, 255, 255)"}
    assert sum(each["intensity"] for each in around["lights"]) == pytest.approx(1, abs=1e-3)
    assert np.allclose(sun["from"], [0, -0.406, 0.914])
    assert head["intensity"] > 0 < above["intensity"]
    quiet(recorded, *origins(served))


def test_plots_have_the_bounds_and_all_lines(page, served):
    opened(page, served.url)
    plots = {(p["system"], p["name"]): p for p in page.evaluate("window.gne.plots")}
    assert set(plots) == {
        ("robots", "action"), ("robots", "gap"), ("robots", "constraint"), ("robots", "lyapunov"),
        ("channels", "action"), ("channels", "total_power"), ("channels", "constraint"),
        ("channels", "lyapunov"),
    }  # fmt: skip
    assert sorted(plots["robots", "gap"]["bounds"]) == [-3, 3]
    assert plots["channels", "total_power"]["bounds"] == [2.5]
    assert plots["robots", "action"]["series"] == ["1", "2", "3", "4", "5"]
    assert len(plots["channels", "action"]["series"]) == 10
    assert all(p["width"] > 200 and p["samples"] == 81 for p in plots.values())


def test_keys_and_buttons_drive_a_replay(page, recorded, served):
    opened(page, served.url)
    page.keyboard.press("ArrowRight")
    until(page, "Math.abs(window.gne.time() - 0.05) < 1e-9")
    page.keyboard.press("Shift+ArrowRight")
    until(page, "Math.abs(window.gne.time() - 1.05) < 1e-9")
    page.keyboard.press("ArrowLeft")
    until(page, "Math.abs(window.gne.time() - 1.0) < 1e-9")
    page.keyboard.press("Space")
    until(page, "window.gne.time() > 1.1")
    page.keyboard.press("Space")
    until(page, "!window.gne.state().playing")
    page.keyboard.press("r")
    until(page, "window.gne.time() === 0")
    before = page.evaluate("window.gne.state().theme")
    page.keyboard.press("d")
    until(page, "theme => window.gne.state().theme !== theme", arg=before)
    page.keyboard.press("g")
    until(page, "window.gne.state().ghosts !== null")
    page.keyboard.press("?")
    assert page.locator("#help").is_visible()
    page.keyboard.press("Escape")
    quiet(recorded, *origins(served))


def test_outputs_region_and_distances_lie_on_the_ground(page, recorded):
    trajectory = gne_mj.run("formation", {"simulation.duration": 2.0})
    data, server = trajectory["robots"], serve(trajectory)
    try:
        opened(page, server.url)
        for sample in (0, 10, -1):
            time = float(data["time"][sample])
            seek(page, time)
            plan = page.evaluate("window.gne.plan('robots')")
            moved = time * np.array([1.0, 0.5])
            outputs = data["action"][sample].values.reshape(5, 2) + moved
            assert np.allclose(plan["outputs"], outputs, atol=1e-5)
            assert np.allclose(plan["region"], moved)
            assert len(plan["strips"]) == 4
        assert plan["discs"] == [None] * 5
        quiet(recorded, *origins(server))
    finally:
        server.close()


def test_a_file_opens_from_disk_without_any_network(page, recorded, paper, tmp_path):
    path = write_html(paper, tmp_path / "run.html", "from disk")
    page.context.set_offline(True)
    opened(page, path.as_uri())
    seek(page, 4.0)
    place = position(page, "meshcat/robots/robot_1/main")
    assert np.allclose(place[0], paper["robots"]["position"][-1, 0], atol=CLOSE)
    page.keyboard.press("Space")
    quiet(recorded, "file://")
    assert recorded.requests == [path.as_uri()]


def test_an_exit_is_shown_in_words_and_in_red(page, recorded):
    changes = {"controller.mode": "sampled", "simulation.control_period": 1.0,
               "simulation.duration": 3.0}  # fmt: skip
    trajectory = gne_mj.run("velocity-sync", changes)
    assert trajectory.status == "left_feasible_set"
    server = serve(trajectory)
    try:
        opened(page, server.url)
        page.evaluate("window.gne.seek(1e9)")
        until(page, "!document.getElementById('banner').hidden")
        text = page.locator("#banner").inner_text()
        assert trajectory.reports["robots"]["message"] in text
        left = trajectory.reports["robots"]["exit"]
        assert page.evaluate("window.gne.state().exits.robots") == pytest.approx(left["time"])
        for width, height in WIDTHS:
            page.set_viewport_size({"width": width, "height": height})
            page.locator(".exit-line").first.wait_for(state="visible")
            texts = [each["text"] for each in page.evaluate("window.gne.labels()")]
            # and not 100.0 %, as what is 0.04 % beyond the bound would be rounded
            assert texts.count("⚠ outside") == len(left["agents"])
        quiet(recorded, *origins(server))
    finally:
        server.close()


def test_agents_in_a_violated_constraint_are_red_without_any_share(page, recorded):
    changes = {"controller.mode": "sampled", "simulation.timestep": 0.01,
               "simulation.control_period": 0.3}  # fmt: skip
    trajectory = gne_mj.run("cournot", changes)
    assert trajectory.status == "left_feasible_set"
    agents = trajectory.reports["firms"]["exit"]["agents"]
    server = serve(trajectory)
    try:
        opened(page, server.url)
        tint = "agent => window.gne.tint(agent, 'firms')"
        before = {page.evaluate(tint, agent) for agent in range(10)}
        assert OUTSIDE not in before  # colours are of shares of their own constraints
        page.evaluate("window.gne.seek(1e9)")
        red = [agent + 1 for agent in range(10) if page.evaluate(tint, agent) == OUTSIDE]
        assert red == agents
        quiet(recorded, *origins(server))
    finally:
        server.close()


def test_one_browser_too_many_is_told_so(page, monkeypatch):
    monkeypatch.setattr("gne_mj.viewer.server.BROWSERS", 0)
    with session() as live:
        page.goto(live.server.url)
        page.locator("#lost").wait_for(state="visible")
        assert "there are 0 browsers already" in page.locator("#lost").inner_text()


def test_a_notebook_shows_the_replay(page, recorded, paper):
    page.set_content(replay_html(paper) + notebook_html(paper))
    frame = page.frames[1]
    until(frame, READY)
    assert (
        frame.evaluate("window.gne.state().systems.robots.status")
        == paper.reports["robots"]["status"]
    )
    assert page.locator("table").count() == 2
    assert recorded.errors == []
    assert recorded.left() == []


def test_live_robots_are_where_the_simulation_has_them(page, recorded):
    with session("paper", speed=4.0) as live:
        opened(page, live.server.url)
        until(page, "window.gne.time() > 1")
        page.keyboard.press("Space")
        until(page, "!window.gne.state().playing")
        paused = live.simulation.time
        page.keyboard.press("ArrowRight")
        until(page, "t => window.gne.time() > t + 0.04", arg=paused)
        assert live.simulation.time == pytest.approx(paused + 0.05)
        state = live.simulation.runs["robots"].loop.present().state
        for agent in range(5):  # as soon as that frame is drawn
            there = "([item, x]) => Math.abs(window.gne.position(item)[0] - x) < 1e-6"
            until(
                page, there, arg=[f"meshcat/robots/robot_{agent + 1}/main", float(state[agent, 3])]
            )
        until(page, "window.gne.plots[0].samples > 10")
        page.keyboard.press("Space")
        until(page, "window.gne.state().playing")
        quiet(recorded, *origins(live.server))


def test_a_chip_says_whether_its_run_goes_on(page):
    with session(begin="paused") as live:
        opened(page, live.server.url)
        chip = page.locator(".chip")
        assert chip.inner_text().split("\n")[1:] == ["robots: not begun", "no margin yet"]
        page.keyboard.press("Space")
        chip.get_by_text("running").wait_for()
        page.keyboard.press("Space")
        chip.get_by_text("paused").wait_for()
        live.server.close()
        chip.get_by_text("not connected").wait_for()


def test_a_run_begins_with_its_first_browser(page, recorded):
    with session(begin="viewer") as live:
        time.sleep(0.1)
        assert live.simulation.time == 0.0
        opened(page, live.server.url)
        until(page, "window.gne.time() > 0.05")
        assert page.evaluate("window.gne.plots[0].samples") > 1
        quiet(recorded, *origins(live.server))


@pytest.mark.slow
def test_two_browsers_see_the_same_and_one_may_go(browser, page, recorded):
    with session() as live:
        opened(page, live.server.url)
        with browser.page(Recorded()) as other:
            opened(other, live.server.url)
            slider = page.locator("input[type=number]").first
            slider.fill("0.7")
            slider.press("Enter")
            until(other, "parseFloat(document.querySelector('input[type=number]').value) === 0.7")
            assert live.simulation.systems[0].rho == 0.7
            other.keyboard.press("Space")
            until(page, "!window.gne.state().playing")
            page.locator("#play").click()
            until(other, "window.gne.state().playing")
        until(page, "n => window.gne.framesReceived > n + 5",
                               arg=page.evaluate("window.gne.framesReceived"))  # fmt: skip
        assert len(live.server.browsers) == 1
        quiet(recorded, *origins(live.server))


def test_sliders_and_pushes_act_on_the_simulation(page, recorded):
    with session() as live:
        opened(page, live.server.url)
        page.locator("button.push").first.click()
        until(page, "window.gne.state().time >= 0")
        live_wait(lambda: live.simulation.interventions)
        assert "pushed by" in live.simulation.interventions[0]["what"]
        reference = page.locator("input[type=number]").nth(1)
        reference.fill("300")
        reference.press("Enter")
        page.locator(".toast.error").wait_for()
        assert "it stays at 3" in page.locator(".toast.error").first.inner_text()
        said = page.locator(".toast.error").inner_text()
        reference.fill("301")  # another sentence about the same takes its place
        reference.press("Enter")
        until(page, "said => document.querySelector('.toast.error').innerText !== said", arg=said)
        assert page.locator(".toast.error").count() == 1
        page.locator(".toast.error button").click()
        assert page.locator(".toast.error").count() == 0
        assert len(live.simulation.interventions) == 1
        reference.fill("302")
        reference.press("Enter")
        page.locator(".toast.error").wait_for()
        reference.fill("2.9")  # with which what was said of the slider is the past
        reference.press("Enter")
        until(page, "!document.querySelector('.toast.error')")
        quiet(recorded, *origins(live.server))


def live_wait(condition, patience=10.0):
    event = threading.Event()
    for _ in range(int(patience / 0.02)):
        if condition():
            return
        event.wait(0.02)
    raise AssertionError("it never came true")


LOSSY = {
    "controller": {"information": "partial", "graph": "ring", "mode": "sampled"},
    "simulation.control_period": 0.02,
    "faults": [{"type": "message-loss", "probability": 0.5}],
}


def test_messages_of_a_replay_run_along_their_links(page, recorded):
    server = serve(gne_mj.run("velocity-sync", {**LOSSY, "simulation.duration": 2.0}))
    try:
        opened(page, server.url)
        assert page.evaluate("window.gne.state().pulses") == 0
        page.keyboard.press("ArrowRight")
        until(page, "window.gne.state().pulses > 0")
        quiet(recorded, *origins(server))
    finally:
        server.close()


def test_messages_run_along_their_links_and_can_be_switched_off(page, recorded):
    with session(changes=LOSSY) as live:
        opened(page, live.server.url)
        until(page, "window.gne.state().pulses > 0")
        page.keyboard.press("c")
        until(page, "window.gne.state().pulses === 0")
        page.keyboard.press("c")
        until(page, "window.gne.state().pulses > 0")
        page.keyboard.press("g")
        until(page, "window.gne.state().ghosts !== null")
        quiet(recorded, *origins(live.server))


def test_a_run_that_has_ended_becomes_its_replay(page, recorded):
    with session(changes={"simulation.duration": 1.0}, speed=5.0) as live:
        opened(page, live.server.url)
        until(page, "window.gne.state().replaying")
        until(page, "!document.getElementById('time-slider').disabled")
        seek(page, 0.5)
        place = position(page, "meshcat/robots/robot_2/main")
        expected = gne_mj.run("velocity-sync", {"simulation.duration": 1.0})["robots"]
        assert np.allclose(place[0], expected["position"].sel(time=0.5)[1], atol=CLOSE)
        page.locator("#restart").click()
        until(page, "!window.gne.state().replaying")
        quiet(recorded, *origins(live.server))


def test_a_page_whose_simulation_is_gone_says_so(page):
    with session() as live:
        opened(page, live.server.url)
    page.locator("#lost").wait_for(state="visible")
    assert "connection lost" in page.locator("#lost").inner_text()
