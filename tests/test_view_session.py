"""A live run: the same steps as any other, at the pace and to the end that viewers ask for."""

import signal
import threading
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from watched_session import ODE, Page, to_the_end, watched

import gne_mj
from gne_mj.certificate import status_now
from gne_mj.scenario import load_scenario
from gne_mj.viewer import Session
from gne_mj.viewer.pack import unpack


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("velocity-sync", ODE),
        ("velocity-sync", {"simulation.duration": 0.5}),
        ("osnr", {"simulation.duration": 0.5}),
        pytest.param("disturbed", {"simulation.duration": 0.5}, marks=pytest.mark.slow),
        pytest.param("planar-sync", {"simulation.duration": 0.5}, marks=pytest.mark.slow),
    ],
)
def test_watching_changes_no_bit(scenario, changes):
    plain = gne_mj.run(scenario, changes)
    with watched(scenario, changes) as (session, page):
        session._move(3)
        page.ask(do="connect")
        page.ask(do="step")
        page.ask(do="play")
        session._publish()
        seen = to_the_end(session)
    assert seen.interventions == []
    for name in plain.tree.children:
        for key, values in plain[name].variables.items():
            if values.dtype.kind == "f":
                assert np.array_equal(values, seen[name][key], equal_nan=True), (name, key)
    assert seen.status == plain.status


def test_a_new_browser_is_told_everything():
    with watched("paper", {"simulation.duration": 0.5}) as (session, page):
        session._move(100)
        page.ask(do="connect")
        scene, history, frame = (unpack(message) for message in page.welcomed)
    assert scene[0]["kind"] == "scene"
    assert [system["drawn_as"] for system in scene[0]["systems"]] == ["fleet", "bars"]
    assert {control["key"] for control in scene[0]["controls"]} == {
        "systems.robots.barrier.rho",
        "systems.robots.game.reference_velocity",
        "systems.channels.barrier.rho",
        "systems.channels.controller.gain",
    }
    assert [push["system"] for push in scene[0]["pushes"]] == ["robots"]
    assert history[0] == {"kind": "history"}
    assert np.allclose(history[1]["time"], np.arange(4) * 0.05)
    assert history[1]["channels/action"].shape == (4, 10)
    state = session.simulation.runs["robots"].loop.present().state
    meta, arrays = frame
    assert meta["time"] == pytest.approx(0.2)
    assert np.array_equal(arrays["robots/action"], state[:, 1])
    anchors = scene[0]["systems"][0]["anchors"]
    assert np.array_equal(arrays["poses"][anchors, 0], state[:, 3])
    assert arrays["channels/estimate"].shape == (10, 10)
    assert [message["kind"] for message in page.told] == ["controls", "interventions"]


@pytest.mark.parametrize(("begin", "ask"), [("viewer", "seen"), ("paused", "play")])
def test_a_run_waits_for_its_viewer(begin, ask):
    session = Session(load_scenario("velocity-sync", ODE), "a title", speed=None, begin=begin)
    page = Page(session)
    try:
        session._turn()
        page.ask(do="connect")
        other = {"seen": "play", "play": "seen"}[ask]
        if other == "seen":
            page.ask(do=other)  # seen, but nobody has said that it may begin
        session._turn()
        assert session.simulation.time == 0.0
        assert not unpack(session._frame())[0]["playing"]
        page.ask(do=ask)
        assert len(to_the_end(session)["robots"]["time"]) == 21
    finally:
        session.server.close()


def test_a_restart_ends_the_run_and_its_trajectory_is_kept():
    with watched(changes={"simulation.duration": 1000.0}) as (session, page):
        session._move(100)
        page.ask(do="push", system="robots", agent=1)
        session._receive({"do": "restart"}, None)
        first = session.run(threading.Event())
        assert first.status == "interrupted"
        assert [done["agent"] for done in first.interventions] == [1]
        session.show(first)
        assert session.server.replay is None  # the next one goes on at once
        stop = threading.Event()
        page.ask(do="pause")
        session._begin(session._next, session._next.simulation_object())
        assert session.simulation.time == 0.0
        stop.set()
        assert session.run(stop).interventions == []


def test_after_the_end_it_says_that_nothing_moves():
    with watched(changes={"simulation.duration": 0.1}) as (session, page):
        to_the_end(session)
        page.ask(do="push", system="robots", agent=1)
        assert "its run has ended" in page.errors[-1]
        page.ask(do="set", key="systems.robots.barrier.rho", value=0.5)
        assert "holds from the next start on" in page.errors[-1]
        page.ask(do="restart")
        to_the_end(session)
        assert session.simulation.systems[0].rho == 0.5


