"""Agents that leave and join, against SciPy on the games of those present, and what runs report."""

import json
from dataclasses import replace

import numpy as np
import pytest
from commands import gne_here
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

import gne_mj
from gne_mj import game_check
from gne_mj.errors import InvalidInput
from gne_mj.game_among import game_among
from gne_mj.games import cournot_game, osnr_game, ten_channels, velocity_consensus_game
from gne_mj.membership import Change, Membership
from gne_mj.scenario import load_scenario
from gne_mj.simulation import Simulation
from gne_mj.system import Clock
from gne_mj.system.membership import present_of
from gne_mj.theory.constants import Slopes
from gne_mj.viewer import replay_pack
from gne_mj.viewer.pack import unpack

RHO, V0, DELTA = 0.1, 3.0, 3.0
START = np.array([1.0, 0.0, -1.0, 0.5, 2.0])


def scenario(changes, **parts):
    tables = {
        "simulation": {"duration": 1.0, "timestep": 1e-3},
        "recording": {"period": 0.1},
        "systems": {
            "robots": {
                "game": {"type": "velocity-synchronization"},
                "agents": {"type": "integrator", "count": 5},
                "membership": {"changes": changes},
            }
        },
    }
    return load_scenario(tables, parts)


def rate_among(there):
    """y' = u of those present, from the formulas: gaps to who is away are to v_0, unbounded."""

    def rate(_, y):
        full = np.full(6, V0)
        full[1:][there] = y
        u = np.zeros(6)
        for i in range(1, 6):
            if not there[i - 1]:
                continue
            gap = full[i] - full[i - 1]
            u[i] -= 2 * gap
            if i == 1 or there[i - 2]:
                force = 2 * RHO * gap / (DELTA**2 - gap**2)
                u[i] -= force
                u[i - 1] += force
        return u[1:][there]

    return rate


def test_every_interval_is_the_game_of_those_present():
    changes = [
        {"time": 0.25, "leaves": [3]},
        {"time": 0.4, "leaves": [5]},
        {"time": 0.7, "joins": [3], "action": 0.5},
    ]
    run = gne_mj.run(scenario(changes))
    y, there, time = START.copy(), np.ones(5, dtype=bool), 0.0
    data = run.data
    for until, after in ((0.25, [0, 1, 3, 4]), (0.4, [0, 1, 3]), (0.7, [0, 1, 2, 3]), (1.0, None)):
        found = solve_ivp(
            rate_among(there), (time, until), y[there], "DOP853", rtol=1e-12, atol=1e-13,
            dense_output=True,
        )  # fmt: skip
        for at in data["time"].values[
            (data["time"].values >= time) & (data["time"].values < until)
        ]:
            row = data["action"].sel(time=at).values
            assert_allclose(row[there], found.sol(at), rtol=1e-8, atol=1e-9)
            assert_array_equal(np.isnan(row), ~there)
        y[there], time = found.y[:, -1], until
        if after is not None:
            if 2 in after and not there[2]:
                y[2] = 0.5
            there = np.isin(np.arange(5), after)
    assert_allclose(data["action"].values[-1][there], y[there], rtol=1e-8)
    report = run.reports["robots"]
    assert report["lyapunov"]["claimed"]
    assert report["lyapunov"]["monotone"]
    assert [each["there"] for each in report["membership"]["changes"]] == [
        [1, 2, 4, 5], [1, 2, 4], [1, 2, 3, 4],
    ]  # fmt: skip
    assert_array_equal(np.isnan(data["constraint"].values[-1]), [False] * 4 + [True])
    assert_allclose(data["equilibrium"].values[-1], [3, 3, 3, 3, np.nan])


def test_settling_is_of_the_last_change():
    """To the penalised and to the variational equilibrium alike."""
    run = gne_mj.run(scenario([{"time": 1.0, "leaves": [5]}], **{"simulation.duration": 9.0}))
    data, report = run.data.sel(time=slice(1.0001, None)), run.reports["robots"]
    apart = np.max(np.abs(data["action"] - data["equilibrium"]).values[:, :4], axis=1)
    settled = data["time"].values[np.flatnonzero(apart > 0.02 * apart[0])[-1] + 1]
    assert report["settling_time"] == pytest.approx(settled, abs=0.11)
    to_variational = report["equilibrium"]["settling_time_to_variational"]
    assert to_variational == pytest.approx(settled, abs=0.11)


