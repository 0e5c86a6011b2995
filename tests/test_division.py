"""Mode continuous near the boundary: steps are divided so that runs follow continuous time."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from builders import (
    EQUAL,
    UNEQUAL,
    V0,
    clock,
    distributed,
    integrators,
    osnr_system,
    pi_cascades,
    random_robot_state,
    relative_error,
    robot_state,
    robot_system,
    run_loop,
)
from commands import gne_here
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from gne_mj.controllers import FullInformation
from gne_mj.controllers import settings as settings_of_laws
from gne_mj.faults import Bias
from gne_mj.games import ten_channels
from gne_mj.loops import division, faultless
from gne_mj.loops import monitor as watch
from gne_mj.numbers import numbers
from gne_mj.records import fresh
from gne_mj.simulation import Simulation
from gne_mj.theory import certify

DELTA, RHO = np.full(5, 3.0), 0.1
NUMBERS = ("main_mass", "appendage_mass", "stiffness", "atan_coefficient", "damping")
ENGINES = pytest.mark.parametrize("engine", ["ode", "mujoco"])
NEAR = 0.999 * 3.0 * -np.arange(1.0, 6.0) + V0  # each gap 0.1% from its bound


def solution(rate, inside, x0, times):
    """States (times, n) by an implicit method; ``inside`` is where the rate is defined."""

    def rate_inside(t, x):
        return rate(x) if inside(x) else np.full_like(x, np.nan)

    found = solve_ivp(
        rate_inside, (0.0, times[-1] + 1e-9), x0, method="Radau", rtol=1e-9, atol=1e-12,
        t_eval=times, first_step=1e-10,
    )  # fmt: skip
    assert found.success
    return found.y.T


def robots_outputs(state, numbers, times):
    """Outputs (times, 5) of robots under full information, from the paper's equations."""
    main, appendage, stiffness, atan, damping = (np.array(numbers[name]) for name in NUMBERS)

    def gaps(x):
        return np.diff(x[5:10], prepend=V0)

    def rate(x):
        extension, y, follower = x[:5], x[5:10], x[10:]
        gap = gaps(x)
        barrier = 2.0 * RHO * gap / (9.0 - gap**2)  # of agent i in its own gap; and in the next one
        u = -(2.0 * gap + barrier - np.append(barrier[1:], 0.0))
        pull = stiffness * extension + atan * np.arctan(extension) + damping * (y - follower)
        return np.concatenate([y - follower, (u - pull) / main, pull / appendage])

    def inside(x):
        return np.all(np.abs(gaps(x)) < 3.0)

    return solution(rate, inside, state[:, :3].T.ravel(), times)[:, 5:10]


def starts():
    rng = np.random.default_rng
    return {
        "0.1% from every bound": (robot_state(NEAR), EQUAL),
        "one gap 1e-3 from its bound": (robot_state(V0 + np.array([-2.999, 0, 0, 0, 0])), EQUAL),
        "to and fro": (robot_state(V0 + np.cumsum([2.99, -2.99, 2.99, -2.99, 0.0])), UNEQUAL),
        "kicked": (random_robot_state(rng(5), 0.9 * DELTA, spread=60.0), EQUAL),
    }


@ENGINES
@pytest.mark.parametrize("name", starts())
def test_robots_near_their_bounds_follow_continuous_time(name, engine):
    """A fixed step of 2 ms leaves from all of these but the last."""
    state, numbers = starts()[name]
    system = robot_system(state, numbers, engine=engine)
    h, steps = 0.002, 100
    states, u, _, loop = run_loop(system, h, steps)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.monitor.divided > 0
    assert 0.0 < loop.monitor.smallest_step < h
    assert np.all(np.isfinite(u))
    expected = robots_outputs(state, numbers, h * np.arange(steps + 1))
    assert relative_error(states[:, :, 1], expected) < 1e-6


def test_channels_with_a_small_penalty_follow_continuous_time():
    """The barrier is a wall then, which powers that rise run into."""
    system = osnr_system(integrators(10), FullInformation(), 0.2, rho=1e-4)
    h, steps = 0.002, 150
    states, _, _, loop = run_loop(system, h, steps)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.monitor.divided > 0
    p = ten_channels()
    weight, gain = np.array(p["utility_weight"]), np.array(p["gain"])
    interference = np.array(p["system_matrix"]) * (1.0 - np.eye(10))

    def rate(y):
        denominator = p["noise_power"] + interference @ y + gain * y
        room = p["total_power_limit"] - np.sum(y)
        return -(p["price"] - weight * gain / denominator - 1e-4 / y + 1e-4 / room)

    def inside(y):
        return np.all(y > 0) and np.sum(y) < p["total_power_limit"]

    expected = solution(rate, inside, np.full(10, 0.2), h * np.arange(steps + 1))
    assert relative_error(states[:, :, 0], expected) < 1e-6


