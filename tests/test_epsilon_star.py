"""The certified epsilon*: its set and constants against samples, its W against runs by SciPy."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.linalg
from builders import clock, distributed, integrators, osnr_system, pi_cascades, robot_system
from scipy.integrate import solve_ivp

import reference
import reference_games
from gne_mj.changing_graph import switching
from gne_mj.controllers import FullyDistributed
from gne_mj.games import cournot_game, ten_channels, velocity_game
from gne_mj.graph import NAMED, complete, ring
from gne_mj.simulation import Simulation
from gne_mj.system import System
from gne_mj.theory import Theorem, certify
from gne_mj.theory.composite import Composite
from gne_mj.theory.epsilon_star import EpsilonBound
from gne_mj.theory.fast_errors import Lags
from gne_mj.theory.invariant_set import Forces, InvariantSet
from gne_mj.theory.linear_loop import linear_loop, why_not
from gne_mj.theory.relaxation import Cells, least_sum

EPSILON, K, RHO = 1.5e-4, 0.1, 0.1
CHANNELS = ten_channels()
GAMMA = np.array(CHANNELS["system_matrix"])
PRICE, WEIGHT, OWN, NOISE = (
    np.array(CHANNELS[name]) for name in ("price", "utility_weight", "gain", "noise_power")
)
LIMIT = CHANNELS["total_power_limit"]


def channels(epsilon=EPSILON):
    law = distributed(epsilon=epsilon, gain=K)
    return osnr_system(pi_cascades(10), law, 0.2, RHO, integrator="rosenbrock")


@cache
def examined():
    """The ten channels, their loop, and what is certain at EPSILON."""
    system = channels()
    loop = linear_loop(system)
    return system, loop, EpsilonBound(system).at(EPSILON)


def pushes(y, z, estimates):
    """u of all channels, written out; estimates (10, 10) with any diagonal."""
    known = estimates.copy()
    np.fill_diagonal(known, y)
    cost = PRICE - WEIGHT * OWN / (NOISE + np.sum(GAMMA * known, axis=1) + OWN * y)
    np.fill_diagonal(known, z)
    return -K * (cost + RHO / (LIMIT - known.sum(axis=1)) - RHO / z)


def w_of(y, s, z, estimates, weight=3.0):
    """W, with V = sum (e_y^2 + (e_y - e_s)^2)/2 of PI cascades with v = 1, k = 1/2."""
    rest = examined()[1].action
    slow = np.sum((y - rest) ** 2 + (y - rest - s + 2.0 * rest) ** 2)
    errors = estimates - y
    np.fill_diagonal(errors, z - y)
    return 0.5 * slow + 0.5 * weight * np.sum(errors**2)


def motion(laplacian, epsilon):
    """The closed loop's right side over (y, s, z, estimates), by itself."""

    def rate(_, x):
        y, s, z = x[:10], x[10:20], x[20:30]
        known = x[30:].reshape(10, 10).copy()
        np.fill_diagonal(known, y)
        u = pushes(y, z, known)
        spread = -(laplacian @ known) / epsilon
        np.fill_diagonal(spread, 0.0)
        return np.concatenate([-y + 0.5 * s + u, u, (y - z) / epsilon, spread.ravel()])

    return rate


def states(rng, count):
    """(y, s) of so many states with V <= level and all slacks above their floors."""
    _, loop, kept = examined()
    held, found = kept.held, []
    while len(found) < count:
        deviation = rng.normal(size=(2, 10))
        deviation *= np.sqrt(2.0 * held.level * rng.uniform() ** 0.1 / np.sum(deviation**2))
        y = loop.action + deviation[0]  # V = (e_y^2 + (e_y - e_s)^2)/2
        if np.all(loop.slack - loop.slopes @ deviation[0] > held.floor):
            found.append((y, 2.0 * loop.action + deviation[0] - deviation[1]))
    return found


def errors(rng, loop, epsilon):
    """Errors that motions at speeds of S leave: of one that has long moved at a state's speed."""
    ((y, s),) = states(rng, 1)
    speed = -y + 0.5 * s + pushes(y, y, np.tile(y, (10, 1)))
    return -epsilon * rng.uniform() * Lags(loop.graph).total * speed


def test_lags_are_those_of_the_grounded_consensus():
    graph = NAMED["printed"](10)
    lags, times = Lags(graph), np.linspace(0.0, 40.0, 4001)
    for j in (0, 6):
        rest = np.arange(10) != j
        step = scipy.linalg.expm(-graph.laplacian[np.ix_(rest, rest)] * times[1])
        kernel, sums = np.ones(9), np.zeros(9)
        for _ in times[1:]:
            following = step @ kernel
            sums += 0.5 * times[1] * (kernel + following)
            kernel = following
        np.testing.assert_allclose(lags.total[rest, j], sums, rtol=1e-4)
    np.testing.assert_array_equal(np.diag(lags.total), 1.0)
    everyone = lags.of_greatest(np.arange(10))
    assert np.all(everyone >= lags.total.max(axis=1))
    assert np.all(everyone <= lags.total.sum(axis=1))
    alone = lags.of_greatest(np.array([3]))
    np.testing.assert_allclose(alone, lags.total[:, 3], rtol=0.03)
    assert np.all(alone >= lags.total[:, 3])


