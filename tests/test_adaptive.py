"""Adaptive steps by Tsitouras's pair: its orders, its accuracy, its exits."""

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    EQUAL,
    UNEQUAL,
    V0,
    clock,
    distributed,
    osnr_system,
    pi_cascades,
    random_robot_state,
    reference_osnr,
    reference_pi,
    reference_robots,
    robot_state,
    robot_system,
    run_loop,
)
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from test_division import NEAR, near_darkness, robots_outputs

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.barrier import Schedule
from gne_mj.controllers import PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.faults import Bias
from gne_mj.loops import division, tsitouras
from gne_mj.loops import monitor as watch
from gne_mj.simulation import Simulation

# ------------------------------------------------------------------------------------ the method


def butcher():
    """A (7, 7); b and the embedded b (7,), as arrays."""
    a = np.zeros((tsitouras.STAGES, tsitouras.STAGES))
    for stage, row in enumerate(tsitouras.A):
        a[stage + 1, : len(row)] = row
    return a, a[-1], a[-1] - np.array(tsitouras.E)


def conditions(a):
    """(order, elementary weight, 1 / its density): Hairer, Norsett and Wanner I, section II.2."""
    c, one = a.sum(axis=1), np.ones(len(a))
    return [
        (1, one, 1), (2, c, 2), (3, c**2, 3), (3, a @ c, 6),
        (4, c**3, 4), (4, c * (a @ c), 8), (4, a @ c**2, 12), (4, a @ a @ c, 24),
        (5, c**4, 5), (5, c**2 * (a @ c), 10), (5, (a @ c) ** 2, 20), (5, c * (a @ c**2), 15),
        (5, c * (a @ a @ c), 30), (5, a @ c**3, 20), (5, a @ (c * (a @ c)), 40),
        (5, a @ a @ c**2, 60), (5, a @ a @ a @ c, 120),
    ]  # fmt: skip


def dense(share):
    """Weights (7,) of the rates in the state at a share of the step."""
    found = np.zeros(tsitouras.STAGES)
    tsitouras.interpolate(share, 1.0, np.zeros(tsitouras.STAGES), np.eye(tsitouras.STAGES), found)
    return found


def test_orders_of_the_pair_and_of_its_dense_output():
    a, new, embedded = butcher()
    assert a.sum(axis=1) == pytest.approx(np.array(tsitouras.NODES), abs=1e-14)
    for order, weight, density in conditions(a):
        assert new @ weight == pytest.approx(1 / density, abs=2e-14)
        if order < 5:
            assert embedded @ weight == pytest.approx(1 / density, abs=2e-14)
            for share in (0.2, 0.5, 0.9):
                assert dense(share) @ weight == pytest.approx(share**order / density, abs=2e-14)
    assert abs(embedded @ conditions(a)[-1][1] - 1 / 120) > 1e-4  # an estimate of the error
    assert dense(1.0) == pytest.approx(new, abs=1e-14)
    assert dense(0.0) == pytest.approx(np.zeros(7))


def taken(h):
    """The step of h s of a pendulum from (1, 0.5): its end, and its middle."""

    def rate(x):
        return np.array([x[1], -np.sin(x[0])])

    state, trial, middle, k = np.array([1.0, 0.5]), np.zeros(2), np.zeros(2), np.zeros((7, 2))
    k[0] = rate(state)
    for stage in range(1, tsitouras.STAGES):
        tsitouras.stage_state(stage, h, state, k, trial)
        k[stage] = rate(trial)
    tsitouras.interpolate(0.5, h, state, k, middle)
    exact = solve_ivp(
        lambda _, x: rate(x), (0.0, h), state, "DOP853", [0.5 * h, h], rtol=1e-13, atol=1e-15
    ).y.T
    error = np.zeros(2)
    tsitouras.difference(h, k, error)
    return [np.max(np.abs(off)) for off in (trial - exact[1], middle - exact[0], error)]


def test_errors_of_a_step_fall_as_the_orders_say():
    """That of the end as h^6, those of the dense output and of the embedded solution as h^5."""
    orders = np.log2(np.array(taken(0.2)) / np.array(taken(0.1)))
    assert np.all(np.abs(orders - [6.0, 5.0, 5.0]) < [0.6, 0.4, 0.4]), orders


@given(
    st.floats(1e-9, 10.0),
    st.one_of(st.floats(0.0, 1e3), st.just(np.inf), st.just(np.nan)),
    st.floats(0.0, 1.0),
    st.booleans(),
)
def test_lengths_of_steps(h, error, last, failed):
    length, kept = tsitouras.next_length(h, error, last, float(failed), 1e-4)
    if error <= 1.0:
        seen = max(error, 1e-4)
        wanted = 0.9 * seen ** (-5 / 32) * (last or 1.0)
        assert length == pytest.approx(h * (min(wanted, 1.0) if failed else wanted))
        assert kept == pytest.approx(seen ** (1 / 16))
    else:
        part = max(0.2, 0.9 * error ** (-3 / 16)) if error < np.inf else 0.5
        assert length == pytest.approx(max(part * h, 1e-4) if h > 1e-4 else part * h)
        assert length <= h


