"""Frames of a live page: what they say of an instant is what the run itself says."""

import json

import numpy as np
import pytest
from watched_session import ODE, watched

from gne_mj.certificate import status_now
from gne_mj.viewer.pack import unpack

GRAPH = {"information": "partial", "graph": "ring"}
SAMPLED = {**ODE, "controller": {**GRAPH, "mode": "sampled"}}
LEAVING = {
    "simulation": {"duration": 1.0, "timestep": 1e-3},
    "systems": {
        "robots": {
            "game": {"type": "velocity-synchronization"},
            "agents": {"type": "flexible-robot", "count": 5},
            "membership": {"changes": [{"time": 0.01, "leaves": [1, 3]}]},
        }
    },
}


@pytest.mark.parametrize(
    ("scenario", "changes"),
    [
        ("velocity-sync", ODE),
        ("velocity-sync", SAMPLED),
        ("osnr", {}),
        pytest.param("paper", {}, marks=pytest.mark.slow),
        pytest.param("planar-sync", {}, marks=pytest.mark.slow),
        pytest.param("platoon", {}, marks=pytest.mark.slow),
        pytest.param("cars", {}, marks=pytest.mark.slow),
    ],
)
def test_a_frame_says_what_the_run_says(scenario, changes):
    with watched(scenario, changes) as (session, _page):
        for steps in (0, 30, 1):
            session._move(steps)
            meta, arrays = unpack(session._frame())
            assert meta["time"] == session.simulation.time
            assert list(meta["state"]) == list(session.simulation.runs)
            for shown_system in session._scene.shown_systems:
                check_system(session.simulation.runs[shown_system.system.name], meta, arrays)
            check_poses(session, arrays["poses"])


def check_system(run, meta, arrays):
    """Against the loop's state and monitor, and formulas of one number after the other."""
    system, name = run.system, run.system.name
    y = run.loop.present().state[:, system.agents.kind.OUTPUT]
    g = system.game.constraints(y)
    assert meta["state"][name] == json.loads(json.dumps(status_now(system, run.loop.monitor)))
    assert np.array_equal(arrays[f"{name}/action"], y)
    assert np.array_equal(arrays[f"{name}/quantity/constraint"], g)
    assert arrays[f"{name}/margin"] == np.float32(np.min(-g))
    for quantity in system.game.quantities:
        entries = system.game.entries(quantity)
        value = quantity.at(y[None], entries)[0]
        found = arrays[f"{name}/quantity/{quantity.name}"]
        assert np.array_equal(found, value.reshape(-1), equal_nan=True)
    if system.law.has_estimates:
        own = np.arange(system.game.agents), np.arange(system.game.actions)
        assert np.array_equal(arrays[f"{name}/estimate"][own], y.astype(np.float32))


def check_poses(session, poses):
    """Against one system's mirror after the other."""
    first = 0
    for shown_system, shift in zip(
        session._scene.shown_systems, session._scene._shifts, strict=True
    ):
        if shown_system.fleet is None:
            continue
        mirror, run = shown_system.fleet.mirror, session.simulation.runs[shown_system.system.name]
        expected = mirror.poses(shown_system.fleet.qpos(run.present())[0])
        expected[:, :2] += shift
        own = poses[first : first + len(expected)]
        assert np.array_equal(own, expected)
        first += len(expected)
    assert first == len(poses)


def test_a_speed_may_be_a_whole_number():
    with watched(changes=ODE) as (session, _page):
        session._pacer.speed = 4
        assert unpack(session._frame())[0]["speed"] == 4.0


def test_a_status_is_told_anew_as_soon_as_there_is_another():
    """It is kept while the monitor has seen nothing worse."""
    kept, told = 0, []
    with watched(changes={**ODE, "initial.action": [3.0] * 5}) as (session, page):
        (run,), standing = session.simulation.runs.values(), session._frames._standings["robots"]
        for turn in range(40):
            session._move(2)
            before = standing.text if told else None
            state = unpack(session._frame())[0]["state"]["robots"]
            assert state == status_now(run.system, run.loop.monitor)
            kept += standing.text is before
            told.append(state["margin"])
            if turn == 20:
                key = "systems.robots.game.reference_velocity"
                page.ask(do="set", key=key, value=5.5)
    assert kept >= 20
    assert np.all(np.diff(told) <= 0.0)
    assert told[20] == 9.0 > told[-1]


def test_who_is_away_is_hidden_where_another_one_is():
    with watched(LEAVING, {}) as (session, _page):
        session._move(30)
        _, arrays = unpack(session._frame())
        (system,) = session._scene.meta()["systems"]
    assert np.all(np.isfinite(arrays["poses"]))
    there = arrays["robots/there"]
    assert there.tolist() == [0.0, 1.0, 0.0, 1.0, 1.0]
    lengths = arrays["poses"][system["anchors"], 7]
    assert np.array_equal(lengths, there)
    assert np.all(arrays["poses"][arrays["poses"][:, 7] == 0.0][:, 3:7] == [1.0, 0.0, 0.0, 0.0])


def test_messages_are_counted_from_frame_to_frame():
    with watched(changes=SAMPLED) as (session, _page):
        counts = []
        for steps in (0, 7, 13, 1):
            session._move(steps)
            counts.append(unpack(session._frame())[1]["robots/messages"])
        clock = session.simulation.clock
    period = clock.steps(clock.control_period)
    assert counts[0].shape == (10, 2)
    instants = [-(-step // period) for step in (0, 0, 7, 20, 21)]
    assert [set(each[:, 0]) for each in counts] == [{n} for n in np.diff(instants)]
    assert not np.any([each[:, 1] for each in counts])