def test_two_agents_lag_by_one_time_constant():
    lags = Lags(complete(2))
    np.testing.assert_allclose(lags.total, 1.0)
    assert 1.0 <= lags.of_greatest(np.array([0, 1]))[0] < 1.02


def test_least_sums_are_below_all_samples():
    rng = np.random.default_rng(1)
    room, inverse, others = 0.3, np.array([1.0, 0.5, 2.0]), np.array([0.2, 0.0, 0.1])
    radius, slope = np.sqrt(room * inverse), np.array([1.0, -2.0, 0.7])
    edges = np.linspace(-radius, radius, 65)
    cells = Cells(edges[:-1], edges[1:], inverse, others, room)
    values = np.minimum(np.sin(5.0 * edges[:-1]), np.sin(5.0 * edges[1:])) - 0.05
    most, least = np.inf, np.inf
    for _ in range(4000):
        e, r = rng.normal(size=(2, 3))
        r *= np.sqrt(others)
        size = np.sum(e**2 / inverse) + np.sum(r[others > 0] ** 2 / others[others > 0])
        share = np.sqrt(room / size) * rng.uniform() ** 0.2
        e, r = e * share, r * share
        total = np.sum(np.sin(5.0 * e) - np.abs(slope * r))
        least = min(least, total if slope @ e <= 0.1 else np.inf)
        most = min(most, total)
    bound = least_sum(values, cells, slope, 0.1, equality=False)
    assert most - 0.5 < bound <= least


def test_the_set_bounds_what_samples_show():
    rng = np.random.default_rng(2)
    _, loop, kept = examined()
    held, epsilon = kept.held, kept.epsilon
    forces = Forces(loop, held)
    speeds = forces.speeds
    for y, s in states(rng, 200):
        off = errors(rng, loop, epsilon)
        assert np.all((off >= -held.behind) & (off <= held.ahead))
        assert np.all((y >= held.lower) & (y <= held.upper))
        slack = np.append(y, LIMIT - y.sum())
        assert np.all(slack <= held.ceiling)
        taken = np.hstack([(y + np.diag(off))[:, None], (LIMIT - (y + off).sum(axis=1))[:, None]])
        own = np.arange(10)
        for agent in range(10):
            for which in (agent, 10):
                seen = taken[agent, 0 if which == agent else 1]
                assert seen >= slack[which] - held.short[which, agent]
                assert seen <= slack[which] + held.over[which, agent]
        speed = -y + 0.5 * s + pushes(y, y + np.diag(off), y + off)
        assert np.all((speed <= speeds.up) & (-speed <= speeds.down))
        assert np.sum(np.maximum(speed, 0.0)) <= speeds.closing[10]
        assert np.sum(np.maximum(-speed, 0.0)) <= speeds.opening[10]
        assert np.all(np.maximum(-speed, 0.0)[own] <= speeds.closing[own])


def test_slacks_rise_at_their_floors():
    rng = np.random.default_rng(3)
    _, loop, kept = examined()
    floor, tried = kept.held.floor, 0
    for y, s in states(rng, 300):
        for which in (*rng.choice(10, 2), 10):
            moved = y.copy()
            if which < 10:
                moved[which] = floor[which]
            else:
                moved += (LIMIT - floor[10] - y.sum()) / 10.0
            deviation = moved - loop.action, s - 2.0 * loop.action
            storage = 0.5 * np.sum(deviation[0] ** 2 + (deviation[0] - deviation[1]) ** 2)
            slack = np.append(moved, LIMIT - moved.sum())
            if storage > kept.held.level or np.any(slack < floor - 1e-12):
                continue
            off = errors(rng, loop, kept.epsilon)
            speed = -moved + 0.5 * s + pushes(moved, moved + np.diag(off), moved + off)
            assert (speed[which] if which < 10 else -speed.sum()) > 0.0
            tried += 1
    assert tried > 100