def test_who_is_not_strictly_inside_is_not_admitted():
    changes = [
        {"time": 0.2, "leaves": [3]},
        {"time": 0.5, "joins": [3], "action": -4.0, "retry": 0.1},
    ]
    run = gne_mj.run(scenario(changes))
    report = run.reports["robots"]
    refused = report["membership"]["changes"][-1]
    assert not refused["done"]
    assert refused["tried"] == 5
    assert refused["constraint"] == "gap of agent 4"
    assert refused["value"] > 0
    assert "robot 3 was not admitted at 0.9 s: constraint 'gap of agent 4'" in report["message"]
    assert "1 not admitted" in str(run)
    assert run.holds
    json.dumps(run.report(), allow_nan=False)


@pytest.mark.parametrize(
    ("changes", "more", "key", "words"),
    [
        ([{"time": 0.1005, "leaves": [3]}], {}, "membership.changes.0.time", "multiple"),
        ([{"time": 0.1, "leaves": [6]}], {}, "membership.changes.0.leaves", "from 1 to 5"),
        ([{"time": 0.1, "joins": [3]}, {"time": 0.2, "joins": [3]}], {}, "changes.1.joins", "away"),
        ([{"time": 0.1, "leaves": [1, 2, 3, 4]}], {}, "membership", "constraint of theirs"),
        (
            [{"time": 0.1, "leaves": [3]}],
            {"controller": {"information": "partial", "graph": "line"}},
            "membership.changes.0",
            "must be connected",
        ),
        (
            [{"time": 0.1, "leaves": [3]}],
            {"simulation.integrator": "tsit5"},
            "integrator",
            "where agents leave or join",
        ),
    ],
)
def test_what_cannot_go_on_is_refused(changes, more, key, words):
    with pytest.raises(InvalidInput, match=words) as raised:
        scenario(changes, **more).simulation_object()
    assert key in raised.value.key


def energy(i, y, p):
    return (y[i] - p.wish) ** 2 + 0.1 * y[i] * y.sum()


def budget(y, p):
    yield "energy", (y**2).sum() <= p.most
    for i in range(3):
        yield f"gap {i + 1}", abs(y[i] - y[i + 1]) <= 1.0


GAMES = {
    "cournot": (cournot_game(5), 50.0, 0.0, ()),
    "channels": (osnr_game(**ten_channels()), 0.1, 0.0, ("total power",)),
    "planar": (
        velocity_consensus_game(
            [(0, 1), (1, 2), (2, 3), (3, 0)], [1.0, 0, 0, 1.0], [1.0, 2.0], 3.0, 2.0
        ),
        np.tile([0.9, 1.8], 4), np.tile([1.0, 2.0], 4), (),
    ),
    "expressions": (gne_mj.game(4, energy, budget, wish=1.0, most=9.0), 0.3, 0.2, ("energy",)),
}  # fmt: skip


@pytest.mark.parametrize("name", GAMES)
def test_a_game_among_agents_is_the_game_with_the_others_held(name):
    game, start, away, keeps = GAMES[name]
    away = np.broadcast_to(away, (game.actions,)).astype(float)
    there = np.arange(game.agents) != 1
    found = game_among(game, there, away, keeps)
    y = np.broadcast_to(start, (game.actions,)) + np.linspace(0.0, 0.01, game.actions)
    whole = np.where(there[game.agent_of_action], y, away)
    among, block = found.game, np.ix_(found.actions, found.actions)
    mine = y[found.actions]
    assert_array_equal(among.costs(mine), game.costs(whole)[found.agents])
    assert_array_equal(among.pseudo_gradient(mine), game.pseudo_gradient(whole)[found.actions])
    jacobian = among.pseudo_gradient_jacobian(mine)
    assert_array_equal(jacobian, game.pseudo_gradient_jacobian(whole)[block])
    assert_array_equal(among.constraints(mine), game.constraints(whole)[found.constraints])
    names = [game.constraint_names[k] for k in found.constraints]
    assert list(among.constraint_names) == names
    assert set(keeps) <= set(names)
    gone = set(game.constraint_names) - set(names)
    assert gone == {
        n for n, who in zip(game.constraint_names, game.in_constraint, strict=True)
        if 1 in who and n not in keeps
    }  # fmt: skip
    report = game_check.examine(among, mine, points=4, most=8)
    assert report.holds, report.summary()
    if game.affine:  # what is known of the whole game holds of the block
        every = Slopes(game, game.box, whole, feasible=True)
        fewer = Slopes(among, among.box, mine, feasible=True)
        assert fewer.mu.value >= every.mu.value - 1e-12
        assert fewer.theta_1.value <= every.theta_1.value + 1e-12


