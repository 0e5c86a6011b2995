"""Half-planes, neighbours, pushes and rows of agents that keep apart, against plain Python."""

import numpy as np
import pytest
from builders import clock
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_loops import parts_of
from separation_fleets import REACH, TURN, R, cloud, in_the_air, system_of
from separation_reference import half_plane, nearest_point

from gne_mj.loops import apart, cells
from gne_mj.loops import separation as native
from gne_mj.records import fresh

RULE = {axes: native.Rule(R, REACH, TURN, (0.0,) * axes) for axes in (2, 3)}
AXES = st.sampled_from([2, 3])
seeds = st.integers(0, 2**32 - 1)


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
    """And nearly so where it is nearly level."""
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
def test_rows_of_the_equation_are_the_slopes_of_its_differences(seed, axes):
    """Of pairs in the barrier, in whatever order the matrix has its rows."""
    rng, h = np.random.default_rng(seed), 1e-7
    parts = parts_of(system_of() if axes == 2 else in_the_air().system_objects()[0], clock(0.01))
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