def test_w_falls_at_sampled_states_as_the_form_says():
    rng = np.random.default_rng(4)
    system, loop, kept = examined()
    composite = Composite(loop, Lags(loop.graph), kept.held, 3.0)
    form, laplacian = composite.form(1.0), system.law.graph.laplacian
    for y, s in states(rng, 100):
        off = errors(rng, loop, kept.epsilon)
        known = y + off
        rate = motion(laplacian, kept.epsilon)(
            0.0, np.concatenate([y, s, np.diag(known), known.ravel()])
        )
        y_rate, s_rate, z_rate = rate[:10], rate[10:20], rate[20:30]
        off_rate = rate[30:].reshape(10, 10) - y_rate
        np.fill_diagonal(off_rate, z_rate - y_rate)
        e_y, e_s = y - loop.action, s - 2.0 * loop.action
        fall = -(e_y @ y_rate + (e_y - e_s) @ (y_rate - s_rate) + 3.0 * np.sum(off * off_rate))
        x = np.concatenate([np.column_stack([e_y, e_s]).ravel(), off.ravel()])
        spread = 3.0 / kept.epsilon * x[20:] @ composite._fast @ x[20:]
        assert fall > 0.0
        assert fall >= x @ form @ x + spread - 1e-12


@pytest.mark.parametrize("seed", [5, 6])
def test_w_falls_along_motions_from_random_starts_of_the_set(seed):
    system, _, kept = examined()
    ((y, s),) = states(np.random.default_rng(seed), 1)
    start = np.concatenate([y, s, y, np.tile(y, 10)])
    rate = motion(system.law.graph.laplacian, kept.epsilon)
    found = solve_ivp(rate, (0.0, 2.0), start, "BDF", rtol=1e-7, atol=1e-10)
    assert found.success
    w = np.array([
        w_of(x[:10], x[10:20], x[20:30], x[30:].reshape(10, 10)) for x in found.y.T
    ])  # fmt: skip
    assert w[0] <= kept.held.level
    assert np.all(np.diff(w) < 1e-9)
    assert w[-1] < w[0]
    total = found.y[:10].sum(axis=0)
    assert np.all(LIMIT - total > kept.held.floor[10])
    assert np.all(found.y[:10] > kept.held.floor[:10, None])


def test_two_integrators_have_the_closed_form():
    """Without constraints the two modes are apart: u = -k (J e + b xi), J = a + s b, s = 1 or -1,
    xi' = -xi/epsilon - s u and zeta' = -zeta/epsilon - u, where F = (a, b; b, a) y."""
    game = cournot_game(2, [1.0, 1.0], 60.0, 0.0, 50.0)
    k, omega = 0.7, 2.0
    law = FullyDistributed(complete(2), 0.01, k, fast_weight=omega)
    system = System("firms", game, integrators(2), law, 1e-3, np.array([[1.0], [2.0]]))
    loop = linear_loop(system)
    (a, b), _ = game.pseudo_gradient_jacobian(loop.action)
    loop = replace(loop, slopes=np.zeros((0, 2)), slack=np.zeros(0))
    none, nobody, zero = np.zeros(0), np.zeros((0, 2)), np.zeros((2, 2))
    held = InvariantSet(1.0, none, none, nobody, nobody, zero, zero, *(loop.action,) * 2)
    needed = 0.0
    for sign in (1.0, -1.0):
        slope = a + sign * b
        xi, zeta = 0.5 * k * (b - omega * sign * slope), -0.5 * k * omega * slope
        first = xi * xi / (k * slope) + k * b * omega * sign
        second, cross = zeta * zeta / (k * slope), xi * zeta / (k * slope) + 0.5 * k * b * omega
        root = np.sqrt((first - second) ** 2 + 4.0 * cross**2)
        needed = max(needed, 0.5 * (first + second + root))
    found = Composite(loop, Lags(complete(2)), held, omega).largest_epsilon()
    assert found == pytest.approx(omega / needed, rel=1e-6)


def test_the_shipped_game_is_certified_within_two_orders_of_what_trials_find():
    star = EpsilonBound(channels()).star
    assert 1.5e-4 < star.epsilon < 0.0119
    assert star.falls_below > star.epsilon


def velocities(epsilon, away, way=(1.0, -1.0, 0.5)):
    """Integrators in the velocity game, so far from y* = 3 some way."""
    start = 3.0 + away * np.array(way)[:, None]
    law = FullyDistributed(ring(3), epsilon)
    return System("agents", velocity_game(3, 3.0, [2.0, 3.0, 2.5]), integrators(3), law, RHO, start)


