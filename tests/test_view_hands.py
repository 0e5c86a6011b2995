"""Hands on a live page: robots dragged, joints looked at, links lost by a click, at every width."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from test_view_browser import (
    WIDTHS,
    live_wait,
    opened,
    origins,
    quiet,
    seek,
    session,
    until,
)

import gne_mj
from gne_mj.scenario import as_done, load_scenario
from gne_mj.viewer import serve

ROBOTS = Path(__file__).parents[1] / "examples" / "robot" / "scenario.toml"
PARTIAL = {"controller": {"information": "partial", "graph": "ring", "coupling": 5.0}}


def settled(page):
    """Two pictures, so that what was drawn is of now."""
    page.evaluate(
        "() => new Promise(r => requestAnimationFrame(() => requestAnimationFrame(() => r())))"
    )


def head(page, *agents, system="robots"):
    """Where an agent's head, or the middle of a link, from 0, is in the window."""
    settled(page)
    at = page.evaluate("a => window.gne.head(...a)", [system, *agents])
    box = page.locator("#pane").bounding_box()
    return box["x"] + at["x"], box["y"] + at["y"]


def paused(page):
    page.keyboard.press("Space")
    until(page, "!window.gne.state().playing")


def drag(page, at, by):
    page.mouse.move(*at)
    page.mouse.down()
    page.mouse.move(at[0] + by[0] / 2, at[1] + by[1] / 2)
    page.mouse.move(at[0] + by[0], at[1] + by[1])
    settled(page)
    told, labels = page.evaluate("[window.gne.told(), window.gne.labels()]")
    page.mouse.up()
    return told, labels


def apart(one, other):
    """Whether two boxes have nothing in common."""
    return (
        one["x"] >= other["x"] + other["w"] or other["x"] >= one["x"] + one["w"]
        or one["y"] >= other["y"] + other["h"] or other["y"] >= one["y"] + one["h"]
    )  # fmt: skip


@pytest.mark.slow  # a browser at several widths
def test_a_drag_pushes_a_robot_at_every_width(page, recorded):
    """A drag of 60 px is 6 N, whatever the size of the window, and leaves the camera alone."""
    with session() as live:
        opened(page, live.server.url)
        paused(page)
        page.evaluate("document.getElementById('tuning').open = true")
        page.locator(".push-number").nth(1).fill("0.4")
        page.locator(".push-number").nth(1).blur()
        for number, (width, height) in enumerate(WIDTHS):
            page.set_viewport_size({"width": width, "height": height})
            page.evaluate("document.getElementById('tuning').open = false")
            settled(page)  # the view has its new size
            page.keyboard.press("f")
            settled(page)
            camera = page.evaluate("window.gne.head('robots', 0)")
            drag(page, head(page, 1), (60.0, 0.0))
            live_wait(lambda n=number: len(live.simulation.interventions) > 2 * n, 60.0)
            done = live.simulation.interventions[-1]
            assert (done["agent"], done["duration"]) == (2, 0.4)
            # 5 N are a drag of 50 px along x, which the view shows but for its perspective
            assert done["force"] == pytest.approx(6.0, rel=0.05)
            settled(page)
            assert page.evaluate("window.gne.head('robots', 0)") == pytest.approx(camera, abs=2.0)
            # the text of the force is in the pane and off the labels, at the fleet's edge too
            here, pane = head(page, 4), page.locator("#pane").bounding_box()
            told, labels = drag(page, here, (pane["x"] + pane["width"] - here[0] - 4, 0.0))
            assert told["x"] >= 0
            assert told["x"] + told["w"] <= pane["width"]
            assert all(apart(told, label) for label in labels)
            live_wait(lambda n=number: len(live.simulation.interventions) > 2 * n + 1, 60.0)
        quiet(recorded, *origins(live.server))