def test_a_system_that_has_left_is_shown_no_further():
    changes = {"robots.controller.mode": "sampled", "simulation.control_period": 1.0,
               "simulation.duration": 10.0}  # fmt: skip
    with watched("paper", changes) as (session, page):
        session._move(2500)
        meta, frame = unpack(session._frame())
        assert meta["state"]["robots"]["status"] == "left_feasible_set"
        assert meta["state"]["robots"]["exit_agents"]
        assert np.all(np.isnan(frame["robots/action"]))
        assert not np.any(np.isnan(frame["channels/action"]))
        page.ask(do="connect")
        _, history = unpack(page.welcomed[1])
        gone = history["time"] > session.simulation.runs["robots"].loop.time
        assert np.array_equal(np.isnan(history["robots/action"][:, 0]), gone)
        page.ask(do="push", system="robots", agent=1)
        assert "must not have left" in page.errors[-1]


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=4,
)
WORDS = ["play", "pause", "step", "speed", "set", "push", "restart", "connect", "other"]


@settings(max_examples=60)
@given(
    st.lists(
        st.fixed_dictionaries(
            {"do": st.sampled_from(WORDS) | JSON},
            optional={
                "key": st.just("systems.robots.barrier.rho") | JSON,
                "value": st.floats(0.01, 10.0) | JSON,
                "system": st.just("robots") | JSON,
                "agent": JSON,
                "axis": JSON,
            },
        ),
        max_size=6,
    )
)
def test_no_message_ends_a_session(shared_session, messages):
    session, _page = shared_session
    for message in messages:
        session._receive(message, None)
    session._look(0.0)
    session._move(1)
    meta, _ = unpack(session._frame())
    assert meta["state"]["robots"]["status"] in ("running", "completed", "left_feasible_set")


@pytest.fixture(scope="module")
def shared_session():
    with watched(changes={**ODE, "simulation.duration": 1000.0}) as found:
        yield found


def test_steps_go_from_one_control_instant_to_the_next():
    changes = {**ODE, "controller.mode": "sampled", "simulation.control_period": 0.04}
    with watched(changes=changes) as (session, page):
        page.ask(do="step")
        assert session.simulation.time == pytest.approx(0.04)
        assert not session._playing
    with watched() as (session, page):
        page.ask(do="step")
        assert session.simulation.time == pytest.approx(0.05)


def test_the_wall_clock_sets_the_pace(monkeypatch):
    now = [100.0]
    monkeypatch.setattr("time.perf_counter", lambda: now[0])
    with watched(changes={**ODE, "simulation.duration": 100.0}, speed=2.0) as (session, page):
        for _ in range(50):
            now[0] += 0.02
            session._turn()
        assert session.simulation.time == pytest.approx(2.0, abs=0.05)
        assert unpack(page.last_frame)[0]["pace"] == pytest.approx(2.0, rel=0.1)
        page.ask(do="pause")
        now[0] += 10.0
        paused = session.simulation.time
        session._turn()
        assert session.simulation.time == paused
        page.ask(do="play")
        now[0] += 0.02
        session._turn()
        assert session.simulation.time == pytest.approx(paused + 0.04, abs=0.01)


def test_an_exit_is_told_with_its_words():
    changes = {**ODE, "controller.mode": "sampled", "simulation.control_period": 1.0,
               "simulation.duration": 3.0}  # fmt: skip
    with watched(changes=changes) as (session, page):
        trajectory = to_the_end(session)
    state = unpack(page.last_frame)[0]["state"]["robots"]
    assert trajectory.status == state["status"] == "left_feasible_set"
    assert "was violated" in state["message"]
    (run,) = session.simulation.runs.values()
    assert status_now(run.system, run.loop.monitor) == state  # live and at the end the same words
    assert state["exit_time"] == trajectory.reports["robots"]["exit"]["time"]


def test_a_signal_near_the_end_of_a_wait_does_not_prolong_it():
    """queue.SimpleQueue waits for ever then, on Python 3.11 and 3.12."""
    handled = []

    def busy(number, frame):
        handled.append(number)
        time.sleep(0.2)  # beyond the wait's end

    before = signal.signal(signal.SIGALRM, busy)
    with watched() as (session, _):
        late = threading.Timer(5.0, session._receive, ({"do": "pause"}, None))
        late.start()
        try:
            signal.setitimer(signal.ITIMER_REAL, 0.05)
            session._look(0.1)
            assert handled
            assert session._playing  # what came late was not waited for
        finally:
            signal.signal(signal.SIGALRM, before)
            late.cancel()


def test_a_meshcat_visualizer_draws_into_the_page():
    import meshcat.geometry

    with watched() as (session, _page):
        session.visualizer["own"]["box"].set_object(meshcat.geometry.Box([1.0, 1.0, 1.0]))
        settled = threading.Event()
        session.server._loop.call_soon_threadsafe(settled.set)
        settled.wait(5)
        tree = session.server._bridge.tree
        assert b"BoxGeometry" in tree["meshcat"]["own"]["box"].object