def test_bounds_on_gaps_are_taken_as_affine_ones():
    system = velocities(1e-3, 0.3)
    loop = linear_loop(system)
    ones = np.eye(3) - np.eye(3, k=-1)
    gaps, delta = ones @ system.start - [3.0, 0.0, 0.0], np.array([2.0, 3.0, 2.5])
    signs = np.sign(loop.slopes[:3] @ [0.3, 0.2, 0.1]) * np.sign(ones @ [0.3, 0.2, 0.1])
    found = signs[:, None] * loop.slopes[:3]
    assert np.allclose(found, ones, atol=1e-12)
    assert np.allclose(loop.slopes[3:], -loop.slopes[:3], atol=1e-12)
    assert np.allclose(loop.slack, np.tile(delta, 2), atol=1e-12)  # no gap at y*
    assert np.allclose(loop.start_slack[:3], delta - signs * gaps, atol=1e-12)
    assert np.allclose(loop.start_slack[3:], delta + signs * gaps, atol=1e-12)


def test_the_velocity_games_epsilon_against_scipy():
    star = EpsilonBound(velocities(1e-3, 0.3)).star
    system, graph = velocities(star.epsilon, 0.3), ring(3).laplacian
    assert Theorem(system).lyapunov
    game = reference_games.VelocityGame(3.0, [2.0, 3.0, 2.5])

    def rate(_, x):
        y, z, estimates = x[:3], x[3:6], x[6:].reshape(3, 3)
        return np.concatenate(
            [part.ravel() for part in reference.fully_distributed(
                game, RHO, graph, 1.0, star.epsilon, y, z, estimates)]
        )  # fmt: skip

    start = np.concatenate([system.start, system.start, np.tile(system.start, 3)])
    found = solve_ivp(rate, (0.0, 4.0), start, "BDF", rtol=1e-8, atol=1e-11)
    assert found.success
    y, off = found.y[:3], found.y[6:].reshape(3, 3, -1) - found.y[:3]
    off[np.arange(3), np.arange(3)] = found.y[3:6] - y
    w = 0.5 * np.sum((y - 3.0) ** 2, axis=0) + 0.5 * 3.0 * np.sum(off**2, axis=(0, 1))
    assert w[0] == pytest.approx(star.held.level, rel=1e-6)
    assert np.all(np.diff(w) < 1e-9)
    gaps = np.abs(np.diff(y, axis=0, prepend=3.0))
    floor = np.minimum(star.held.floor[:3], star.held.floor[3:])
    assert np.all(np.array([[2.0], [3.0], [2.5]]) - gaps > floor[:, None])


@pytest.mark.slow
def test_a_far_start_has_no_set_and_says_so_at_once():
    bound = EpsilonBound(velocities(1e-3, 1.9, (1.0, 2.0, 3.0)))
    assert bound.star is None
    assert set(bound._tried) == {1e-3, 1e-12}


def test_a_certified_epsilon_is_told_and_w_is_claimed():
    system = channels()
    found = certify(system, clock(0.002, 1.0))
    assert found.status == "certified"
    assert found.lyapunov_claimed
    assert found.epsilon["star"] >= EPSILON
    assert "epsilon* =" in str(found)
    assert "certified, sufficient" in str(found)
    assert any("never rises" in sentence for sentence in found.guaranteed)
    trajectory = Simulation([system], clock(0.002, 1.0, sample=0.05)).run()
    report = trajectory.reports["channels"]
    assert report["lyapunov"]["claimed"]
    assert report["lyapunov"]["monotone"]
    rest = system.agents.equilibrium(system.centre)
    assert report["lyapunov"]["start"] == pytest.approx(
        np.sum(system.agents.storage(system.state, rest))
    )


def test_a_greater_epsilon_is_not_certified():
    theorem = Theorem(channels(0.01))
    assert theorem.status == "certified for small epsilon"
    assert not theorem.lyapunov


def test_the_start_of_the_estimates_counts():
    """Estimates that start elsewhere add to W and to the errors, or there is no set."""
    system = channels()
    off = system.memory.copy()
    off[1] += 1e-5
    near = EpsilonBound(replace(system, memory=off)).at(1e-5)
    still = EpsilonBound(system).at(1e-5)
    assert near.held.level == pytest.approx(still.held.level + 1.5e-10, rel=1e-12)
    assert near.held.ahead[0, 1] >= still.held.ahead[0, 1] + 0.9e-5
    far = system.memory.copy()
    far[:100] += 0.02
    assert EpsilonBound(replace(system, memory=far)).at(1e-5) is None


def test_what_speaks_against_a_bound():
    robots = robot_system(
        np.tile([0.0, 3.0, 3.0, 0.0], (5, 1)), law=FullyDistributed(complete(5), 0.01)
    )
    why = "flexible robots are not linear with a known quadratic V that decays in all states"
    assert why_not(robots) == why
    told = certify(robots, clock(0.002, 1.0))
    assert "the theorem does not apply: [asmp:OSSPassive]" in told.epsilon["no_star"]
    assert why_not(channels()) is None
    law = FullyDistributed(switching([ring(10), complete(10)], 1.0), EPSILON, K)
    assert why_not(replace(channels(), law=law, integrator="rk4")) == "the graph changes"
