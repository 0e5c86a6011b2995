"""Agents that keep apart: half-planes, neighbours, loops against plain Python, exits, reports."""

import json
from pathlib import Path

import numpy as np
import pytest
from batch_plans import all_chunks
from builders import clock, relative_error, run_loop
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_loops import parts_of
from separation_reference import Swap, half_plane, nearest_point

import gne_mj as gm
from gne_mj import kept_apart
from gne_mj.batches.plan import make_plan
from gne_mj.batches.sweep import Sweep
from gne_mj.environment import load_environment
from gne_mj.errors import InfeasibleStart, InvalidInput
from gne_mj.exit_map import Grid, exit_map
from gne_mj.loops import apart, cells
from gne_mj.loops import monitor as watch
from gne_mj.loops import separation as native
from gne_mj.plants.position_robot import least_damping
from gne_mj.records import fresh
from gne_mj.scenario import load_scenario
from gne_mj.separation import Separation
from gne_mj.summary import summary
from gne_mj.theory import certify

R, REACH, TURN = 0.6, 1.5, 0.5
RULE = {axes: native.Rule(R, REACH, TURN, (0.0,) * axes) for axes in (2, 3)}
AXES = st.sampled_from([2, 3])
seeds = st.integers(0, 2**32 - 1)


def swap(**changes):
    """The scenario with keys of its system changed."""
    keys = {key.replace("__", "."): value for key, value in changes.items()}
    keys = {"plant.engine": "ode", **keys}
    return load_scenario("swap", {"agents.contacts": keys["plant.engine"] == "mujoco", **keys})


def system_of(**changes):
    return swap(**changes).system_objects()[0]


BALLOON = """<mujoco><option gravity="0 0 0"/><worldbody><body name="balloon">
  <joint name="x" type="slide" axis="1 0 0"/><joint name="y" type="slide" axis="0 1 0"/>
  <joint name="z" type="slide"/><geom size="0.3" mass="2"/></body></worldbody>
  <actuator><motor name="east" joint="x"/><motor name="north" joint="y"/>
  <motor name="up" joint="z"/></actuator></mujoco>"""
CUBE = np.array([[i, j, k] for i in (-1.0, 1.0) for j in (-1.0, 1.0) for k in (-1.0, 1.0)])


@pytest.fixture(scope="session")
def balloon(tmp_path_factory):
    """The MJCF of a robot that its forces move in space."""
    path = tmp_path_factory.mktemp("air") / "balloon.xml"
    path.write_text(BALLOON)
    return path


def in_the_air(path, place=-CUBE, **changes):
    """Eight balloons at the corners of a cube, each of which wants its place, within a ball."""
    count = len(place)
    game = {
        "type": "expressions", "dimension": 3, "action_name": "position", "action_unit": "m",
        "cost": "((y[i] - place[i])**2).sum()", "constraints": {"ball": "(y[i]**2).sum() <= 16.0"},
        "parameters": {"place": place.tolist()},
    }  # fmt: skip
    agents = {
        "type": "mjcf-robot", "file": str(path), "count": count, "output": ["x", "y", "z"],
        "input": ["east", "north", "up"], "lookahead": 0.5, "local_damping": 6.0,
    }  # fmt: skip
    start = (-place).tolist()
    tables = {"game": game, "agents": agents, "initial": {"action": start}, **changes}
    return load_scenario("swap", tables)


def near_of(agents, axes):
    """Room for pairs."""
    return fresh(native.Neighbours, agents=agents, axes=axes)


def vector(point):
    """A point (axes,) as native code has it."""
    return (*point, 0.0)[:3]


def drawn(rng, agents, axes):
    """Places and outputs (agents, axes), some outputs far ahead, some agents close together."""
    spread, shape = rng.choice([0.5, 3.0, 30.0]), (agents, axes)
    q = rng.uniform(-spread, spread, shape)
    return q, q + rng.normal(0, rng.choice([0.0, 0.3, 5.0]), shape)


def apart_by(rng, axes):
    """q_i - q_j and y_i - y_j of two agents that a plane can keep apart, often just so."""
    while True:
        a, b = rng.normal(0, rng.choice([0.8, 3.0]), (2, axes))
        if axes == 3 and rng.random() < 0.2:  # straight above each other, or nearly
            a[:2], b[:2] = rng.choice([0.0, 1e-12, 1e-5]) * rng.normal(0, 1, (2, 2))
        size = np.linalg.norm(nearest_point(a, b))
        if size > 1e-3:
            scale = R * (1.0 + 10.0 ** rng.uniform(-9, 0.5)) / size
            return scale * a, scale * b


