"""What the theory module claims, against brute force, closed forms and simulated motions."""

import json
from dataclasses import replace

import coupled_game
import numpy as np
import pytest
import scipy.linalg
from builders import (
    EQUAL,
    FIVE,
    UNEQUAL,
    V0,
    clock,
    distributed,
    integrators,
    osnr_system,
    pi_cascades,
    robot_state,
    robot_system,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

import reference
import reference_games
from gne_mj import graph as graphs
from gne_mj.cli import app
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.game_model import Game
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.plants import flexible_robot, integrator, mixed, pi_cascade, position_robot
from gne_mj.system import System
from gne_mj.theory import Slopes, Theorem, certify, report_text, search_epsilon
from gne_mj.theory.constants import profiles
from gne_mj.theory.coupling import coupling, least_coupling, needed_connectivity
from gne_mj.theory.gain import decay_rate, least_beta, required_gain
from gne_mj.theory.periods import linear_period, push_period

STEP = clock(0.002)


def chain_slopes(agents):
    game = velocity_game(agents, V0, 3.0)
    return Slopes(game, game.box, np.full(agents, V0), feasible=True)


def osnr_slopes(game=None, box=None):
    game = game or osnr_game(**ten_channels())
    box = game.box if box is None else box
    return Slopes(game, box, np.full(game.actions, 0.1), feasible=False)


def partial_robots(gain, graph="ring", **options):
    law = PartialInformation(graphs.NAMED[graph](5), gain)
    return robot_system(robot_state(FIVE), law=law, **options)


def osnr(law, agents=None, **options):
    return osnr_system(agents or pi_cascades(10), law, 0.2, **options)


@st.composite
def small_osnr(draw):
    """A game of two to four channels and a box of powers."""
    n = draw(st.integers(2, 4))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    game = osnr_game(
        rng.uniform(0.5, 2, n), rng.uniform(0.5, 2, n), rng.uniform(0.3, 2, n),
        rng.uniform(0.05, 0.5, n), rng.uniform(0, 0.1, (n, n)), rng.uniform(0.5, 3),
    )  # fmt: skip
    return game, (np.zeros(n), rng.uniform(0.2, 3, n)), rng


@st.composite
def monotone_slopes(draw):
    """A random dF/dy with positive definite symmetric part, and whose action each is."""
    agents = draw(st.integers(2, 5))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    owner = np.repeat(np.arange(agents), rng.integers(1, 3, agents))
    m = len(owner)
    slope = rng.normal(size=(m, m))
    least = np.linalg.eigvalsh(0.5 * (slope + slope.T))[0]
    return slope + (rng.uniform(0.05, 1.0) - least) * np.eye(m), owner, agents, rng


def random_graph(agents, rng):
    """A random connected graph: a tree and some more edges."""
    tree = [(int(rng.integers(0, i)), i) for i in range(1, agents)]
    more = [tuple(map(int, rng.choice(agents, 2, replace=False))) for _ in range(agents // 2)]
    return graphs.Graph(agents, (*tree, *more))


def quadratic_form(slope, owner, graph, gain):
    """c L (x) I + sum_i e^i_i' J_i e^i, symmetric, written entry by entry: (N m, N m)."""
    agents, m = graph.agents, len(owner)
    form = np.zeros((agents * m, agents * m))
    for i in range(agents):
        for j in range(agents):
            for r in range(m):
                form[i * m + r, j * m + r] += gain * graph.laplacian[i, j]
    for r in range(m):
        i = owner[r]
        form[i * m + r, i * m : (i + 1) * m] += slope[r]
    return 0.5 * (form + form.T)


# ---------------------------------------------------------------------------------- constants


@pytest.mark.parametrize("agents", [2, 5, 9])
def test_the_chain_has_closed_forms(agents):
    slopes = chain_slopes(agents)
    assert slopes.mu.value == pytest.approx(2 - 2 * np.cos(np.pi / (agents + 1)), rel=1e-12)
    assert slopes.theta_1.value == pytest.approx(4 * np.cos(np.pi / (2 * agents + 1)), rel=1e-12)
    assert slopes.theta_2.value == pytest.approx(np.sqrt(8), rel=1e-12)
    assert {slopes.mu.label, slopes.theta_1.label, slopes.theta_2.label} == {"exact"}


def test_the_papers_five_robots():
    slopes = chain_slopes(5)
    expected = reference.affine_constants(
        reference.pseudo_gradient_jacobian(reference_games.VelocityGame(V0, np.full(5, 3.0)), FIVE)
    )
    values = slopes.mu.value, slopes.theta_1.value, slopes.theta_2.value
    np.testing.assert_allclose(values, expected, rtol=1e-12)
    np.testing.assert_allclose(values, [0.267949, 3.837972, 2.828427], rtol=1e-6)
    # No unweighted graph of five has lambda_2 above 5.
    printed, rigorous = needed_connectivity(slopes)
    assert 5 < printed < rigorous


@given(small_osnr())
def test_osnr_bounds_hold_the_jacobian_everywhere_in_the_box(drawn):
    game, box, rng = drawn
    lower, upper = game.jacobian_bounds(box)
    corners = (box[0], box[1])
    for y in (*corners, *rng.uniform(box[0], box[1], (20, game.actions))):
        slope = game.pseudo_gradient_jacobian(y)
        assert np.all(slope >= lower - 1e-12 * np.abs(lower))
        assert np.all(slope <= upper + 1e-12 * np.abs(upper))
    # Attained: everybody receives least at one corner and most at the other.
    np.testing.assert_allclose(game.pseudo_gradient_jacobian(box[0]), upper, rtol=1e-12)
    np.testing.assert_allclose(game.pseudo_gradient_jacobian(box[1]), lower, rtol=1e-12)


@settings(max_examples=25)
@given(small_osnr())
def test_bounded_constants_bound_all_pairs_of_profiles(drawn):
    game, box, rng = drawn
    slopes = osnr_slopes(game, box)
    assert slopes.label == "bounded"
    n = game.actions
    for _ in range(20):
        y, other = rng.uniform(box[0], box[1], (2, n))
        change, distance = game.pseudo_gradient(y) - game.pseudo_gradient(other), y - other
        assert change @ distance >= slopes.mu.value * (distance @ distance) - 1e-9
        assert np.linalg.norm(change) <= slopes.theta_1.value * np.linalg.norm(distance) + 1e-9
        own, others = rng.uniform(box[0], box[1], (2, n, n))  # a profile for each agent
        extended = np.diag(game.pseudo_gradient(own) - game.pseudo_gradient(others))
        apart = np.linalg.norm(own - others)
        assert np.linalg.norm(extended) <= slopes.theta_2.value * apart + 1e-9


def test_osnr_is_certified_where_bounds_of_the_entries_are_too_coarse():
    fine = osnr_slopes()
    coarse = osnr_slopes(replace(fine.game, row_scaled=False))
    assert fine.monotone
    assert fine.mu.value == pytest.approx(0.128076, rel=1e-5)
    feasible = replace(fine, feasible=True)  # the total power is known there
    assert feasible.mu.value == pytest.approx(0.146434, rel=1e-5)
    assert fine.mu.sampled > fine.mu.value
    assert coarse.label == "bounded"
    assert coarse.mu.value < 0 < coarse.mu.sampled
    assert not coarse.monotone
    assert not coarse.refuted
    assert coarse.theta_1.value >= fine.theta_1.value * (1 - 1e-12)
    assert coarse.theta_2.value >= fine.theta_2.value * (1 - 1e-12)


@given(st.integers(0, 2**32 - 1))
def test_bounds_of_the_entries_alone(seed):
    rng = np.random.default_rng(seed)
    exact = chain_slopes(4)
    center = exact.game.pseudo_gradient_jacobian(exact.center)
    radius = rng.uniform(0, 0.1, center.shape)
    game = replace(
        exact.game, affine=False, jacobian_bounds=lambda box: (center - radius, center + radius)
    )
    slopes = Slopes(game, game.box, exact.center, feasible=True)
    for _ in range(20):
        slope = center + rng.uniform(-1, 1, center.shape) * radius
        mu, theta_1, theta_2 = reference.affine_constants(slope)
        assert slopes.mu.value <= mu + 1e-12
        assert slopes.theta_1.value >= theta_1 - 1e-12
        assert slopes.theta_2.value >= theta_2 - 1e-12
    assert slopes.mu.value >= exact.mu.value - np.linalg.norm(radius, 2) - 1e-12


def test_sampled_constants_are_never_certified():
    game = replace(osnr_game(**ten_channels()), jacobian_bounds=None)
    slopes = osnr_slopes(game)
    assert slopes.mu.label == slopes.theta_1.label == slopes.theta_2.label == "sampled"
    assert slopes.mu.value > 0
    assert not slopes.mu.certified
    assert not slopes.monotone


def test_a_game_that_is_not_affine_is_not_believed():
    game = replace(osnr_game(**ten_channels()), affine=True, jacobian_bounds=None)
    assert osnr_slopes(game).label == "sampled"


def test_no_bounds_where_received_powers_need_not_be_positive():
    game = osnr_game(**ten_channels())
    slopes = osnr_slopes(box=(np.full(10, -1.0), game.box[1]))
    assert slopes.label == "sampled"
    assert not slopes.monotone


def test_sampled_profiles_are_where_they_should_be():
    game = osnr_game(**ten_channels())
    center = np.full(10, 0.2)
    inside = profiles(game, center, game.box, 50, feasible=True)
    assert np.all(game.constraints(inside) < 0)
    assert np.min(-game.constraints(inside)) < 1e-9  # some on the boundary, up to rounding
    everywhere = profiles(game, center, game.box, 50, feasible=False)
    assert np.all((everywhere >= game.box[0]) & (everywhere <= game.box[1]))
    assert np.any(game.constraints(everywhere) > 0)
    boundless = profiles(game, center, None, 50, feasible=True)
    assert np.all(game.constraints(boundless) < 0)
    assert np.ptp(boundless) > 0.1


# ----------------------------------------------------------------------------------- coupling


@given(monotone_slopes())
def test_the_quadratic_form_is_positive_definite_above_the_least_gain_only(drawn):
    slope, owner, agents, rng = drawn
    graph = random_graph(agents, rng)
    least = least_coupling(slope, graph, owner)
    above = quadratic_form(slope, owner, graph, 1.001 * least + 1e-6)
    assert np.linalg.eigvalsh(above)[0] > 0
    if least > 1e-6:
        below = quadratic_form(slope, owner, graph, 0.999 * least)
        assert np.linalg.eigvalsh(below)[0] < 0


@given(monotone_slopes())
def test_the_rigorous_condition_implies_the_quadratic_form(drawn):
    slope, owner, agents, rng = drawn
    graph = random_graph(agents, rng)
    rows = [np.linalg.norm(slope[owner == i], 2) for i in range(agents)]
    mu = np.linalg.eigvalsh(0.5 * (slope + slope.T))[0]
    theta_1, theta_2 = np.linalg.norm(slope, 2), max(rows)
    rigorous = ((theta_1 + theta_2) ** 2 / (4 * mu) + theta_2) / graph.algebraic_connectivity
    assert least_coupling(slope, graph, owner) <= rigorous * (1 + 1e-9)


def test_without_strong_monotonicity_no_gain_suffices():
    slope = np.array([[1.0, 3.0], [0.0, 1.0]])
    assert least_coupling(slope, graphs.line(2), np.arange(2)) == np.inf


def test_the_printed_condition_is_no_proof():
    """Eight agents on the complete graph: it holds, and V rises in some direction."""
    upper = np.triu(np.ones((8, 8)), 1)
    slope = 0.01 * np.eye(8) + upper - upper.T
    mu, _, theta_2 = reference.affine_constants(slope)
    graph = graphs.complete(8)
    gain = 95.0
    assert mu * (gain * graph.algebraic_connectivity - theta_2) > theta_2**2
    assert np.linalg.eigvalsh(quadratic_form(slope, np.arange(8), graph, gain))[0] < 0
    assert least_coupling(slope, graph, np.arange(8)) == pytest.approx(100.86, rel=1e-4)


def test_a_large_quadratic_form_is_found_by_iteration():
    """24 agents: 552 unknowns; the greatest of all generalised eigenvalues, densely."""
    slope = chain_slopes(24).game.pseudo_gradient_jacobian(np.full(24, V0))
    graph = graphs.ring(24)
    least = least_coupling(slope, graph, np.arange(24))
    # c A + B is singular at the least gain: A = L (x) I and B the form at c = 0
    form = quadratic_form(slope, np.arange(24), graph, 0.0)
    added = quadratic_form(0 * slope, np.arange(24), graph, 1.0)
    assert np.linalg.eigvalsh(least * (1 + 1e-6) * added + form)[0] > 0
    assert np.linalg.eigvalsh(least * (1 - 1e-6) * added + form)[0] < 0


class LinearGame:
    """The velocity game's F with a far boundary, for reference.partial_information."""

    def __init__(self, slope):
        self.slope, self.N, self.p = slope, len(slope), 1

    def partial_gradient(self, i, y):
        return self.slope[i] @ y

    def constraint(self, l, y):  # noqa: E741
        return -1.0

    def constraint_gradient(self, l, y):  # noqa: E741
        return np.zeros(self.N)


@given(monotone_slopes(), st.floats(0.1, 10))
def test_the_law_lets_v_rise_below_the_least_gain_and_never_above(drawn, tau):
    """dV/dt of integrators under the slow reference law, y* = 0, along chosen directions."""
    slope, _, agents, rng = drawn
    slope = slope[:agents, :agents]
    graph = random_graph(agents, rng)
    laplacian, game = np.asarray(graph.laplacian), LinearGame(slope)
    least = least_coupling(slope, graph, np.arange(agents))

    def fall(gain, e):
        rows = e.reshape(agents, agents)
        y = np.diag(rows)
        u, rates = reference.partial_information(game, 1e-9, laplacian, gain, tau, y, rows)
        return -(y @ u + tau * np.sum(reference.without_own_entries(rows) * rates))

    for e in rng.normal(size=(20, agents * agents)):
        assert fall(1.001 * least + 1e-6, e) > 0
    if least > 1e-6:
        form = quadratic_form(slope, np.arange(agents), graph, 0.99 * least)
        assert fall(0.99 * least, np.linalg.eigh(form)[1][:, 0]) < 0


def test_the_robots_coupling_conditions():
    found = coupling(chain_slopes(5), graphs.ring(5), 3.0)
    form = chain_slopes(5).game.pseudo_gradient_jacobian(FIVE)
    assert found.quadratic.least == least_coupling(form, graphs.ring(5), np.arange(5))
    assert found.quadratic.least < found.printed.least < found.rigorous.least
    assert found.quadratic.holds
    assert found.quadratic.certified
    assert not found.rigorous.holds
    assert found.certified
    assert not coupling(chain_slopes(5), graphs.ring(5), 2.7).certified
    # printed alone never certifies
    middle = 0.5 * (found.printed.least + found.rigorous.least)
    beyond = replace(coupling(chain_slopes(5), graphs.ring(5), middle), quadratic=None)
    assert beyond.printed.holds
    assert not beyond.certified


def test_bounded_coupling_of_osnr_is_enough_for_the_worst_end():
    small = osnr_game([1, 1.2], [1, 1.1], [0.5, 0.6], [0.1, 0.2], [[0, 0.02], [0.03, 0]], 1.0)
    slopes = osnr_slopes(small, small.box)
    graph = graphs.line(2)
    found = coupling(slopes, graph, 100.0)
    assert found.label == "bounded"
    lower, upper = small.jacobian_bounds(small.box)
    worst = 0.0
    for first in np.linspace(0, 1, 11):
        for second in np.linspace(0, 1, 11):
            slope = lower + np.array([[first], [second]]) * (upper - lower)
            worst = max(worst, least_coupling(slope, graph, np.arange(2)))
    assert worst * (1 - 1e-9) <= found.quadratic.least <= 1.25 * worst
    assert found.quadratic.least < found.rigorous.least


@pytest.mark.slow
@pytest.mark.parametrize("above", [True, False])
def test_measured_v_agrees_with_the_certificate(above):
    """Integrators near y*, the boundary far: V falls along the run if and only if it must."""
    game = velocity_game(5, V0, 3.0)
    slope = game.pseudo_gradient_jacobian(FIVE)
    graph = graphs.ring(5)
    least = least_coupling(slope, graph, np.arange(5))
    gain = (1.01 if above else 0.9) * least
    form = quadratic_form(slope, np.arange(5), graph, gain)
    e = 1e-3 * np.linalg.eigh(form)[1][:, 0].reshape(5, 5)
    system = System(
        "integrators", game, integrators(5), PartialInformation(graph, gain), 1e-9,
        (V0 + np.diag(e))[:, None], memory=(V0 + e).ravel(),
    )  # fmt: skip
    loop = system.closed_loop(clock(0.002, 1.0))
    loop.advance(1, 500)
    loop.finish()
    monitor = loop.monitor
    assert Theorem(system).lyapunov is above
    rounding = 1e-12 * monitor.storage_start
    if above:
        assert monitor.storage_rise <= rounding
        assert monitor.storage < monitor.storage_start
    else:
        assert monitor.storage_rise > 1e6 * rounding


@given(st.integers(0, 2**32 - 1), st.floats(0.2, 2.0))
def test_certified_runs_stay_inside_and_v_never_rises(seed, tau):
    """Integrators on a random graph, from random starts with estimates inside and outside."""
    rng = np.random.default_rng(seed)
    agents = int(rng.integers(2, 7))
    game = velocity_game(agents, V0, rng.uniform(0.5, 3.0, agents))
    graph = random_graph(agents, rng)
    least = least_coupling(
        game.pseudo_gradient_jacobian(np.zeros(agents)), graph, np.arange(agents)
    )
    law = PartialInformation(graph, 1.05 * least, tau)
    y = V0 + np.cumsum(rng.uniform(-0.9, 0.9, agents) * game.gap_bounds)
    memory = (y + rng.normal(size=(agents, agents))).ravel()
    system = System("s", game, integrators(agents), law, 0.1, y[:, None], memory=memory)
    assert Theorem(system).lyapunov
    loop = system.closed_loop(clock(2e-4, 0.4))
    loop.advance(1, 2000)
    loop.finish()
    monitor = loop.monitor
    assert monitor.exit == watch.INSIDE
    assert monitor.storage_rise <= 1e-9 * monitor.storage_start


# --------------------------------------------------------------------------------------- gain


@st.composite
def channels(draw):
    """An agent type, one channel's parameters, and two states and an input."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    kind = draw(st.sampled_from([integrator, pi_cascade, flexible_robot, position_robot]))
    numbers = {
        integrator: lambda: np.zeros(0),
        pi_cascade: lambda: np.sort(rng.uniform(0.1, 3, 2))[::-1],
        flexible_robot: lambda: rng.uniform(0.1, 3, 5),
        position_robot: lambda: rng.uniform(0.3, 3, 8),
    }[kind]()
    return kind, numbers, rng.normal(size=len(kind.STATES)), rng.normal(size=2)


@given(channels())
def test_energy_balances_against_the_kernels(drawn):
    kind, q, x, (y, u) = drawn
    rest, rate = np.zeros(len(x)), np.zeros(len(x))
    kind.equilibrium(q, y, rest)
    kind.rate(q, x, u, rate)
    h = 1e-5
    storage_rate = (kind.storage(q, x + h * rate, rest) - kind.storage(q, x - h * rate, rest)) / (
        2 * h
    )
    storage, dissipation = (part[0] for part in kind.energy_balance(q[None]))
    e = (x - rest)[: len(storage)]
    balance = e[kind.OUTPUT] * u - e @ dissipation @ e
    assert storage_rate == pytest.approx(balance, rel=1e-6, abs=1e-6)
    bound = 0.5 * e @ storage @ e
    assert kind.storage(q, x, rest) <= bound * (1 + 1e-12)
    if kind not in (flexible_robot, position_robot):
        assert kind.storage(q, x, rest) == pytest.approx(bound, rel=1e-9, abs=1e-12)


def test_the_papers_pi_cascade():
    storage, dissipation = pi_cascade.energy_balance(np.array([[1.0, 0.5]]))
    np.testing.assert_allclose(storage[0], [[2, -1], [-1, 1]], rtol=1e-14)
    np.testing.assert_allclose(dissipation[0], [[2, -1], [-1, 0.5]], rtol=1e-14)


def test_the_least_beta():
    assert np.array_equal(least_beta(integrator.energy_balance(np.zeros((3, 0)))[1], 0), [0, 0, 0])
    assert least_beta(pi_cascade.energy_balance(np.array([[2.0, 0.3]]))[1], 0) == 0
    robot = flexible_robot.energy_balance(np.ones((1, 5)))[1]
    assert least_beta(robot, flexible_robot.OUTPUT) == np.inf
    assert least_beta(np.array([[[-0.3]]]), 0) == pytest.approx(0.3)
    short = np.array([[[0.1, 0.5], [0.5, 1.0]]])  # 0.1 + beta > 0.25
    assert least_beta(short, 0) == pytest.approx(0.15)


@given(monotone_slopes(), st.floats(0.05, 20))
def test_the_reduced_system_decays_at_least_at_the_rate_claimed(drawn, gain):
    """PI cascades, F linear: V along exact motions of x' = Ax - k G F(Cx)."""
    slope, _, agents, rng = drawn
    slope = slope[:agents, :agents]
    mu = np.linalg.eigvalsh(0.5 * (slope + slope.T))[0]
    v, k = 1.0, 0.5
    found = required_gain(pi_cascades(agents, v, k), mu, gain)
    assert found.least == 0
    eye, none = np.eye(agents), np.zeros((agents, agents))
    matrix = np.block([[-v * eye, k * eye], [none, none]])
    matrix -= gain * np.block([[slope, none], [slope, none]])
    storage = np.block([[2 * eye, -eye], [-eye, eye]])
    for time in (0.1, 1.0, 10.0):
        for x in rng.normal(size=(3, 2 * agents)):
            later = scipy.linalg.expm(time * matrix) @ x
            bound = np.exp(-found.decay_rate * time) * (x @ storage @ x)
            assert later @ storage @ later <= bound * (1 + 1e-9)


def test_integrators_decay_at_twice_k_mu():
    found = required_gain(integrators(3), 0.4, 0.7)
    assert (found.least, found.beta) == (0.0, 0.0)
    assert found.decay_rate == pytest.approx(2 * 0.7 * 0.4)
    assert found.alpha == pytest.approx(0.7 * 0.4)
    storage, dissipation = integrator.energy_balance(np.zeros((1, 0)))
    for k, rate in found.rates:
        assert rate == decay_rate(storage, dissipation, 0, 0.4 * k)


def test_fleets_in_which_one_type_fails():
    robots = robot_system(robot_state(FIVE)).agents
    fleet = mixed.join([robots, pi_cascades(2), integrators(1)])
    found = required_gain(fleet, 0.3, 1.0)
    assert found.fails == ("flexible robot",)
    assert found.least is None
    without = required_gain(mixed.join([pi_cascades(2), integrators(1)]), 0.3, 1.0)
    assert (without.fails, without.least) == ((), 0.0)
    assert without.decay_rate <= required_gain(pi_cascades(2), 0.3, 1.0).decay_rate


# ------------------------------------------------------------------------------------ verdicts


def status(system, label):
    (found,) = (a for a in Theorem(system).assumptions if a.label == label)
    return found.status


def test_the_papers_first_experiment_is_certified():
    theorem = Theorem(robot_system(robot_state(FIVE), engine="mujoco"))
    assert theorem.status == "certified"
    assert theorem.lyapunov
    assert [a.label for a in theorem.assumptions] == [
        "asmp:cost", "asmp:pseudo(a)", "asmp:nonlinearPlant",
    ]  # fmt: skip
    assert "10 affine constraints" in theorem.assumptions[0].why


def test_the_papers_second_experiment_is_certified_for_small_epsilon():
    theorem = Theorem(osnr(distributed(), integrator="rosenbrock"))
    assert theorem.status == "certified for small epsilon"
    assert not theorem.lyapunov
    assert all(a.status == "met" for a in theorem.assumptions)
    assert theorem.gain.least == 0


@pytest.mark.parametrize(
    ("options", "certified"),
    [({"mode": "sampled"}, False), ({"integrator": "euler"}, False), ({}, True)],
)
def test_theorems_are_in_continuous_time(options, certified):
    theorem = Theorem(robot_system(robot_state(FIVE), **options))
    assert theorem.obstacles == ()
    assert theorem.lyapunov is certified
    assert (theorem.status == "certified") is certified


def test_partial_information_needs_a_gain():
    assert Theorem(partial_robots(3.0)).status == "certified"
    weak = Theorem(partial_robots(1.0))
    assert weak.status == "not certified"
    assert not weak.lyapunov
    assert "coupling gain" in weak.obstacles[0]


def test_robots_are_not_certified_under_the_distributed_law():
    law = FullyDistributed(graphs.ring(5), 0.001, 1.0)
    theorem = Theorem(robot_system(robot_state(FIVE), law=law))
    assert theorem.status == "not certified"
    assert status(theorem.system, "asmp:OSSPassive") == "not met"


def test_springs_that_push_are_not_passive():
    numbers = {**EQUAL, "stiffness": [1.0, 1.0, -2.0, 1.0, 1.0]}
    theorem = Theorem(robot_system(robot_state(FIVE), numbers))
    assert status(theorem.system, "asmp:nonlinearPlant") == "not met"
    assert not theorem.lyapunov


def test_sampled_constants_do_not_certify_a_run():
    system = osnr(FullInformation())
    assert Theorem(system).lyapunov
    unknown = replace(system, game=replace(system.game, jacobian_bounds=None))
    assert status(unknown, "asmp:pseudo(a)") == "unknown"
    assert not Theorem(unknown).lyapunov


def test_a_law_of_ones_own_is_covered_by_no_theorem():
    class Own(FullInformation):
        information = "custom"

    theorem = Theorem(robot_system(robot_state(FIVE), law=Own()))
    assert theorem.name is None
    assert theorem.status == "not certified"
    assert not theorem.lyapunov
    assert "\n".join(report_text(certify(theorem.system, STEP))).count("nothing") == 1


def coupled(parameter):
    game = Game(
        "coupled", coupled_game, np.array([parameter]), coupled_game.SIZES, [[0, 1, 2]] * 3,
        coupled_game.IN_CONSTRAINT, ("ball", "product"),
    )  # fmt: skip
    state = np.full((4, 1), 0.1)
    return System("coupled", game, integrators(4), FullInformation(), 0.1, state)


def test_a_constraint_that_is_not_convex_is_found():
    system = coupled(0.3)
    (found,) = [a for a in Theorem(system).assumptions if a.label == "asmp:cost"]
    assert found.status == "not met"
    assert "constraint 'product' is not convex" in found.why
    assert not Theorem(system).lyapunov


def test_theta_2_of_actions_of_several_entries():
    """Bounds of a game with sizes 2, 1, 1, against pairs of profiles, one for each agent."""
    rows, columns = np.indices((4, 4))
    off = 0.1 * (rows + columns + 1) * (coupled(0.3).game.agent_of_action != 0)
    off[2:] = 0.1 * (rows + columns + 1)[2:]
    np.fill_diagonal(off, 0.0)
    bounds = (np.eye(4) - off, 4.6 * np.eye(4) + off)  # for |y_a| <= 2
    box = (np.full(4, -2.0), np.full(4, 2.0))
    game = replace(coupled(0.3).game, jacobian_bounds=lambda _: bounds, box=box)
    slopes = Slopes(game, box, np.zeros(4), feasible=False)
    assert slopes.theta_2.label == "bounded"
    assert slopes.theta_2.sampled <= slopes.theta_2.value < slopes.theta_1.value
    rng = np.random.default_rng(0)
    rows_of = game.agent_of_action
    for _ in range(50):
        own, others = rng.uniform(-2, 2, (2, 3, 4))
        change = game.pseudo_gradient(own) - game.pseudo_gradient(others)
        extended = change[rows_of, np.arange(4)]
        distance = np.linalg.norm(own - others)
        assert np.linalg.norm(extended) <= slopes.theta_2.value * distance + 1e-12


def test_a_direction_that_is_not_monotone_is_found():
    box = (np.full(4, -2.0), np.full(4, 2.0))
    assert Slopes(coupled(-2.0).game, box, np.zeros(4), feasible=True).refuted
    assert not chain_slopes(5).refuted


def test_estimates_widen_the_box():
    y = np.array(FIVE)
    estimate = np.tile(y, (5, 1))
    estimate[0, 4] = 100.0
    estimate[2, 2] = 500.0  # an own block, which is not an estimate
    system = replace(partial_robots(3.0), memory=estimate.ravel())
    box = Theorem(system).slopes.box
    assert box[1][4] == 100.0
    assert np.array_equal(np.delete(box[1], 4), np.delete(system.game.box[1], 4))
    start = certify(system, STEP).start
    assert start["estimates"]["largest_distance_from_actions"] == 98.0
    assert start["margin"] == pytest.approx(5.0)


def test_estimates_of_the_distributed_law_start_in_a_ball_inside():
    """The total power's plane is 0.5 / sqrt(10) = 0.158 mW away from 0.2 mW in each channel."""
    law = distributed()
    y = np.full(10, 0.2)
    for spread, expected in ((0.0, "met"), (0.15, "met"), (0.17, "unknown")):
        estimate = np.tile(y, (10, 1))
        estimate[0, 1] += spread
        system = replace(osnr(law), memory=law.initial_memory(y, estimate))
        assert status(system, "lemma:centreInv, start") == expected
    assert certify(system, STEP).start["estimates"]["margin"] == pytest.approx(0.2)


# ------------------------------------------------------------------------------------- periods


def test_mobility_is_one_over_the_mass():
    system = robot_system(robot_state(FIVE), UNEQUAL)
    np.testing.assert_allclose(system.agents.mobility, 1 / np.array(UNEQUAL["main_mass"]))
    np.testing.assert_array_equal(osnr(distributed()).agents.mobility, np.ones(10))


def test_rules_for_one_robot_near_its_bound():
    numbers = {key: [2.0] for key in EQUAL}
    for distance in (1e-2, 1e-3):
        system = robot_system(robot_state([V0 - 3.0 + distance]), numbers, rho=0.1)
        assert push_period(system, system.start) == pytest.approx(3.0 * 2 * distance / 0.2)
        # 2 M d^2 / rho up to the rest of the barrier and F
        period = linear_period(system, system.start)
        assert period == pytest.approx(2 * 2.0 * distance**2 / 0.1, rel=10 * distance)


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1))
def test_the_linear_rule_is_where_held_integrators_become_unstable(seed):
    rng = np.random.default_rng(seed)
    game = velocity_game(4, V0, 3.0)
    system = System(
        "s", game, integrators(4), FullInformation(), 0.1, V0 + rng.uniform(-1, 1, (4, 1))
    )
    y = system.equilibrium.action
    period = linear_period(system, y)
    ours = reference_games.VelocityGame(V0, np.full(4, 3.0))
    matrix = reference.pseudo_gradient_jacobian(ours, y) + reference.barrier_hessian(ours, 0.1, y)
    for factor, stable in ((0.999, True), (1.001, False)):
        step = np.eye(4) - factor * period * matrix
        assert (np.max(np.abs(np.linalg.eigvals(step))) < 1) is np.bool_(stable)


def test_the_coupling_and_the_gain_shorten_the_period():
    plain = robot_system(robot_state(FIVE))
    assert linear_period(partial_robots(4.0), FIVE) < linear_period(plain, FIVE)
    strong = robot_system(robot_state(FIVE), law=FullyDistributed(graphs.ring(5), 0.01, 2.0))
    assert linear_period(strong, FIVE) == pytest.approx(linear_period(plain, FIVE) / 2)
    assert push_period(strong, FIVE) == pytest.approx(push_period(plain, FIVE) / 2)


# ------------------------------------------------------------------------------------- epsilon


def trial(epsilon, system, timing):
    law = replace(system.law, epsilon=epsilon)
    loop = replace(system, law=law).closed_loop(timing)
    loop.advance(1, timing.steps(timing.duration))
    loop.finish()
    return loop.monitor.exit == watch.INSIDE


@pytest.mark.slow
def test_the_search_brackets_an_epsilon():
    system = osnr(distributed(epsilon=0.05, gain=1.0), integrator="rosenbrock")
    timing = clock(0.01, 0.1)
    said = []
    found = search_epsilon(system, timing, lambda *now: said.append(now))
    assert found.inside < found.outside <= 1.01 * found.inside
    assert trial(found.inside, system, timing)
    assert not trial(found.outside, system, timing)
    assert [done for done, _, _ in said] == list(range(len(said)))
    assert len(said) >= len(found.trials)
    assert found.note is None
    assert all(stayed == trial(epsilon, system, timing) for epsilon, stayed in found.trials)


@pytest.mark.slow
def test_the_search_says_where_it_ends():
    timing = clock(0.002, 0.004)
    endless = search_epsilon(osnr(distributed(epsilon=0.03), integrator="rosenbrock"), timing)
    assert endless.outside is None
    assert "not tried" in endless.note
    assert endless.inside <= 10 * timing.duration < 2 * endless.inside
    # an explicit method's step is too long for a smaller epsilon
    law = distributed(epsilon=0.5, gain=100.0)
    short = search_epsilon(osnr(law), clock(0.05, 1.0))
    assert short.inside is None
    assert "cannot be tried" in short.note


def test_only_the_distributed_law_has_an_epsilon():
    with pytest.raises(InvalidInput, match="only the distributed law"):
        search_epsilon(robot_system(robot_state(FIVE)), STEP)


# -------------------------------------------------------------------------------------- reports


@pytest.mark.parametrize(
    "system",
    [
        robot_system(robot_state(FIVE)),
        partial_robots(1.0, mode="sampled"),
        partial_robots(9.0, "complete"),
        osnr(distributed()),
        osnr(FullInformation(), integrators(10)),
        coupled(0.3),
    ],
    ids=["full", "sampled", "partial", "distributed", "integrators", "own game"],
)
def test_reports_survive_json_and_become_words(system):
    report = certify(system, STEP)
    document = report.to_dict()
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    text = report_text(report)
    assert text[0].startswith(f"\n{system.name}: ")
    assert any(line.split() == ["verdict", *report.status.split()] for line in text)
    for heading in ("guaranteed", "only measured", "not certified", "mu"):
        assert any(line.strip().startswith(heading) for line in text), heading


def gne(*arguments):
    return CliRunner().invoke(app, ["certify", *arguments])


def test_the_command_tells_the_papers_authors():
    done = gne("paper")
    assert done.exit_code == 0
    for said in (
        "0.2679492 (exact)", "3.837972 (exact)", "2.828427 (exact)", "lambda_2 = 2.38907",
        "0.1464331 (bounded", "any k > 0", "certified, sufficient",
        "the paper's definition has mu/2",
        "c lambda_2 > 32.6848 (printed) or 44.2923 (rigorous)", "unweighted graphs reach 5",
        "on the complete graph c > 1.38835 (exact form)",
    ):  # fmt: skip
        assert said in done.stdout, said


def test_the_command_prints_json():
    done = gne("paper", "--json")
    document = json.loads(done.stdout)
    assert set(document) == {"robots", "channels"}
    assert document["robots"]["status"] == "certified"
    assert document["robots"]["lyapunov_claimed"]
    epsilon = document["channels"]["epsilon"]
    assert (epsilon["given"], epsilon["search"]) == (0.01, None)
    assert 1e-4 < epsilon["star"] < 0.0119, "what trials find"


@pytest.mark.slow
def test_the_command_searches_epsilon():
    done = gne(
        "paper", "--search-epsilon", "--json", "--set", "simulation.duration=0.1",
        "--set", "channels.controller.gain=1.0",
    )  # fmt: skip
    search = json.loads(done.stdout)["channels"]["epsilon"]["search"]
    assert search["inside"] < search["outside"]
    assert done.stderr == ""  # no progress where there is no terminal


def test_the_command_refuses_a_search_without_an_epsilon():
    done = gne("velocity-sync", "--search-epsilon")
    assert isinstance(done.exception, InvalidInput)
