"""The least coupling gain, against the quadratic form entry by entry and where V rises."""

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    FIVE,
    V0,
    clock,
    integrators,
)
from hypothesis import given
from hypothesis import strategies as st
from theory_systems import (
    chain_slopes,
    monotone_slopes,
    osnr_slopes,
)

import reference
from gne_mj import graph as graphs
from gne_mj.controllers import PartialInformation
from gne_mj.games import osnr_game, velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.system import System
from gne_mj.theory import Theorem
from gne_mj.theory.coupling import coupling, least_coupling


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