def cloud(rng, agents, axes=2):
    """Points more than R apart, shape (agents, axes)."""
    points = []
    while len(points) < agents:
        point = rng.uniform(-2.5, 2.5, axes)
        if all(np.linalg.norm(point - other) > 1.02 * R for other in points):
            points.append(point)
    return np.array(points)


# --------------------------------------------------------------------- half-planes, neighbours


@given(seed=seeds, axes=AXES)
def test_half_planes_are_those_of_plain_python_and_leave_half_of_the_margin(seed, axes):
    rng = np.random.default_rng(seed)
    a, b = apart_by(rng, axes)
    turn = rng.choice([0.0, 0.5, 1.5])
    rule = native.Rule(R, REACH, turn, (0.0,) * axes)
    n, size = native.half_plane(rule, vector(a), vector(b))
    assert n[axes:] == (0.0,) * (3 - axes)
    n, margin = np.array(n[:axes]), size - R
    assert np.linalg.norm(n) == pytest.approx(1.0)
    assert min(n @ a, n @ b) - R >= 0.5 * margin * (1.0 - 1e-6) - 1e-15
    np.testing.assert_allclose(n, half_plane(R, turn, a, b), atol=1e-6)
    if turn == 0.0:  # nothing is farther from both
        others = rng.normal(0, 1, (1000, axes))
        others /= np.linalg.norm(others, axis=1, keepdims=True)
        assert min(n @ a, n @ b) >= np.max(np.minimum(others @ a, others @ b)) - 1e-12
    back, _ = native.half_plane(rule, vector(-a), vector(-b))
    np.testing.assert_allclose(back[:axes], -n, atol=1e-12)  # the same line, seen by the other


@given(seed=seeds, axes=AXES)
def test_the_old_half_plane_stays_allowed_so_that_there_is_a_next_one(seed, axes):
    """Whatever y+ is inside it, and q+ on the way from q to y+."""
    rng = np.random.default_rng(seed)
    a, b = apart_by(rng, axes)
    n = np.array(native.half_plane(RULE[axes], vector(a), vector(b))[0][:axes])
    for _ in range(10):
        b = b + rng.normal(0, rng.choice([0.01, 1.0]), axes)
        b = b + max(0.0, R * (1.0 + 1e-9) - n @ b) * n  # inside, on the edge if it was not
        a = a + rng.uniform(0, 1) * (b - a)
        assert min(n @ a, n @ b) > R
        n, size = native.half_plane(RULE[axes], vector(a), vector(b))
        n = np.array(n[:axes])
        assert size > R
        assert min(n @ a, n @ b) > R


def test_in_space_half_planes_turn_as_in_the_plane_that_lies_level_in_it():
    rng = np.random.default_rng(2)
    for _ in range(200):
        a, b = apart_by(rng, 2)
        flat, _ = native.half_plane(RULE[2], vector(a), vector(b))
        spatial, _ = native.half_plane(RULE[3], (*a, 0.0), (*b, 0.0))
        np.testing.assert_allclose(spatial, flat, atol=1e-14)
        lifted, _ = native.half_plane(RULE[3], (*a, 1e-13), (*b, 1e-13))
        np.testing.assert_allclose(lifted, flat, atol=1e-11)


@given(seed=seeds, axes=AXES)
@settings(max_examples=60)
def test_cells_find_the_pairs_that_all_pairs_show(seed, axes):
    rng = np.random.default_rng(seed)
    agents = int(rng.integers(2, 40))
    q, y = drawn(rng, agents, axes)
    if rng.random() < 0.1:
        q[0, 0] = 1e30
    near = near_of(agents, axes)
    cells.find((0.0,) * axes, near, q.ravel(), y.ravel(), REACH, 0.0)
    count = int(near.numbers.pairs)
    found = set(zip(near.first[:count].tolist(), near.second[:count].tolist(), strict=True))
    assert len(found) == count
    expected = {
        (i, j)
        for i in range(agents)
        for j in range(i + 1, agents)
        if np.linalg.norm(nearest_point(q[i] - q[j], y[i] - y[j])) < REACH
    }
    assert found == expected