@ENGINES
def test_a_divided_run_is_the_same_however_it_is_cut(engine):
    system = robot_system(robot_state(NEAR), UNEQUAL, engine=engine)
    at_once, in_parts = (system.closed_loop(clock(0.01, 1.0)) for _ in range(2))
    whole = at_once.advance(20, 1)
    rows = [in_parts.advance(n, 1) for n in (1, 1, 3, 10, 5)]
    assert at_once.monitor.divided > 3
    assert np.array_equal(whole.state, np.concatenate([part.state for part in rows]))
    assert np.array_equal(whole.input, np.concatenate([part.input for part in rows]))
    assert np.array_equal(at_once.monitor, in_parts.monitor)
    assert np.array_equal(at_once.finish().state, in_parts.finish().state)


@ENGINES
def test_whole_steps_come_back_behind_the_boundary(engine):
    system = robot_system(robot_state(NEAR), engine=engine)
    loop = system.closed_loop(clock(0.002, 10.0))
    loop.advance(1, 100)
    divided, steps = loop.monitor.divided, loop.monitor.steps
    assert 0 < divided < 30
    loop.advance(1, 400)
    assert loop.monitor.divided == divided
    assert loop.monitor.steps == steps + 400
    assert loop.time == pytest.approx(1.0)


@ENGINES
def test_euler_too_stays_inside(engine):
    system = robot_system(robot_state(NEAR), engine=engine, integrator="euler")
    states, _, _, loop = run_loop(system, 0.01, 50)
    assert loop.monitor.exit == watch.INSIDE
    assert loop.monitor.divided > 0
    expected = robots_outputs(robot_state(NEAR), EQUAL, 0.01 * np.arange(51))
    assert relative_error(states[:, :, 1], expected) < 0.05  # a method of first order


@ENGINES
def test_where_the_finest_pieces_do_not_do_the_run_says_so(engine):
    """So near that the barrier moves agents out on the other side within 1/4096 of a step."""
    state = robot_state(V0 + np.array([-2.9999999999, 0.0, 0.0, 0.0, 0.0]))
    system = robot_system(state, engine=engine)
    trajectory = Simulation([system], clock(0.002, 1.0)).run()
    report = trajectory.reports["robots"]
    assert trajectory.status == "step_too_small"
    assert "gap of agent 1" in report["message"]
    assert "mode 'implicit'" in report["message"]
    assert "1/4096" in report["message"]
    assert report["worst_constraint"]["margin"] > 0
    assert report["exit"]["value"] < 0
    robots = trajectory["robots"]
    assert np.array_equal(robots["action"].to_numpy()[-1], state[:, 1])  # the step was not taken
    assert np.all(robots["constraint"].to_numpy() < 0)


@ENGINES
def test_a_law_that_cannot_keep_the_set_leaves_it_and_that_is_said(engine):
    """Appendages pull harder than the actuators are able to hold: no step would do."""
    state = robot_state(np.full(5, 0.5), appendage=20.0 * np.array([-1, 1, -1, 1, -1]))
    system = robot_system(state, limit=1.0, engine=engine)
    trajectory = Simulation([system], clock(0.002, 5.0)).run()
    report = trajectory.reports["robots"]
    assert trajectory.status == "left_feasible_set"
    assert report["exit"]["value"] >= 0
    assert report["actuators"]["saturated"] is not None


def near_darkness(share):
    """Ten channels, fully distributed, one with only this share of the others' power."""
    y = np.full(10, 0.2)
    y[2] *= share
    return osnr_system(pi_cascades(10), distributed(), y)


def test_an_exit_that_finer_pieces_do_not_have_is_not_the_laws_own():
    """Its barrier is at z, which starts as near the bound: 1/4096 of a step throws outputs out."""
    report = Simulation([near_darkness(1e-9)], clock(0.002, 0.1)).run().reports["channels"]
    assert report["status"] == "step_too_small"
    assert report["exit"]["value"] < 0


def test_an_exit_that_finer_pieces_have_too_is_the_laws_own():
    """Less near, epsilon is too large all the same: with any timestep outputs leave together."""
    times = []
    for h in (0.002, 0.0005):
        report = Simulation([near_darkness(0.01)], clock(h, 0.1)).run().reports["channels"]
        assert report["status"] == "left_feasible_set"
        assert report["exit"]["value"] >= 0
        times.append(report["exit"]["time"])
    assert times[0] == pytest.approx(times[1], abs=1e-6)