def system_of(law, mode, engine="ode"):
    """Five flexible robots without their membership, and the clock."""
    more = {
        "full": {},
        "partial": {"graph": "complete", "coupling": 5.0, "time_constant": 0.1},
        "distributed": {"graph": "complete", "epsilon": 0.01},
    }[law]
    held = mode != "continuous"
    tables = {
        "systems.robots.agents": {"type": "flexible-robot", "count": 5},
        "systems.robots.controller": {"information": law, "mode": mode, **more},
        "simulation.integrator": "euler" if held else "rk4",
        "plant.engine": engine,
    }
    loaded = scenario([{"time": 0.3, "leaves": [3]}], **tables)
    period = 0.01 if held else 1e-3
    return loaded.system_objects()[0], Clock(0.6, 1e-3, period, 0.1)


@pytest.mark.parametrize("mode", ["continuous", "sampled", "implicit"])
@pytest.mark.parametrize(
    ("law", "engine"),
    [("full", "ode"), ("partial", "ode"), ("distributed", "ode"), ("partial", "mujoco")],
)
def test_an_interval_is_a_run_of_its_own_to_the_bit(law, engine, mode):
    system, clock = system_of(law, mode, engine)
    simulation = Simulation([system], clock)
    simulation.run()
    (run,) = simulation.runs.values()
    _, values = run.recorded(100)
    rows = [part for part in run._recorded if len(part.time)]
    at = np.concatenate([part.time for part in rows])
    state = np.concatenate([part.samples.state for part in rows])
    memory = np.concatenate([part.samples.memory for part in rows])
    there = np.array([True, True, False, True, True])
    (first,) = np.flatnonzero(np.abs(at - 0.3) < 1e-9)
    alone = present_of(system, there, state[first], memory[first])
    own = Simulation([alone.system], replace(clock, duration=0.3))
    own.run()
    present = own.runs["robots"].loop.present()
    assert_array_equal(state[-1][there], present.state)
    assert_array_equal(memory[-1][alone.memory], present.memory)
    assert_array_equal(values["there"][-1], there)
    whole = run.loop.monitor
    apart = own.runs["robots"].loop.monitor
    assert whole.storage == apart.storage
    assert np.all(np.isnan(state[-1][2]))


def test_positions_beside_a_reference_that_moves_go_on_in_mujoco_where_they_are():
    leaving = {"changes": [{"time": 0.2, "leaves": [3]}], "away": 0.0}
    parts = {"agents.contacts": False, "simulation.duration": 0.4}
    runs = [
        gne_mj.run("formation", parts, engine=each, membership=leaving)
        for each in ("ode", "mujoco")
    ]
    twin, robots = (run.data["action"].values for run in runs)
    assert np.any(runs[0].system.agents.parameters[:, 7] != 0.0)
    assert_allclose(robots, twin, rtol=0, atol=1e-9)
    assert all(run.holds for run in runs)


def test_nobody_who_is_away_is_pushed_and_numbers_stay():
    leaving = {"changes": [{"time": 0.1, "leaves": [3]}]}
    robots = {"simulation.duration": 0.3, "simulation.timestep": 2e-3}
    simulation = gne_mj.setup(
        "velocity-sync", robots, engine="mujoco", membership=leaving
    ).simulation_object()
    simulation.push("robots", 3, 5.0, 0.2)  # which goes on over the change
    simulation.advance(60)
    with pytest.raises(InvalidInput, match="the agent must be there"):
        simulation.push("robots", 2, 1.0, 0.1)
    with pytest.raises(InvalidInput, match="numbers stay as they are"):
        simulation.change({"barrier.rho": 0.02})
    pushed = simulation.run()["robots"]["action"].values[-1]
    alone = gne_mj.run("velocity-sync", robots, engine="mujoco", membership=leaving)
    assert pushed[3] > alone.data["action"].values[-1, 3] + 0.2
    planned = {**robots, "interventions": [{"time": 0.2, "changes": {"barrier.rho": 0.02}}]}
    with pytest.raises(InvalidInput, match="numbers stay as they are"):
        gne_mj.setup("velocity-sync", planned, membership=leaving).simulation_object()