@pytest.mark.slow
def test_a_finger_pushes_and_a_finger_beside_turns_the_view(page, recorded):
    with session() as live:
        opened(page, live.server.url)
        page.set_viewport_size({"width": 390, "height": 844})
        paused(page)
        hands = page.context.new_cdp_session(page)
        hands.send("Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2})

        def stroke(at, by):
            for kind, part in (("touchStart", 0.0), ("touchMove", 0.5), ("touchMove", 1.0)):
                point = {"x": at[0] + part * by[0], "y": at[1] + part * by[1], "id": 0}
                hands.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [point]})
            hands.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})

        page.locator("#view").scroll_into_view_if_needed()
        stroke(head(page, 4), (-40.0, 0.0))
        live_wait(lambda: live.simulation.interventions, 60.0)
        (done,) = live.simulation.interventions
        assert (done["agent"], done["force"]) == (5, pytest.approx(-4.0, rel=0.05))
        before = page.evaluate("window.gne.head('robots', 0)")
        box = page.locator("#pane").bounding_box()
        stroke((box["x"] + 30, box["y"] + box["height"] - 20), (60.0, 0.0))
        settled(page)
        assert page.evaluate("window.gne.head('robots', 0)") != before
        assert len(live.simulation.interventions) == 1
        quiet(recorded, *origins(live.server))


@pytest.mark.slow
def test_a_drag_in_the_plane_pushes_along_both_axes(page, recorded):
    with session("planar-sync") as live:
        opened(page, live.server.url)
        paused(page)
        here = head(page, 2)
        drag(page, here, (45.0, -30.0))
        live_wait(lambda: len(live.simulation.interventions) == 2, 60.0)
        one, other = live.simulation.interventions
        assert (one["axis"], other["axis"], one["time"]) == ("x", "y", other["time"])
        force = 5.0 * np.hypot(45.0, 30.0) / 50.0
        assert np.hypot(one["force"], other["force"]) == pytest.approx(force, rel=0.01)
        assert min(one["force"], other["force"]) > 0  # to the right, and away
        assert page.evaluate("window.gne.state().follow.kind") == "fleet"
        quiet(recorded, *origins(live.server))


@pytest.mark.slow  # a fleet with controllers of its own
def test_cars_are_dragged_along_their_own_axis(page, recorded):
    """A car that faces the viewer is pushed back by the drag that pushes others forward."""
    tables = load_scenario("cars").model_dump(mode="json", exclude_none=True)
    agents = tables["systems"]["cars"]["agents"]
    del agents["spacing"]
    agents["poses"] = [{"position": [0.0, 1.0 * i, 0.0], "yaw": np.pi * (i == 1)} for i in range(4)]
    with session(tables, begin="paused") as live:
        opened(page, live.server.url)
        for agent in (0, 1):
            drag(page, head(page, agent, system="cars"), (0.0, -60.0))  # seen from behind
            live_wait(lambda n=agent: len(live.simulation.interventions) > n, 60.0)
        one, other = live.simulation.interventions
        assert (one["agent"], other["agent"]) == (1, 2)
        assert one["force"] == pytest.approx(6.0, rel=0.1)
        assert other["force"] == pytest.approx(-6.0, rel=0.1)
        quiet(recorded, *origins(live.server))


@pytest.mark.slow  # a fleet with controllers of its own
def test_drones_are_dragged_in_space(page, recorded):
    with session("drones", begin="paused") as live:
        opened(page, live.server.url)
        drag(page, head(page, 3, system="drones"), (45.0, -30.0))
        live_wait(lambda: len(live.simulation.interventions) == 2, 60.0)
        page.keyboard.down("Shift")
        drag(page, head(page, 3, system="drones"), (0.0, 50.0))
        page.keyboard.up("Shift")
        live_wait(lambda: len(live.simulation.interventions) == 3, 60.0)
        done = [(each["agent"], each["axis"]) for each in live.simulation.interventions]
        assert done == [(4, "x"), (4, "y"), (4, "z")]
        x, y, z = (each["force"] for each in live.simulation.interventions)
        # of a drone of 0.38 kg 50 px are 2 N
        assert np.hypot(x, y) == pytest.approx(2.0 * np.hypot(45.0, 30.0) / 50.0, rel=0.01)
        assert z == pytest.approx(-2.0, rel=0.1)
        quiet(recorded, *origins(live.server))


