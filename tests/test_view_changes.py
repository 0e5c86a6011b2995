"""What viewers may do to a live run: its sliders and pushes."""

import threading
import tomllib
from pathlib import Path

import numpy as np
import pytest
from watched_session import ODE, to_the_end, watched

import gne_mj
from gne_mj.scenario import load_scenario
from gne_mj.viewer.controls import controls_of
from gne_mj.viewer.pack import unpack

EXAMPLES = Path(__file__).parent.parent / "examples"


def test_numbers_change_while_it_runs_and_hold_after_a_restart():
    with watched() as (session, page):
        session._move(100)
        page.ask(do="set", key="systems.robots.barrier.rho", value=0.5)
        page.ask(do="set", key="systems.robots.game.reference_velocity", value=2.5)
        assert session.simulation.systems[0].rho == 0.5
        assert session.simulation.time == pytest.approx(0.2)
        values = [m["values"] for m in page.told if m["kind"] == "controls"][-1]
        assert values["systems.robots.game.reference_velocity"] == 2.5
        first = to_the_end(session)
        assert [done["what"] for done in first.interventions] == [
            "systems.robots.barrier.rho = 0.5",
            "systems.robots.game.reference_velocity = 2.5",
        ]
        assert unpack(page.last_frame)[0]["ended"]
        page.ask(do="restart")
        second = to_the_end(session)
    assert second.interventions == []
    expected = gne_mj.run(
        "velocity-sync", {**ODE, "barrier.rho": 0.5, "game.reference_velocity": 2.5}
    )
    assert np.array_equal(second["robots"]["action"], expected["robots"]["action"])


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("velocity-sync", {"controller": {"information": "partial", "graph": "ring"}}),
        ("planar-sync", {}),
    ],
)
def test_what_viewers_did_is_done_again_to_the_last_bit(scenario, changes):
    with watched(scenario, {**changes, "simulation.duration": 0.6}) as (session, page):
        session._move(30)
        page.ask(do="set", key="systems.robots.barrier.rho", value=0.3)
        session._move(7)
        entry = "[1]" if scenario == "planar-sync" else ""
        page.ask(do="set", key=f"systems.robots.game.reference_velocity{entry}", value=0.9)
        page.ask(do="push", system="robots", agent=2, axis=1 if entry else 0, force=3.0)
        for coupling in (4.0, 5.0):
            page.ask(do="set", key="systems.robots.controller.coupling", value=coupling)
        session._move(60)
        page.ask(do="scenario")
        text = page.told[-1]["text"]
        seen = to_the_end(session)
    assert len(seen.interventions) == (3 if entry else 4)
    again = gne_mj.run(tomllib.loads(text))
    assert again.interventions == [
        {key: value for key, value in done.items() if key not in ("key", "value")} | words
        for done, words in zip(
            seen.interventions, [{"what": d["what"]} for d in again.interventions], strict=True
        )
    ]
    for key, values in seen["robots"].variables.items():
        if values.dtype.kind == "f":
            assert np.array_equal(values, again["robots"][key], equal_nan=True), key


def test_sliders_follow_what_the_scenario_does():
    rho = "systems.robots.barrier.rho"
    planned = [{"time": 0.1, "changes": {"barrier.rho": 0.4}}]
    with watched(changes={**ODE, "interventions": planned}) as (session, page):
        page.ask(do="set", key="systems.robots.game.reference_velocity", value=2.5)
        session._move(60)
        assert [m["values"][rho] for m in page.told if m["kind"] == "controls"] == [0.1, 0.4]
        assert len(session.simulation.interventions) == 2
        system = session.simulation.systems[0]
        assert (system.rho, system.game.parameters[0]) == (0.4, 2.5)
        page.ask(do="set", key="systems.robots.game.reference_velocity", value=2.6)
        assert session.simulation.systems[0].rho == 0.4
        session._receive({"do": "restart"}, None)
        session._look(0.0)
        page.told.clear()
        page.ask(do="pause")
        stop = threading.Event()
        threading.Timer(0.2, stop.set).start()
        session.run(stop)  # from the start, where that has yet to be done
        values = next(m["values"] for m in page.told if m["kind"] == "controls")
        assert (values[rho], session._sliders.values["systems.robots.game.reference_velocity"]) == (
            0.1,
            2.6,
        )