@given(seed=seeds, axes=AXES)
@settings(max_examples=60)
def test_pairs_that_are_not_near_cannot_come_too_near_within_a_period(seed, axes):
    """Wherever outputs go, every pair that is not in the list stays half way from the reach."""
    rng = np.random.default_rng(seed)
    agents = int(rng.integers(2, 15))
    near, rule = near_of(agents, axes), RULE[axes]
    q = cloud(rng, agents, axes)
    now = q + rng.normal(0, 0.05, q.shape)
    near.place[:], near.output[:] = q.ravel(), now.ravel()
    cells.find(rule.origin, near, near.place, near.output, REACH, 0.0)
    near.numbers.renewed = near.numbers.pairs
    y = now + rng.normal(0, rng.choice([0.03, 1.0, 5.0]), q.shape)
    before = near.numbers.pairs
    added = apart.add_pairs(rule, near, y.ravel())
    assert added == (near.numbers.pairs > before)
    assert not apart.add_pairs(rule, near, y.ravel())
    count = int(near.numbers.pairs)
    known = set(zip(near.first[:count].tolist(), near.second[:count].tolist(), strict=True))
    assert len(known) == count
    for i in range(agents):
        for j in range(i + 1, agents):
            if (i, j) not in known:
                way = nearest_point(q[i] - q[j], y[i] - y[j])
                assert np.linalg.norm(way) >= 0.5 * (R + REACH)


@pytest.mark.slow  # compiles, or starts programs, for seconds
@given(seed=seeds, axes=AXES)
@settings(max_examples=20, deadline=None)
def test_rows_of_the_equation_are_the_slopes_of_its_differences(balloon, seed, axes):
    """Of pairs in the barrier, in whatever order the matrix has its rows."""
    rng, h = np.random.default_rng(seed), 1e-7
    parts = parts_of(
        system_of() if axes == 2 else in_the_air(balloon).system_objects()[0], clock(0.01)
    )
    m, rule = 8 * axes, RULE[axes]
    scratch, solver = parts.loop.work, parts.solver
    near = native.neighbours_in(scratch.separation, parts.problem, rule.origin)
    q = cloud(rng, 8, axes)
    y = q + rng.normal(0, 0.005, q.shape)
    near.place[:], near.output[:] = q.ravel(), y.ravel()
    cells.find(rule.origin, near, near.place, near.output, REACH, 0.0)
    assert native.renew(rule, near, 0, parts.monitor, 0.0)
    solver.base[:], solver.stiff[:], solver.numbers.rho = q.ravel(), rng.uniform(50, 200, m), 0.05
    at, order = np.zeros(m, dtype=np.int64), parts.problem.order
    apart.put_in_line(near, rule.origin, at, True)
    b = int(apart.half_band(parts.problem, near, rule.origin, at))
    ordered = parts.problem._replace(order=order._replace(position=at, band=np.array([b, 0])))
    kept = apart.Kept(np.zeros(0), near, rule)

    def residual(trial):
        solver.trial[:] = trial
        assert apart.residual(ordered, 0, 8, kept, scratch, solver)
        return solver.residual.copy()

    y = y.ravel()
    steps = h * np.eye(m)
    expected = np.array([(residual(y + s) - residual(y - s)) / (2 * h) for s in steps]).T
    residual(y)
    apart.assemble(ordered, 0, 8, b, kept, scratch, solver)
    found = np.zeros((m, m))
    for r in range(m):
        for c in range(m):
            if abs(at[r] - at[c]) <= b:
                found[r, c] = solver.band[at[r], at[c] - at[r] + b]
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-5 * np.max(np.abs(expected)))
    step = rng.normal(0, 1e-3, m)
    length = apart.local_length(ordered, 0, 8, kept, step[np.argsort(at)], solver)
    moved, normals = (
        step.reshape(8, axes),
        np.column_stack([near.along, near.across, *[near.up] * (axes - 2)]),
    )
    used = [
        abs(n @ (moved[int(i)] - moved[int(j)])) / s
        for i, j, n, s in zip(
            near.first, near.second, normals, near.slack,
            strict=True,
        )
        if s > 0 and (i, j) != (0, 0)
    ]  # fmt: skip
    assert length >= max(used, default=0.0) * (1 - 1e-12)


@given(seed=seeds)
@settings(max_examples=30)
def test_the_pushes_slope_is_that_of_its_differences(seed):
    """And the push itself begins at 0, with its slope, where two agents are at the reach."""
    rng, h, most = np.random.default_rng(seed), 1e-6, REACH - R
    s = most * 10.0 ** rng.uniform(-3, -0.01)
    slope = (native.push(0.05, s * (1 + h), most) - native.push(0.05, s * (1 - h), most)) / (
        2 * h * s
    )
    assert slope == pytest.approx(-0.05 / s**2, rel=1e-6)
    assert native.push(0.05, most, most) == 0.0
    assert native.push(0.05, most * (1 - h), most) == pytest.approx(0.05 / most * h, rel=1e-3)