@pytest.mark.slow  # a browser at several widths
def test_joints_are_read_and_robots_pushed_by_keyboard(page, recorded):
    """Cells show MuJoCo's own qpos, qvel and ctrl."""
    with session() as live:
        opened(page, live.server.url)
        paused(page)
        page.mouse.click(*head(page, 2))
        until(page, "window.gne.state().chosen?.agent === 2")
        panel = page.locator("#chosen")
        until(page, "document.querySelector('#chosen td span')?.textContent")
        data = live.simulation.runs["robots"].loop.plant.data
        shown = [text.replace("−", "-") for text in panel.locator("td span").all_inner_texts()]
        expected = [data.qpos[4], data.qvel[4], data.qpos[5], data.qvel[5], data.ctrl[2]]
        assert np.allclose([float(text) for text in shown], expected, atol=1e-3)
        assert panel.locator("small").all_inner_texts() == [" m", " m/s", " m", " m/s", " N"]
        panel.get_by_label("push robot 3 against its axis").focus()
        page.keyboard.press("Enter")
        live_wait(lambda: live.simulation.interventions, 60.0)
        assert live.simulation.interventions[0]["what"] == "robot 3 pushed by -5 N for 0.2 s"
        for width, height in WIDTHS:
            page.set_viewport_size({"width": width, "height": height})
            settled(page)
            inner, outer = panel.bounding_box(), page.locator("#view").bounding_box()
            assert inner["x"] >= outer["x"]
            assert inner["x"] + inner["width"] <= outer["x"] + outer["width"]
            low, high = inner["y"], inner["y"] + inner["height"]
            bottom = outer["y"] + outer["height"]
            beside = low >= bottom if width < 1000 else low >= outer["y"] and high <= bottom
            assert beside, width
        panel.get_by_label("close").click()
        assert panel.is_hidden()
        quiet(recorded, *origins(live.server))


def test_joints_of_a_replay(page, recorded):
    """Cells show what the run's dataset has of that time."""
    trajectory = gne_mj.run("velocity-sync", {"simulation.duration": 1.0})
    data, server = trajectory["robots"], serve(trajectory)
    try:
        opened(page, server.url)
        page.locator("#follow").select_option(index=3)  # robot 3
        seek(page, 0.5)
        until(page, "document.querySelector('#chosen td span')?.textContent")
        row = data.sel(time=0.5, agent=3)
        expected = [
            float(row[name]) for name in ("position", "action", "appendage_velocity", "input")
        ]
        shown = page.locator("#chosen td span").all_inner_texts()
        found = [float(shown[k].replace("−", "-")) for k in (0, 1, 3, 4)]
        assert np.allclose(found, expected, atol=2e-3)
        assert page.locator("#chosen button.push").count() == 0
        quiet(recorded, *origins(server))
    finally:
        server.close()


@pytest.mark.slow  # a browser at several widths
def test_joints_that_were_not_recorded_are_told(page, recorded):
    """Of robots from files of one's own a replay has the velocities of outputs alone."""
    trajectory = gne_mj.run(ROBOTS, {"simulation.duration": 0.5})
    data, server = trajectory["fleet"], serve(trajectory)
    try:
        opened(page, server.url)
        page.locator("#follow").select_option(label="robot 1")
        seek(page, 0.25)
        row = data.sel(time=0.25, agent=1, method="nearest")
        travel, swing = row["configuration"].to_numpy()[:2]  # of the first crane
        expected = [travel, float(row["action"]), swing, float(row["input"])]
        for width, height in WIDTHS:
            page.set_viewport_size({"width": width, "height": height})
            until(page, "document.querySelector('#chosen td span')?.textContent")
            panel = page.locator("#chosen")
            shown = [text.replace("−", "-") for text in panel.locator("td span").all_inner_texts()]
            assert np.allclose([float(text) for text in shown], expected, atol=2e-3)
            assert panel.locator("td.muted").all_inner_texts() == ["–"]  # how fast it swings
            assert "Its other numbers were not recorded." in panel.inner_text()
            box = panel.bounding_box()
            assert 0 <= box["x"] < box["x"] + box["width"] <= width
        quiet(recorded, *origins(server))
    finally:
        server.close()