def test_a_slider_resets_no_count_of_messages():
    """Counts before and after, and their sum beside the report's."""
    event = {"information": "partial", "graph": "ring", "mode": "sampled",
             "communication": {"type": "event", "threshold": 0.05}}  # fmt: skip
    with watched(changes={**ODE, "controller": event}) as (session, page):
        run = session.simulation.runs["robots"]
        session._move(100)
        before, told = run.present()["sent_message"], run.loop.monitor.messages
        page.ask(do="set", key="systems.robots.barrier.rho", value=0.3)
        page.ask(do="set", key="systems.robots.controller.coupling", value=2.0)
        page.ask(do="set", key="systems.robots.game.reference_velocity", value=2.5)
        assert page.errors == []
        assert np.array_equal(run.present()["sent_message"], before)
        trajectory = to_the_end(session)
    sent = trajectory["robots"]["sent_message"].to_numpy()
    assert 0 < told < sent[-1].sum() == trajectory.reports["robots"]["messages"]["sent"]
    assert np.all(np.diff(sent, axis=0) >= 0)


def test_a_reference_with_two_entries_has_two_sliders():
    scenario = load_scenario("planar-sync")
    keys = [control.key for control in controls_of(scenario)]
    assert keys[1:] == [f"systems.robots.game.reference_velocity[{i}]" for i in range(2)]
    with watched("planar-sync", {"simulation.duration": 0.1}) as (session, page):
        before = session.simulation.systems[0].game.parameters.copy()
        page.ask(do="set", key=keys[2], value=0.8)
        after = session.simulation.systems[0].game.parameters
        assert page.errors == []
        changed = np.flatnonzero(before != after)
        assert after[changed].tolist() == [0.8]


def test_of_a_dragged_slider_only_the_last_value_counts():
    with watched() as (session, _page):
        for value in (0.2, 0.3, 0.4):
            message = {"do": "set", "key": "systems.robots.barrier.rho", "value": value}
            session._receive(message, None)
        session._look(0.0)
        assert [d["what"] for d in session.simulation.interventions] == [
            "systems.robots.barrier.rho = 0.4"
        ]


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        (
            "systems.robots.game.reference_velocity",
            30.0,
            "robots, reference v₀: at the present outputs constraint",
        ),
        ("systems.robots.barrier.rho", -1.0, "robots, penalty ρ: got -1.0"),
        ("systems.robots.barrier.rho", "much", "robots, penalty ρ: got 'much'"),
        ("systems.robots.barrier.rho", float("nan"), "it must be a finite number"),
        ("simulation.timestep", 1.0, "key: got 'simulation.timestep'"),
        (None, 1.0, "this scenario has no such slider"),
    ],
)
def test_a_value_that_cannot_be_changes_nothing(key, value, words):
    with watched() as (session, page):
        session._move(50)
        system = session.simulation.systems[0]
        page.ask(do="set", key=key, value=value)
        assert session.simulation.systems[0] is system
        assert words in page.errors[-1]
        assert page.errors[-1].count(". ") == 0
        assert session.simulation.interventions == []
        page.ask(do="restart")
        assert session.simulation.systems[0].rho == 0.1


def test_what_counts_is_where_the_outputs_are_now():
    # at the start v_0 = 5 would be outside, y_1 being 1, and v_0 = -1 inside
    with watched(changes={**ODE, "simulation.duration": 100.0}) as (session, page):
        session._move(15_000)
        page.ask(do="set", key="systems.robots.game.reference_velocity", value=-1.0)
        assert "at the present outputs" in page.errors[-1]
        assert "g = 7" in page.errors[-1]  # (3 + 1)^2 - 9
        page.ask(do="set", key="systems.robots.game.reference_velocity", value=5.0)
        assert len(page.errors) == 1
        assert session.simulation.systems[0].game.parameters[0] == 5.0
        page.ask(do="restart")
        assert page.errors[-1].endswith("set back robots, reference v₀ to 3 (now 5)")
        session._move(10)
        assert session.simulation.time > 30.0