# ------------------------------------------------------------------------------------- loops


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
def test_in_space_mode_implicit_is_the_one_of_plain_python(balloon):
    """Rigid agents of 2 kg, moved by Euler's steps of MuJoCo's, on their way through the middle."""
    rng, h, M, d, tau = np.random.default_rng(1), 0.01, 2.0, 6.0, 0.5
    q = cloud(rng, 6, 3)
    y = q + rng.normal(0, 0.02, q.shape)
    oracle = Swap(-q, 4.0, 0.05, R, REACH, TURN)
    start = {"action": y.tolist(), "position": q.tolist()}
    (system,) = in_the_air(balloon, -q, initial=start).system_objects()
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


def test_in_space_agents_keep_apart_arrive_and_touch_nothing(balloon):
    """Through the middle of a cube, where they are in each other's way."""
    scenario = in_the_air(balloon)
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


def test_balloons_that_hold_each_other_straight_above_pass(balloon):
    """One wants up where the other one wants down: nothing but the turn moves them aside."""
    place = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, -2.0]])
    run = in_the_air(balloon, place).simulation_object().run()
    assert run.status == "converged"
    stuck = in_the_air(balloon, place, **{"separation.turn": 0.0}).simulation_object().run()
    assert stuck.reports["robots"]["separation"]["held_by"] == [[1, 2]]


def least_distance(states):
    """Of all positions at all samples, in m."""
    points = states[:, :, 3].reshape(len(states), -1, 2)
    i, j = np.triu_indices(points.shape[1], 1)
    return np.min(np.linalg.norm(points[:, i] - points[:, j], axis=2))


MODES = {
    "implicit": {},
    "continuous": {"controller__mode": "continuous", "plant__integrator": "rk4"},
    "euler": {"controller__mode": "continuous"},
}


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


# ------------------------------------------------------------------------------- what is told


def pushed(size, **changes):
    """Two robots next to each other, one of which is pushed at the other."""
    push = {"type": "push", "agents": [1], "force": size, "axis": 1, "start": 0.1}
    pair = {"game__desired_place": [[-0.5, 0], [0.5, 0]], "agents__count": 2}
    return swap(
        **pair, initial__action=[[-0.5, 0], [0.5, 0]], simulation__duration=1.0, faults=[push],
        **changes,
    )  # fmt: skip


def test_agents_that_are_pushed_too_near_end_the_run():
    run = pushed(200.0).simulation_object().run()
    assert run.status == "too_near"
    report = run.reports["robots"]
    assert "agents 1 and 2" in report["message"]
    assert report["separation"]["too_near"] in (0, 1)
    assert report["exit"]["agents"] == [1, 2]
    assert report["exit"]["constraint"] is None
    assert "separation" in summary(report)


def test_a_deadlock_is_told_with_the_pair_that_holds():
    """Two robots head on whose half-planes do not turn."""
    head_on = {
        "game__desired_place": [[2, 0], [-2, 0]], "agents__count": 2, "separation__turn": 0.0,
        "initial__action": [[-2, 0], [2, 0]], "agents__appendage_mass": 0.1,
    }  # fmt: skip
    run = swap(**head_on).simulation_object().run()
    assert run.status == "completed"
    report = run.reports["robots"]
    told = "at rest, away from equilibrium: held by the separation of agents 1 and 2"
    assert told in report["message"]
    assert report["separation"]["held_by"] == [[1, 2]]
    assert swap(**{**head_on, "separation__turn": 0.3}).simulation_object().run().status == (
        "converged"
    )


@pytest.mark.parametrize("held", [False, True])
def test_agents_that_something_else_holds_are_not_told_as_held(held):
    """Robots far from each other, one of which is pushed off its place all the time; a deadlock."""
    place, push = (2, {}) if held else (-2, {"type": "push", "agents": [1], "force": 0.5})
    scenario = swap(
        agents__count=2, game__desired_place=[[place, 0], [-place, 0]], separation__turn=0.0,
        initial__action=[[-2, 0], [2, 0]], agents__appendage_mass=0.1,
        faults=[push] if push else [],
    )  # fmt: skip
    run = scenario.simulation_object().run()
    assert run.status == "completed"
    assert bool(run.reports["robots"]["separation"]["held_by"]) is held
    assert all_chunks(make_plan(scenario, starts=0), 1)["held"][1].tolist() == [float(held)]