@pytest.mark.slow  # a browser at several widths
def test_links_are_lost_by_a_click_and_kept_in_the_scenario(page, recorded):
    # later robots may pass where a link's middle is, and be chosen in its place
    with session(changes=PARTIAL, begin="paused") as live:
        opened(page, live.server.url)
        for number, (width, height) in enumerate(WIDTHS):
            page.set_viewport_size({"width": width, "height": height})
            page.keyboard.press("f")
            page.mouse.click(*head(page, 1, 2))
            live_wait(lambda n=number: len(live.simulation.interventions) > n, 60.0)
            lost = number % 2 == 0
            assert live.simulation.interventions[-1]["link"] == [2, 3]
            assert live.simulation.interventions[-1]["lost"] == lost
            until(page, "lost => (window.gne.state().lost.length === 1) === lost", arg=lost)
        page.mouse.click(*head(page, 3))  # the other way: a button of a robot that is chosen
        button = page.locator("#chosen").get_by_label("link with robot 3")
        button.click()
        until(page, "window.gne.state().lost.includes('robots 3-4')")
        live_wait(lambda: live.simulation.interventions[-1]["lost"], 60.0)
        text = as_done(live.simulation.source, live.simulation.interventions).toml()
        assert tomllib.loads(text)["interventions"][-1]["link"]["agents"] == [3, 4]
        quiet(recorded, *origins(live.server))


def test_what_cannot_be_done_is_told_once(page, recorded):
    with session(changes={"plant.engine": "ode"}) as live:
        opened(page, live.server.url)
        paused(page)
        for _ in range(2):
            drag(page, head(page, 1), (60.0, 0.0))
            page.mouse.click(*head(page, 0, 1))
        said = page.locator(".toast .said").all_inner_texts()
        assert said == [
            "robots: dashed lines are measurements, so that there is no link to lose.",
            "robots: only robots that MuJoCo moves can be pushed.",
        ]
        assert live.simulation.interventions == []
        quiet(recorded, *origins(live.server))


@pytest.mark.slow  # a browser at several widths
def test_labels_make_way_and_the_selector_agrees_with_the_view(page, recorded):
    trajectory = gne_mj.run("paper", {"simulation.duration": 1.0})
    server = serve(trajectory)
    try:
        opened(page, server.url)
        for width, height in WIDTHS:
            page.set_viewport_size({"width": width, "height": height})
            page.keyboard.press("f")
            settled(page)
            # the fleet is all in view, and fills it along one side
            pane, bodies = (
                page.locator("#pane").bounding_box(),
                page.evaluate("window.gne.bodies()"),
            )
            for begin, size, whole in (("x", "w", pane["width"]), ("y", "h", pane["height"])):
                low = min(each[begin] for each in bodies)
                high = max(each[begin] + each[size] for each in bodies)
                assert 0 <= low < high <= whole
                bodies[0][f"part {begin}"] = (high - low) / whole
            assert max(bodies[0]["part x"], bodies[0]["part y"]) > 0.6
            labels = page.evaluate("window.gne.labels()")
            assert sum(label["system"] == "robots" for label in labels) == 5
            for n, one in enumerate(labels):
                for other in labels[:n]:
                    assert apart(one, other), (width, one, other)
        quiet(recorded, *origins(server))
    finally:
        server.close()