def test_the_report_counts_divided_steps():
    done = gne_here(
        "run", "velocity-sync", "--json", "--set", "simulation.duration=0.1",
        "--set", "initial.action=[0.003, -2.994, -5.991, -8.988, -11.985]",
    )  # fmt: skip
    assert done.returncode == 0
    found = json.loads(done.stdout)["systems"]["robots"]["division"]
    assert found["divided_steps"] > 0
    assert 0.002 / 4096 <= found["smallest_step"] < 0.002


@ENGINES
def test_the_first_steps_finest_piece_is_foretold(engine):
    """With appendages in motion too, which pull outputs to their bounds within the step."""
    found = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        state = random_robot_state(rng, DELTA, spread=30.0)
        system = robot_system(state, UNEQUAL, rho=1e-4, engine=engine)
        told = certify(system, clock(0.02)).to_dict()["division"]["start"]
        run = Simulation([system], clock(0.02, 0.02)).run().reports["robots"]
        if run["status"] == "step_too_small":
            assert told is None
        else:
            assert told == 0.02 / (run["division"]["smallest_step"] or 0.02)
        found.append(told)
    assert len(set(found)) > 2, "of different lengths"


def test_a_first_step_that_ends_the_run_otherwise_is_no_matter_of_its_length():
    """A sensor's bias of 2 m/s shows the law a profile that is outside from the start on."""
    start = np.add(V0, -2.5 * np.arange(1.0, 6.0))
    system = robot_system(robot_state(start), faults=(Bias(agents=(2,), offset=-2.0),))
    told = certify(system, clock(0.002))
    assert told.to_dict()["division"]["start"] is None
    assert told.to_dict()["division"]["ends"] == "estimate_left_feasible_set"
    assert any("ends it as estimate_left_feasible_set" in each for each in told.not_certified)
    assert not any("at the start pieces finer" in each for each in told.not_certified)
    report = Simulation([system], clock(0.002, 0.01)).run().reports["robots"]
    assert report["status"] == "estimate_left_feasible_set"


# --------------------------------------------------------------- pieces of a step, as plain Python


def workspace_for_pieces(m, p):
    """Those arrays of a loop's that pieces are judged by."""
    return SimpleNamespace(
        y=np.zeros(m), g=np.zeros(p), u=np.zeros(m), commanded=np.zeros(m),
        division=numbers(division.Division), stages=fresh(division.Stages, m=m, p=p),
    )  # fmt: skip


@given(
    st.booleans(), st.lists(st.sampled_from(["fails", "leaves", "stands", "easy"]), max_size=300)
)
@settings(deadline=None)
def test_pieces_fill_their_steps_whatever_fails(guarded, outcomes):
    """Each begins to the bit where the one before ended, on the grid of its own length."""
    h, step = 0.007, 3
    problem = SimpleNamespace(settings=np.full(settings_of_laws.COUNT, float(guarded)))
    work, monitor = workspace_for_pieces(1, 1), watch.fresh(1, 1)
    divided, time = work.division, step * h
    for outcome in outcomes:
        length, level = division.piece(divided, h), divided.level
        assert division.begins(divided, step, h) == time
        assert divided.position % (division.UNITS * (length / h)) == 0
        assert length == h / 2**level
        assert level <= (division.FINEST if guarded else division.DEEPEST)
        if outcome in ("fails", "leaves"):
            if outcome == "leaves":
                watch.leave(monitor, watch.LEFT_SET, time, -1, 0, 1.0, 0)
            if division.halve(faultless, step, h, 0, problem, work, monitor):
                assert monitor.exit == watch.INSIDE
                continue
            own = outcome == "leaves" and level == division.DEEPEST
            assert monitor.exit == (watch.LEFT_SET if own else watch.STEP_TOO_SMALL)
            assert monitor.exit_time == time
            assert level >= division.FINEST
            return
        divided.easy = float(outcome == "easy")
        time = division.ends(divided, step, h)
        step += division.go_on(divided, h, monitor)
        assert time == pytest.approx(division.begins(divided, step, h), abs=0.0)
        assert monitor.divided <= step - 3