PARTIAL = {"information": "partial", "graph": "ring", "mode": "implicit"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"controller__mode": "sampled"}, r"separation: .*'sampled'.*'continuous' or 'implicit'"),
        ({"controller__decentralised": True}, r"separation: .*full and partial"),
        (
            {"controller": {"information": "distributed", "graph": "ring", "mode": "implicit",
                            "epsilon": 0.1, "gain": 1.0}},
            r"separation: .*full and partial",
        ),
        ({"faults": [{"type": "noise", "amplitude": 0.1}]}, r"separation: .*sensors"),
        ({"margin": {"push": 0.1}}, r"separation: .*margin"),
        ({"separation__reach": 0.5}, r"separation\.reach: .*more than the distance, 0\.6 m"),
        ({"separation": {"distance": 0.6, "gap": 1.0}}, r"gap"),
    ],
)  # fmt: skip
def test_what_it_is_not_for_is_refused(changes, words):
    with pytest.raises(InvalidInput, match=words):
        system_of(**changes)


def test_agents_on_a_lane_and_those_of_velocities_are_refused():
    for name in ("platoon", "planar-sync"):
        with pytest.raises(InvalidInput, match=r"separation: .*in the plane or in space"):
            load_scenario(name, {"separation": {"distance": 0.1}}).system_objects()


def test_a_start_too_near_names_the_agents():
    start = swap().systems["robots"].initial.action
    near = [list(place) for place in start]
    near[3] = [start[2][0] + 0.5, start[2][1]]
    with pytest.raises(InfeasibleStart, match="separation of agents 3 and 4"):
        system_of(initial__action=near)
    ahead = [list(place) for place in start]
    ahead[0], ahead[4] = ahead[4], ahead[0]  # outputs run past each other
    with pytest.raises(InfeasibleStart, match="separation of agents"):
        system_of(initial={"action": ahead, "position": start})


def test_certificates_promise_safety_and_no_arrival():
    scenario = swap()
    ticks = scenario.clock()
    found = certify(scenario.system_objects()[0], ticks)
    kept = "the positions of any two agents are at least 0.6 m apart"
    assert any(kept in text and "every integration step" in text for text in found.guaranteed)
    assert any("that agents arrive" in text for text in found.not_certified)
    assert not found.lyapunov_claimed
    assert "separation" in str(found)
    found = certify(system_of(**MODES["continuous"]), ticks)
    whole = "in continuous time every shared constraint holds for all time"
    assert found.guaranteed == [whole, f"{kept} in continuous time"]
    assert not found.lyapunov_claimed
    assert not any("tends to" in text for text in found.guaranteed)
    for changes in ({"agents__local_damping": 0.1, **MODES["continuous"]}, MODES["euler"],
                    {"plant__integrator": "rk4"}, {"agents__input_limit": 1.0}):  # fmt: skip
        found = certify(system_of(**changes), ticks)
        assert not found.separation["promised"]
        assert not any(kept in text for text in found.guaranteed)
        assert any("that agents keep 0.6 m apart" in text for text in found.not_certified)


def test_batches_draw_starts_that_are_apart_and_keep_distances():
    scenario = swap(simulation__duration=0.5)
    plan = make_plan(scenario, sweeps=[Sweep("separation.distance", (0.5, 0.6))], starts=3, seed=4)
    rows = all_chunks(plan, 1)
    least = rows["least_distance"][1]
    assert np.all((least >= np.repeat([0.5, 0.6], 3)) | np.isnan(least))
    assert np.all(rows["too_near"][1] == 0)
    for run in range(plan.runs):
        system = plan.alone(run).system_objects()[0]
        assert np.array_equal(system.start, system.start_positions)


def test_maps_and_environments_say_why_they_are_none():
    system = system_of()
    with pytest.raises(InvalidInput, match=r"system\.separation: .*gne-mj batch"):
        exit_map(system, 0.01, Grid((0.01,), (0.5,)))
    with pytest.raises(InvalidInput, match=r"systems\.robots\.separation: .*environment"):
        load_environment("swap")


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


def test_numbers_that_make_no_sense_are_refused():
    for numbers in ((0.0, 1.0, 0.1), (1.0, 1.0, 0.1), (1.0, 2.0, 2.0), (np.nan, 2.0, 0.1)):
        with pytest.raises(InvalidInput):
            Separation(*numbers)


def test_sentences_name_the_first_pairs_and_count_the_rest():
    pairs = [(0, k) for k in range(1, 8)]
    assert kept_apart.pairs_text(pairs).endswith("agents 1 and 6 and 2 pairs more")