def test_what_was_measured_is_of_the_whole_run():
    """Against rows of every step."""
    changes = [
        {"time": 0.05, "leaves": [3, 5]},
        {"time": 0.1, "joins": [5], "action": 2.5},
        {"time": 0.15, "leaves": [1]},
    ]
    parts = {"recording.period": 1e-3, "simulation.duration": 0.2, "simulation.timestep": 1e-3}
    run = gne_mj.run(scenario(changes, **parts))
    report, data = run.reports["robots"], run.data
    worst = np.nanmax(data["constraint"].values, axis=0)
    # at a change the instant before it is looked at too, with those who leave
    assert np.all(-np.array(report["worst_constraint"]["each"]) >= worst)
    assert_allclose(-np.array(report["worst_constraint"]["each"]), worst, atol=0.1)
    assert np.all(
        np.array(report["actuators"]["peaks"]) >= np.nanmax(np.abs(data["input"]), axis=0)
    )
    assert report["steps"] == 200
    once = gne_mj.run(scenario(changes, **{**parts, "recording.period": 0.07 * 2 / 7}))
    other = once.reports["robots"]
    for key in ("worst_constraint", "actuators", "steps", "membership"):
        assert report[key] == other[key], key


def test_who_joins_takes_its_neighbours_word():
    """Of estimates; all take its own action to be what it says."""
    system, clock = system_of("partial", "sampled")
    away = Membership((Change(0.3, (), (2,), np.array([0.25])),), np.full(5, V0))
    law = replace(system.law, graph=gne_mj.Graph(5, ((0, 1), (1, 2), (2, 3), (3, 4), (4, 0))))
    start = replace(system, membership=away, law=law, memory=np.zeros(0))
    simulation = Simulation([start], replace(clock, duration=0.3))
    simulation.run()
    loop = simulation.runs["robots"].loop
    assert np.isnan(loop.present().state[2, 1])
    before = loop.present().memory.reshape(5, 5)
    loop.advance(1, 1)
    after = loop.present().memory.reshape(5, 5)
    others = [0, 1, 3, 4]
    assert_allclose(after[2, others], (before[1, others] + before[3, others]) / 2, rtol=0.2)
    assert_array_equal(after[:, 2][others], np.full(4, 0.25))


def test_a_page_hides_who_is_away():
    changes = [{"time": 0.2, "leaves": [3]}, {"time": 0.6, "joins": [3]}]
    parts = {"systems.robots.agents": {"type": "flexible-robot", "count": 5}}
    run = gne_mj.run(scenario(changes, **parts))
    meta, arrays = unpack(replay_pack(run))
    there = arrays["robots/there"].reshape(-1, 5)
    assert_array_equal(there[:, 2], run.data["there"].values[:, 2])
    assert np.all(there[:, [0, 1, 3, 4]] == 1.0)
    assert np.all(np.isfinite(arrays["pose_values"]))
    assert np.all(np.isfinite(arrays["robots/margin"]))
    assert len(meta["systems"][0]["anchors"]) == 5


def test_commands_tell_every_set_of_agents(tmp_path):
    file = tmp_path / "leaving.toml"
    file.write_text(
        """
        [systems.robots.game]
        type = "velocity-synchronization"
        [systems.robots.agents]
        type = "integrator"
        count = 5
        [systems.robots.membership]
        changes = [{time = 0.5, leaves = [3]}, {time = 1.5, joins = [3]}]
        """
    )
    found = json.loads(gne_here("certify", file, "--json").stdout)["robots"]
    assert [part["agents"] for part in found["membership"]] == [
        [1, 2, 3, 4, 5], [1, 2, 4, 5], [1, 2, 3, 4, 5],
    ]  # fmt: skip
    assert found["status"] == "certified"
    assert found["lyapunov_claimed"]
    text = gne_here("certify", file).stdout
    assert "from 0.5 s           agents 1, 2, 4, 5: certified" in text
    refused = gne_here("batch", file, "--out", tmp_path / "out", "--runs", "2")
    assert refused.returncode == 2
    assert "runs of a batch know no agents that leave or join" in refused.stderr