def test_pieces_to_tell_whose_exit_it_is_are_as_many_as_a_step_may_have():
    problem = SimpleNamespace(settings=np.zeros(settings_of_laws.COUNT))
    work, monitor = workspace_for_pieces(1, 1), watch.fresh(1, 1)
    work.division.level = division.FINEST
    stood = 0
    while True:
        watch.leave(monitor, watch.LEFT_SET, 0.0, -1, 0, 1.0, 0)
        if not division.halve(faultless, 0, 0.1, 0, problem, work, monitor):
            break
        division.go_on(work.division, 0.1, monitor)
        work.division.level = division.DEEPEST - 1
        stood += 1
    assert stood == division.PIECES
    assert monitor.exit == watch.STEP_TOO_SMALL


def test_a_slack_is_used_up_by_stages_too():
    """Three quarters at the second stage, none at the end; and twice as much at the third."""
    work = workspace_for_pieces(1, 2)
    problem = SimpleNamespace(
        data=SimpleNamespace(tightening=np.array([0.0, 0.5])),
        settings=np.zeros(settings_of_laws.COUNT),
    )
    stages = work.stages
    stages.g[:] = [-1.0, -1.5, -0.25, -1.5, -1.0, -2.5, -1.0, -1.5]  # stage by stage
    work.g[:] = [-1.0, -1.25]
    assert division.use_of(4, problem, work, stages, 0) == (0.75, 0.0)
    assert division.use_of(4, problem, work, stages, 1) == (0.25, 1.0)
    assert division.use_of(1, problem, work, stages, 0) == (0.0, 0.0)


def test_sizes_are_those_that_the_start_shows():
    """At least what is given; rounding and errors are measured by them."""
    work = workspace_for_pieces(3, 2)
    problem = SimpleNamespace(
        data=SimpleNamespace(tightening=np.array([0.0, 0.5])),
        size=np.array([1.0, 0.25, 4.0]),
        settings=np.zeros(settings_of_laws.COUNT),
    )
    for y in ([0.5, -7.0, 2.0], [90.0, 0.0, 0.0]):  # the start, and what comes later
        work.y[:], work.g[:] = y, [-3.0, -1.5]
        division.note(0, problem, work)
        assert list(work.stages.size) == [7.0, 3.0, 4.0]


def piece_of(rate, g, y, h):
    """What division.judge says of one Runge-Kutta piece of y' = rate(y) with constraints g."""
    y = np.asarray(y, dtype=float)
    m, p = len(y), len(g(y))
    work = workspace_for_pieces(m, p)
    data = SimpleNamespace(
        tightening=np.zeros(p), member_pointer=m * np.arange(p + 1),
        member_index=np.tile(np.arange(m), p), offsets=np.arange(m + 1),
    )  # fmt: skip
    problem = SimpleNamespace(
        data=data, size=np.ones(1 + p), settings=np.zeros(settings_of_laws.COUNT)
    )
    k, point = [], y
    for stage, part in enumerate((0.5, 0.5, 1.0, None)):
        work.y[:], work.g[:] = point, g(point)
        division.note(stage, problem, work)
        k.append(rate(point))
        if part is not None:
            point = y + part * h * k[-1]
    end = y + h / 6.0 * (k[0] + 2.0 * k[1] + 2.0 * k[2] + k[3])
    work.y[:], work.g[:] = end, g(end)
    return division.judge(4, h, problem, work), end


@given(
    st.floats(1e-6, 10.0), st.floats(1e-8, 1.0), st.floats(-3.0, 3.0), st.floats(-6.0, 1.0),
    st.floats(-3.0, 3.0),
)  # fmt: skip
@settings(deadline=None, max_examples=100)
def test_a_piece_that_stands_is_inside_and_accurate(rho, slack, force, length, drift):
    """s' = rho/s - force beside an output that moves freely, against an implicit method."""
    h = 10.0**length

    def rate(y):
        return np.array([rho / y[0] - force, drift])

    with np.errstate(all="ignore"):
        verdict, end = piece_of(rate, lambda y: -y[:1], [slack, 0.0], h)
    if verdict >= 0:
        return
    assert end[0] > 0.7 * slack
    exact = solve_ivp(
        lambda t, s: rho / s - force, (0.0, h), [slack], method="Radau", rtol=1e-11, atol=1e-300
    ).y[0, -1]
    assert abs(end[0] - exact) <= 3e-5 * exact + 1e-7


def test_a_stiff_pair_is_seen_among_many_that_move():
    """Outputs that move fast hide no pair that sways by little at a rate beyond the step's."""
    rates = np.array([-4000.0, -1.0])  # for h = 1 ms the first is unstable: z = 4

    def rate(y):
        return rates * (y - np.array([0.0, 5.0]))

    verdict, _ = piece_of(rate, lambda y: np.array([y[0] - 1e-4, y[1] - 9.0]), [1e-6, 0.0], 1e-3)
    assert verdict == 0
