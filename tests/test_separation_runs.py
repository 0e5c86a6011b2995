"""Runs of agents that keep apart: against plain Python's, through each other, as shipped."""

import json
from pathlib import Path

import numpy as np
import pytest
from builders import relative_error, run_loop
from separation_fleets import (
    MODES,
    REACH,
    TURN,
    R,
    cloud,
    in_the_air,
    least_distance,
    system_of,
)
from separation_reference import Swap

import gne_mj as gm
from gne_mj.loops import monitor as watch
from gne_mj.plants.position_robot import least_damping
from gne_mj.theory import certify


def four(rng):
    """Four robots in each other's way, and their oracle."""
    q = cloud(rng, 4)
    y, place = q + rng.normal(0, 0.02, (4, 2)), -q
    table = {
        "game__desired_place": place.tolist(),
        "agents__count": 4,
        "agents__main_mass": [1.0, 2.0, 0.7, 1.0],
        "initial": {"action": y.tolist(), "position": q.tolist()},
    }
    return table, Swap(place, 4.0, 0.05, R, REACH, TURN)


@pytest.mark.parametrize("engine", ["ode", "mujoco"])
def test_mode_implicit_is_the_one_of_plain_python(engine):
    """Outputs from the equation solved by SciPy on an energy's differences, half-planes by
    bisection."""
    rng, h = np.random.default_rng(1), 0.01
    table, oracle = four(rng)
    system = system_of(plant__engine=engine, **table)
    p = system.agents.parameters
    M, m, k, atan, gamma, tau, d, _ = p.T
    assert np.allclose(d, 1.2 * least_damping(p))
    states, *_ = run_loop(system, h, 60)
    s, y, w, q = states[0].T
    near = 0
    for row in states[1:]:
        v = (y - q) / tau
        force = k * s + atan * np.arctan(s) + gamma * (v - w)
        free_v = v + h * (-d * v - force) / M
        free = q + (h + tau) * free_v
        pairs = oracle.pairs(q, y)
        near = max(near, len(pairs))
        y = oracle.implicit(free, h / M * (tau + h), y, pairs)
        v = (y - q) / (tau + h)
        w = w + h * force / m
        s, q = s + h * (v - w), q + h * v
        np.testing.assert_allclose(row.T, [s, y, w, q], atol=2e-6)
    assert near >= 3


def test_continuous_time_is_the_one_of_plain_python():
    """Half-planes that are renewed at every step, and held over its stages."""
    rng, h = np.random.default_rng(1), 1e-3
    table, oracle = four(rng)
    system = system_of(
        controller__mode="continuous", plant__integrator="rk4", barrier__rho=0.2, **table
    )
    oracle.rho = 0.2
    M, m, k, atan, gamma, tau, d, _ = system.agents.parameters.T

    def rate(x, pairs):
        s, y, w, q = x
        v = (y - q) / tau
        force = k * s + atan * np.arctan(s) + gamma * (v - w)
        u = oracle.law(y, pairs)
        return np.array([v - w, v + tau * (u - d * v - force) / M, force / m, v])

    states, _, _, loop = run_loop(system, h, 150)
    assert loop.monitor.divided == 0
    x = states[0].T
    for row in states[1:]:
        pairs = oracle.pairs(x[3], x[1])
        k1 = rate(x, pairs)
        k2 = rate(x + 0.5 * h * k1, pairs)
        k3 = rate(x + 0.5 * h * k2, pairs)
        k4 = rate(x + h * k3, pairs)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        np.testing.assert_allclose(row.T, x, atol=1e-7)


@pytest.mark.slow  # compiles, or starts programs, for seconds
def test_in_space_mode_implicit_is_the_one_of_plain_python():
    """Rigid agents of 2 kg, moved by Euler's steps of MuJoCo's, on their way through the middle."""
    rng, h, M, d, tau = np.random.default_rng(1), 0.01, 2.0, 6.0, 0.5
    q = cloud(rng, 6, 3)
    y = q + rng.normal(0, 0.02, q.shape)
    oracle = Swap(-q, 4.0, 0.05, R, REACH, TURN)
    start = {"action": y.tolist(), "position": q.tolist()}
    (system,) = in_the_air(-q, initial=start).system_objects()
    states, _, _, loop = run_loop(system, h, 60)
    q, y, near = q.ravel(), y.ravel(), 0
    for row in states[1:]:
        pairs = oracle.pairs(q, y)
        near = max(near, len(pairs))
        v = (y - q) / tau
        y = oracle.implicit(q + (h + tau) * (v - h * d * v / M), h / M * (tau + h), y, pairs)
        q = q + h * (y - q) / (tau + h)
        np.testing.assert_allclose(row.T, [y, q], atol=2e-6)
    assert near >= 3
    assert loop.monitor.least_distance < REACH