@pytest.mark.parametrize(
    ("scenario", "system", "moves", "refused"),
    [
        ("desired-velocity", "robots", [(11.0, 10.0)], []),  # its steps are divided
        # its estimates cannot follow, however short the steps; with 1/100 of epsilon they can
        ("osnr", "channels", [(1.0, 10.0), (2.0, 0.001)], [0.001]),
        ("osnr", "channels", [(1.0, 10.0), (2.0, 0.1)], []),
    ],
)
def test_no_slider_drives_a_run_out_of_its_set(scenario, system, moves, refused):
    key = f"systems.{system}.barrier.rho"
    with watched(scenario, {"simulation.duration": 14.0}) as (session, page):
        for time, rho in moves:
            session._move(session.simulation.clock.steps(time - session.simulation.time))
            page.ask(do="set", key=key, value=rho)
        assert [text.split(",")[0] for text in page.errors] == [f"{system}" for rho in refused]
        for text in page.errors:
            assert "with it the run would end in 0." in text
            assert f"penalty ρ: got {refused[0]}" in text
            assert "s as 'left_feasible_set'; it stays at " in text
        taken = [rho for _, rho in moves if rho not in refused]
        assert [done["value"] for done in session.simulation.interventions] == taken
        assert session.simulation.systems[0].rho == session._sliders.values[key] == taken[-1]
        assert to_the_end(session).status in ("completed", "converged")


def test_a_trial_ends_with_the_run_it_is_for():
    with watched("osnr", {"simulation.duration": 2.05}) as (session, page):
        for time, rho in ((1.0, 10.0), (2.0, 0.001)):  # which would leave at 2.079 s
            session._move(session.simulation.clock.steps(time - session.simulation.time))
            page.ask(do="set", key="systems.channels.barrier.rho", value=rho)
        assert page.errors == []
        assert to_the_end(session).status == "completed"


def test_a_users_own_game_is_not_read_again_for_a_slider(tmp_path):
    for name in ("scenario.toml", "charging_plain.py", "charging_fast.py"):
        text = (EXAMPLES / "game" / name).read_text(encoding="utf-8")
        (tmp_path / name).write_text(text, encoding="utf-8")
    with watched(tmp_path / "scenario.toml", {"simulation.duration": 1.0}) as (session, page):
        session._move(10)
        game = session.simulation.systems[0].game
        for name in ("charging_plain.py", "charging_fast.py"):
            (tmp_path / name).write_text("raise RuntimeError", encoding="utf-8")
        page.ask(do="set", key=next(iter(session._sliders.controls)), value=0.05)
        assert page.errors == []
        assert session.simulation.systems[0].game is game
        assert session.simulation.systems[0].rho == 0.05
        trajectory = session.run(threading.Event())
        session.show(trajectory)  # neither for the replay
        assert page.errors == []
        assert session.server.replay


@pytest.mark.parametrize("message", [{"do": "speed", "value": 10**400},
                                     {"do": "set", "key": "systems.robots.barrier.rho",
                                      "value": 10**400}])  # fmt: skip
def test_numbers_beyond_all_bounds_are_refused(message):
    with watched() as (_session, page):
        page.ask(**message)
        assert "it must be a finite number" in page.errors[-1]
        assert len(page.errors[-1]) < 200


def test_a_push_acts_on_the_robot_it_names():
    with watched(changes={"simulation.duration": 1.0}) as (session, page):
        session._move(10)
        page.ask(do="push", system="robots", agent=3, axis=0, force=-4.0)
        session._move(1)
        data = session.simulation.runs["robots"].loop.plant.data
        assert np.count_nonzero(data.qfrc_applied) == 1
        assert data.qfrc_applied.min() == -4.0
        session._move(120)
        assert not np.any(data.qfrc_applied)
        trajectory = to_the_end(session)
    assert not trajectory.reports["robots"]["lyapunov"]["claimed"]
    assert "pushed by -4" in trajectory.interventions[0]["what"]


@pytest.mark.parametrize(
    "message",
    [
        {"system": "robots", "agent": 6},
        {"system": "robots", "agent": 0},
        {"system": "robots", "agent": "1"},
        {"system": "robots", "agent": 1, "axis": 1},
        {"system": "robots", "agent": 1, "force": "hard"},
        {"system": "nobody", "agent": 1},
        {},
    ],
)
def test_a_push_of_nobody_is_refused(message):
    with watched(changes={"simulation.duration": 1.0}) as (session, page):
        page.ask(do="push", **message)
        assert page.errors
        assert session.simulation.interventions == []


def test_robots_of_the_ode_have_no_push_buttons():
    with watched() as (_session, page):
        page.ask(do="connect")
        assert unpack(page.welcomed[0])[0]["pushes"] == []
        page.ask(do="push", system="robots", agent=1)
        assert "only robots in MuJoCo" in page.errors[-1]