# --------------------------------------------------------------------------------- the closed loop

LINE = graphs.line(5)
EXACT = 1e-10


def exact(agent, law, game, system, times, **numbers):
    """Flat states (times, n) by SciPy's DOP853 on the oracle's rate."""
    rate = reference.closed_loop_rate(agent, law, game, system.rho, **numbers)
    z, estimates = None, None
    if law != "full_information":
        z, estimates = reference.consensus_start(system.start, with_z="epsilon" in numbers)
    start = reference.pack(system.state[:, : agent.n], z, estimates)
    found = solve_ivp(
        rate, (0.0, times[-1]), start, "DOP853", times, rtol=1e-11, atol=1e-13, max_step=0.1
    )
    assert found.success
    return found.y.T


def robots(law=None, **options):
    rng = np.random.default_rng(3)
    state = random_robot_state(rng, np.full(5, 3.0))
    return robot_system(state, UNEQUAL, law=law, integrator="tsit5", **options)


ROBOTS = reference_robots(UNEQUAL), reference_games.VelocityGame(V0, [3.0] * 5)
CASES = {
    "robots, full": lambda: (robots(rtol=EXACT), *ROBOTS, "full_information", {}),
    "robots, partial": lambda: (
        robots(PartialInformation(LINE, 2.0, 0.5), rtol=EXACT), *ROBOTS, "partial_information",
        {"laplacian": np.array(LINE.laplacian), "c": 2.0, "tau": 0.5},
    ),
    "channels, distributed": lambda: (
        osnr_system(pi_cascades(10), distributed("line", 0.1, 0.01), 0.1, integrator="tsit5",
                    rtol=EXACT),
        reference_pi(10), reference_osnr(), "fully_distributed",
        {"laplacian": np.array(graphs.line(10).laplacian), "k": 0.01, "epsilon": 0.1},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_runs_agree_with_scipy_at_every_sample(name):
    system, agent, game, law, numbers = CASES[name]()
    states, _, _, loop = run_loop(system, 0.01, 100)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.steps[0] < 100  # most samples lie between two steps
    wanted = exact(agent, law, game, system, 0.01 * np.arange(101), **numbers)
    size = system.game.agents * agent.n
    got = states[:, :, : agent.n].reshape(len(states), -1)
    assert np.max(np.abs(got - wanted[:, :size])) < 20 * EXACT * np.max(np.abs(got))


def test_errors_fall_with_the_fifth_power_of_the_steps():
    wanted = exact(*ROBOTS[:1], "full_information", ROBOTS[1], robots(), np.array([0.0, 5.0]))
    errors, counts = [], []
    for rtol in (1e-5, 1e-9):
        states, _, _, loop = run_loop(robots(rtol=rtol), 0.01, 500, every=500)
        errors.append(np.max(np.abs(states[-1, :, :3].ravel() - wanted[-1])))
        counts.append(loop.steps[0])
    order = np.log(errors[0] / errors[1]) / np.log(counts[1] / counts[0])
    assert 4.5 < order < 6.5


@pytest.mark.parametrize("rho", [0.1, 1e-3])
def test_runs_from_next_to_every_bound_follow_continuous_time(rho):
    """Robots 0.1% from every bound: many stages are outside at first, and no law is asked there."""
    system = robot_system(robot_state(NEAR), EQUAL, rho=rho, integrator="tsit5", rtol=1e-8)
    loop = system.closed_loop(clock(0.05))
    rows = loop.advance(4, 1)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.steps[1] > 0
    assert np.all(loop.monitor.worst < 0.0)
    assert np.all(np.isfinite(rows.input))
    if rho == 0.1:
        expected = robots_outputs(robot_state(NEAR), EQUAL, 0.05 * np.arange(4))
        assert np.max(np.abs(rows.state[:, :, 1] - expected)) < 1e-6


def test_where_no_step_does_the_run_says_so_and_stays_inside():
    state = robot_state(V0 + np.array([-2.9999999999, 0.0, 0.0, 0.0, 0.0]))
    system = robot_system(state, EQUAL, integrator="tsit5")
    trajectory = Simulation([system], clock(0.01, 1.0)).run()
    assert trajectory.status == "step_too_small"
    report = trajectory.reports["robots"]
    assert f"1/{division.PIECES} of the timestep" in report["message"]
    assert report["worst_constraint"]["margin"] > 0.0
    assert report["exit"]["value"] < 0.0
    assert np.all(trajectory["robots"]["constraint"].to_numpy() < 0.0)


def test_a_law_that_cannot_keep_the_set_leaves_it_and_that_is_said():
    """At their limits actuators cannot brake robots that run into a bound."""
    appendage = V0 + np.array([-60.0, 0.0, 0.0, 0.0, 0.0])
    state = robot_state(V0 + np.array([-2.5, 0.0, 0.0, 0.0, 0.0]), appendage=appendage)
    found = [
        run_loop(robot_system(state, EQUAL, limit=0.5, integrator=how), h, steps)[3]
        for how, h, steps in (("tsit5", 0.01, 100), ("rk4", 1e-4, 10_000))
    ]
    assert [each.monitor.exit for each in found] == [watch.LEFT_SET] * 2
    times = [each.monitor.exit_time for each in found]
    assert times[0] == pytest.approx(times[1], abs=2e-4)
    assert found[0].time == pytest.approx(times[0], abs=1e-4)
    assert np.all(np.isfinite(found[0].finish().state))
    assert len(found[0].advance(5, 1).input) == 0  # it has ended


def test_an_exit_that_shorter_steps_have_too_is_told_at_its_time():
    """With this epsilon outputs leave in continuous time: the barrier is at z, far from y."""
    times = []
    for how, h in (("tsit5", 0.01), ("tsit5", 0.002), ("rk4", 0.002)):
        monitor = run_loop(replace(near_darkness(0.01), integrator=how), h, 50)[3].monitor
        assert monitor.exit == watch.LEFT_SET
        assert 0.0 <= monitor.exit_value < 1e-9
        times.append(monitor.exit_time)
    assert times == pytest.approx([times[-1]] * 3, abs=1e-7)


def test_runs_do_not_depend_on_how_they_are_cut():
    whole, parts = (robots().closed_loop(clock(0.01)) for _ in range(2))
    one = whole.advance(40, 5)
    several = [parts.advance(count, 5) for count in (1, 9, 0, 30)]
    ends = whole.finish(), parts.finish()
    for name in ("state", "input", "memory"):
        pieces = np.concatenate([getattr(samples, name) for samples in several])
        assert np.array_equal(getattr(one, name), pieces)
        assert np.array_equal(*(getattr(end, name) for end in ends))
    assert np.array_equal(whole.monitor, parts.monitor)
    assert whole.steps == parts.steps


def test_the_monitor_sees_every_step_and_every_row():
    loop = robots().closed_loop(clock(0.01))
    rows = loop.advance(100, 1)
    worst = max(np.max(robots().game.constraints(y)) for y in rows.state[:, :, 1])
    assert np.max(loop.monitor.worst) >= worst
    assert loop.monitor.steps <= loop.steps[0] < 100
    present, last = loop.present(), loop.finish()
    assert np.array_equal(present.state, last.state[0])


def test_penalties_that_fall_and_limited_inputs():
    schedule, like = Schedule("exponential", 1.0, 0.05, 1.0), robots(limit=4.0)
    fine, coarse = (
        run_loop(replace(like, schedule=schedule, integrator=how, rtol=1e-8), h, n, every=n // 20)
        for how, h, n in (("rk4", 1e-3, 2000), ("tsit5", 0.01, 200))
    )
    assert np.max(np.abs(coarse[0] - fine[0])) < 1e-4
    assert np.max(np.abs(coarse[1])) == 4.0
    assert coarse[3].monitor.saturated == 1.0


def test_a_run_goes_on_from_where_it_is_with_other_numbers():
    system, later = robots(rtol=EXACT), robots(rtol=EXACT, rho=0.5)
    loop = system.closed_loop(clock(0.01))
    loop.advance(10, 5)
    loop.adopt(later.setup(clock(0.01)))
    got = loop.advance(10, 5).state
    slow = robot_system(system.state, UNEQUAL).closed_loop(clock(1e-3))
    slow.advance(10, 50)
    slow.adopt(robot_system(system.state, UNEQUAL, rho=0.5).setup(clock(1e-3)))
    assert np.max(np.abs(got - slow.advance(10, 50).state)) < 1e-9


def test_estimates_too_fast_for_the_shortest_step_are_refused():
    system = osnr_system(pi_cascades(10), distributed("line", 1e-6, 0.01), 0.1, integrator="tsit5")
    system.closed_loop(clock(1e-3))
    with pytest.raises(InvalidInput, match=r"'tsit5' can follow with timesteps of at most 0.003"):
        system.closed_loop(clock(0.01))


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ({"engine": "mujoco"}, "MuJoCo steps by itself"),
        ({"mode": "sampled"}, "mode 'continuous'"),
        ({"mode": "implicit"}, "mode 'continuous'"),
        ({"faults": (Bias(),)}, "knows none"),
    ],
)
def test_what_it_is_not_for_is_refused(options, why):
    with pytest.raises(InvalidInput, match=why):
        robots(**options)