@pytest.mark.slow
def test_in_space_agents_keep_apart_arrive_and_touch_nothing():
    """Through the middle of a cube, where they are in each other's way."""
    scenario = in_the_air()
    run = scenario.simulation_object().run()
    report, data = run.reports["robots"], run["robots"]
    assert report["status"] == "converged"
    assert R <= report["separation"]["least_distance"] < 0.65
    points = data["position"].values.reshape(len(data["time"]), 8, 3)
    i, j = np.triu_indices(8, 1)
    nearest = np.linalg.norm(points[:, i] - points[:, j], axis=2).min()
    assert nearest >= report["separation"]["least_distance"]
    assert np.min(data["nearest_distance"]) == pytest.approx(nearest)
    found = certify(scenario.system_objects()[0], scenario.clock())
    assert "half-spaces turn" in str(found)


def test_balloons_that_hold_each_other_straight_above_pass():
    """One wants up where the other one wants down: nothing but the turn moves them aside."""
    place = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, -2.0]])
    run = in_the_air(place).simulation_object().run()
    assert run.status == "converged"
    stuck = in_the_air(place, **{"separation.turn": 0.0}).simulation_object().run()
    assert stuck.reports["robots"]["separation"]["held_by"] == [[1, 2]]


@pytest.mark.parametrize("mode", MODES)
def test_swaps_in_mujoco_and_as_ode_keep_apart_and_arrive(mode):
    found = {}
    for engine in ("mujoco", "ode"):
        system = system_of(plant__engine=engine, **MODES[mode])
        found[engine], _, _, loop = run_loop(system, 0.005, 3000)
        seen = loop.monitor
        assert seen.exit == watch.INSIDE
        assert seen.too_near == 0
        assert least_distance(found[engine]) >= R
        assert R <= seen.least_distance <= least_distance(found[engine]) + 1e-12
        if mode == "implicit":
            assert seen.least_distance == pytest.approx(least_distance(found[engine]), abs=1e-12)
            assert seen.apart == 3001
        assert np.max(np.abs(found[engine][-1, :, 1] - system.centre)) < 1e-2
    assert relative_error(found["mujoco"][:100], found["ode"][:100]) < 1e-9


def test_partial_information_keeps_apart_too():
    controller = {
        "information": "partial", "graph": "ring", "coupling": 5.0, "time_constant": 0.1,
        "mode": "implicit",
    }  # fmt: skip
    states, _, _, loop = run_loop(system_of(controller=controller), 0.01, 1000)
    assert loop.monitor.exit == watch.INSIDE
    assert least_distance(states) >= R


def test_agents_that_never_come_near_move_as_without_separation():
    away = {"game__desired_place": [[-2, 0], [0, 2], [2, 0]], "agents__count": 3}
    start = {"initial__action": [[-3.5, 0], [0, 3.5], [3.5, 0]]}
    found = [
        run_loop(system_of(**away, **start, **more), 0.01, 200)[0]
        for more in ({"separation": None}, {})
    ]
    np.testing.assert_allclose(found[0], found[1], atol=1e-13)


GOLDEN = Path(__file__).parent / "golden" / "separation.json"


def figures(name):
    """What a run of a shipped scenario is known by."""
    run = gm.run(name)
    report, data = run.reports["robots"], run["robots"]
    least, most = (f(data["position"].values, axis=0).tolist() for f in (np.min, np.max))
    found = {
        "least_distance": report["separation"]["least_distance"],
        "most_pairs": report["separation"]["most_pairs"],
        "settling_time": report["settling_time"],
        "least": least,
        "most": most,
        "peak": report["actuators"]["peak"],
    }
    return report, found, data


@pytest.mark.parametrize("name", ["swap", "herd"])
def test_shipped_scenarios(name):
    report, found, data = figures(name)
    for key, value in json.loads(GOLDEN.read_text())[name].items():
        assert found[key] == pytest.approx(value, abs=1e-6), key
    assert report["status"] == "converged"
    assert report["contacts"]["count"] == 0
    assert report["separation"]["too_near"] == 0
    assert report["positions"]["outside"] == 0
    assert np.min(data["nearest_distance"]) == pytest.approx(least_distance(data["state"].values))
    assert np.all(data["nearest_distance_lower_bound"] == report["separation"]["distance"])
