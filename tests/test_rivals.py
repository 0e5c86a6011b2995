"""Laws of others against their formulas in NumPy, and where they lead."""

from dataclasses import replace

import numpy as np
import pytest
from builders import clock, integrators
from random_games import RandomGame

from gne_mj.controllers import (
    FeedbackSeeking,
    L1Penalty,
    PrimalDual,
    PrimalDualPartial,
    QuadraticPenalty,
    RecursiveSafeFlow,
)
from gne_mj.controllers.affine_bounds import affine_bounds
from gne_mj.equilibrium import variational_equilibrium
from gne_mj.errors import InvalidInput
from gne_mj.faults import MessageDelay, MessageLoss
from gne_mj.games import velocity_game
from gne_mj.graph import line, ring
from gne_mj.loops import functions
from gne_mj.loops.feedback import Problem, work
from gne_mj.loops.layout import LoopClock, Setup, problem_and_parameter_block
from gne_mj.loops.link import link
from gne_mj.loops.ode import CONTINUOUS
from gne_mj.plants.functions import EULER
from gne_mj.registry import LAWS
from gne_mj.system import System
from gne_mj.theory import certify

H = 0.02
SEEDS = pytest.mark.parametrize(
    "seeds", [range(3), pytest.param(range(3, 100), marks=pytest.mark.slow)], ids=["few", "many"]
)
GAMES = pytest.mark.parametrize("curved", [False, True])


def ask(game, law, y, memory, *, held=False, limit=np.inf):
    """u and the memory's rate (``held``: the memory a period of H later) by compiled kernels."""
    addresses = link(law.kernels, game.kernels, memory=len(memory) > 0, held=held)
    move = law.propagator if held else law.step_propagator
    m, p = game.actions, game.constraints_count
    problem = Problem(
        game.data, law.graph_data, law.settings(0.1), np.full(m, limit), np.zeros(m), move(H),
        functions=addresses,
    )  # fmt: skip
    setup = Setup(problem, np.zeros((m, 1)), LoopClock(H, 1, CONTINUOUS, EULER))
    problem, _block = problem_and_parameter_block(setup, integrators(m), len(memory))
    u, moved, scratch = np.full(m, np.nan), memory.copy(), work(m, p, game.agents)
    assert functions.action(problem, y, np.full(p, np.nan), moved, scratch, u) == -1
    if held:
        functions.propagate(problem, y, moved, scratch.scratch)
        return u, moved
    out = np.full(len(memory), np.nan)
    functions.rate(problem, y, moved, out)
    return u, out


def at_the_end(made, law, *, h=H, duration=20.0, done=None, **options):
    """Outputs and memory of integrators that begin at 0, at the end of a run.

    With ``done`` runs go on, for ``duration`` after ``duration``, until it says so of both, or for
    a thousand times that.
    """
    game = made.game
    system = System(
        "s", game, integrators(game.actions), law, 0.1, np.zeros((game.actions, 1)),
        on_exit="continue", **options,
    )  # fmt: skip
    loop = system.closed_loop(clock(h, duration))
    for _ in range(1 if done is None else 1000):
        loop.advance(1, round(duration / h))
        now = loop.present()
        y, memory = now.state[:, 0], now.memory
        if done is not None and done(y, memory):
            break
    return y, memory


def kkt_residual(made, y, multipliers):
    """The greatest of |F + J^T l|, g^+ and |l g|."""
    g = made.g(y)
    found = made.F(y) + made.J(y).T @ multipliers, np.maximum(g, 0.0), multipliers * g
    return max(np.max(np.abs(each)) for each in found)


def projected(value, multiplier):
    return np.maximum(value, -multiplier / H)


@GAMES
def test_primal_dual_play_is_its_formula(curved):
    law = PrimalDual(3, gain=1.7, dual_gain=0.6)
    for seed in range(10):
        made, rng = RandomGame(seed, curved=curved), np.random.default_rng(seed)
        y, l = rng.normal(size=3), rng.uniform(0.0, 2.0, 3) * rng.integers(0, 2, 3)  # noqa: E741
        u, rate = ask(made.game, law, y, l)
        np.testing.assert_allclose(u, -1.7 * (made.F(y) + made.J(y).T @ l), rtol=0, atol=1e-12)
        np.testing.assert_allclose(rate, projected(0.6 * made.g(y), l), rtol=0, atol=1e-12)
        _, moved = ask(made.game, law, y, l, held=True)
        expected = np.maximum(l + H * 0.6 * made.g(y), 0.0)
        np.testing.assert_allclose(moved, expected, rtol=0, atol=1e-12)


def drawn(seed, curved, spread=1.5):
    """A game, a profile inside or outside, and multipliers, some of them zero."""
    made, rng = RandomGame(seed, curved=curved), np.random.default_rng(seed)
    return made, spread * rng.normal(size=3), rng.uniform(0.0, 2.0, 3) * rng.integers(0, 2, 3)


def test_bounds_on_gaps_are_affine_ones_on_both_sides():
    game, rng = velocity_game(3, 3.0, [0.5, 1.0, 2.0]), np.random.default_rng(0)
    game = game.tightened(0.1)
    found = affine_bounds(game)
    assert found.A.shape == (6, 3)
    for _ in range(20):
        y = 3.0 + rng.normal(size=3)
        gaps = np.diff(y, prepend=3.0)
        both = np.column_stack([gaps, -gaps]).ravel() - np.repeat([0.5, 1.0, 2.0], 2)
        np.testing.assert_allclose(np.sort(found.A @ y - found.b), np.sort(both), atol=1e-12)
    np.testing.assert_allclose(found.share.sum(axis=0), 1.0)
    assert found.share[0, 0] == 1.0
    assert found.share[0, 2] == 0.5


def test_constraints_that_agents_cannot_know_as_affine_are_refused():
    with pytest.raises(InvalidInput, match="constraint 1 is neither affine nor a bound on both"):
        affine_bounds(RandomGame(0, curved=True).game)
    made = RandomGame(0).game
    with pytest.raises(InvalidInput, match="constraint 2 is not the constraint of all in it"):
        affine_bounds(replace(made, owners=[(0, 1, 2), (0,), (0, 1, 2)]))
    with pytest.raises(InvalidInput, match="and it moves"):
        affine_bounds(replace(made, motion=object()))


def test_margins_bring_bounds_on_both_sides_nearer():
    """(y_i - y_j)^2 - delta^2 + t <= 0: the sum of what agents know of each row."""
    game = velocity_game(3, 3.0, [0.5, 1.0, 2.0])
    bounds, y = affine_bounds(game), np.array([3.1, 2.6, 4.0])
    tight = game.tightened([0.1, 0.2, 0.3])
    law = PrimalDualPartial(line(3), bounds)
    memory = np.concatenate([np.zeros(9), np.full(18, 5.0), np.zeros(36)])
    _, moved = ask(tight, law, y, memory)
    known = moved[9:27].reshape(3, 6).sum(axis=0)
    delta = np.repeat(np.sqrt(np.array([0.25, 1.0, 4.0]) - [0.1, 0.2, 0.3]), 2)
    gaps = np.repeat(np.diff(y, prepend=3.0), 2)
    side = [row[np.flatnonzero(row)[-1]] for row in bounds.A]  # 1 for y_i - y_j, -1 for y_j - y_i
    np.testing.assert_allclose(known, side * gaps - delta, rtol=0, atol=1e-12)


def partial_reference(made, law, y, estimates, l, z, *, held):  # noqa: E741
    """u, then rates; or all of it a period of H later, the estimates left out."""
    bounds, graph = law.bounds, law.graph
    rows, n, c = estimates.copy(), len(y), law.coupling
    np.fill_diagonal(rows, y)
    L = graph.laplacian
    F = np.array([made.F(rows[i])[i] for i in range(n)])
    u = -law.gain * (F + np.einsum("ri,ir->i", bounds.A, l)) - c * np.diag(L @ rows)
    drive = law.dual_gain * (bounds.A.T * y[:, None] - bounds.share * bounds.b - L @ z - L @ l)
    agree = law.dual_gain * L @ l
    if held:
        return u, np.maximum(l + H * drive, 0.0), z + H * agree
    away = -c * (L @ rows)
    np.fill_diagonal(away, 0.0)
    return u, away, projected(drive, l), agree


@pytest.mark.parametrize("held", [False, True])
def test_partial_primal_dual_play_is_its_formula(held):
    for seed, graph in ((0, ring(4)), (1, line(4))):
        made, rng = RandomGame(seed, agents=4), np.random.default_rng(seed)
        law = PrimalDualPartial(graph, affine_bounds(made.game), 1.7, 2.1, 0.6)
        y, estimates, z = rng.normal(size=4), rng.normal(size=(4, 4)), rng.normal(size=(4, 3))
        l = rng.uniform(0.0, 2.0, (4, 3)) * rng.integers(0, 2, (4, 3))  # noqa: E741
        memory = np.concatenate([estimates.ravel(), l.ravel(), z.ravel(), np.zeros(12)])
        u, moved = ask(made.game, law, y, memory, held=held)
        first, *expected = partial_reference(made, law, y, estimates, l, z, held=held)
        np.testing.assert_allclose(u, first, rtol=1e-13, atol=1e-12)
        begin = 16 if held else 0
        expected = np.concatenate([np.ravel(each) for each in expected])
        np.testing.assert_allclose(moved[begin:40], expected, rtol=1e-13, atol=1e-12)
        assert not np.any(moved[40:])


def test_a_partial_rate_depends_on_what_the_agent_has():
    """All that is neither its own nor a neighbour's becomes NaN, and not a bit changes."""
    made, rng = RandomGame(0, agents=5), np.random.default_rng(0)
    law = PrimalDualPartial(line(5), affine_bounds(made.game))
    y, parts = rng.normal(size=5), [rng.normal(size=(5, size)) for size in (5, 3, 3)]

    def rates(y, parts):
        memory = np.concatenate([*(part.ravel() for part in parts), np.zeros(15)])
        u, out = ask(made.game, law, y, memory)
        return u, out[25:40].reshape(5, 3), out[40:55].reshape(5, 3)

    known = rates(y, parts)
    for i in range(5):
        far = np.abs(np.arange(5) - i) > 1
        hidden = [np.where(far[:, None], np.nan, part) for part in parts]
        other = rates(np.where(np.arange(5) == i, y, np.nan), hidden)
        for mine, again in zip(known[1:], other[1:], strict=True):
            assert np.array_equal(mine[i], again[i])
    # of actions: what neighbours take y_i to be, and its own row
    for i in (1, 3):
        far = np.abs(np.arange(5) - i) > 1
        hidden = [np.where(far[:, None], np.nan, part) for part in parts]
        u, *_ = rates(np.where(np.arange(5) == i, y, np.nan), hidden)
        assert u[i] == known[0][i]


@pytest.mark.parametrize("mode", ["continuous", "sampled"])
@SEEDS
def test_partial_primal_dual_play_ends_at_the_variational_equilibrium(mode, seeds):
    for seed in seeds:
        made = RandomGame(seed)
        found = variational_equilibrium(made.game, np.zeros(3))
        law = PrimalDualPartial(line(3), affine_bounds(made.game), 1.0, 10.0, 1.0)

        def close(y, memory, made=made, found=found):
            near = np.max(np.abs(y - found.action)) < 1e-6
            held = memory[9:18].reshape(3, 3)
            return near and max(kkt_residual(made, y, each) for each in held) < 1e-6

        assert close(*at_the_end(made, law, done=close, mode=mode)), seed


def test_partial_primal_dual_play_gets_there_with_lost_and_late_messages():
    made = RandomGame(1)
    law = PrimalDualPartial(line(3), affine_bounds(made.game), 1.0, 5.0, 1.0)
    faults = (MessageLoss(probability=0.3), MessageDelay(periods=2))
    y, _ = at_the_end(made, law, duration=600.0, mode="sampled", faults=faults, seed=3)
    found = variational_equilibrium(made.game, np.zeros(3))
    np.testing.assert_allclose(y, found.action, rtol=0, atol=1e-5)


def test_late_messages_bring_multipliers_of_before():
    made = RandomGame(1)
    law = PrimalDualPartial(line(3), affine_bounds(made.game), 1.0, 5.0, 1.0)
    system = System(
        "s", made.game, integrators(3), law, 0.1, np.zeros((3, 1)), on_exit="continue",
        mode="sampled", faults=(MessageDelay(periods=2),),
    )  # fmt: skip
    rows = system.closed_loop(clock(H, 1.0)).advance(50, 1)
    y, held = rows.state[:, :, 0], rows.memory[:, 9:27].reshape(50, 2, 3, 3)
    l, z = held[:, 0], held[:, 1]  # noqa: E741
    bounds, heard = law.bounds, np.abs(law.graph.laplacian) * (1 - np.eye(3))
    links = heard.sum(axis=1)[:, None]
    assert np.max(l[-1]) > 0.01
    for k in range(2, 49):
        of_l, of_z = (links * x[k] - heard @ x[k - 2] for x in (l, z))
        drive = bounds.A.T * y[k][:, None] - bounds.share * bounds.b - of_z - of_l
        np.testing.assert_allclose(l[k + 1], np.maximum(l[k] + H * drive, 0.0), atol=1e-13)
        np.testing.assert_allclose(z[k + 1], z[k] + H * of_l, atol=1e-13)


@GAMES
def test_penalties_are_their_formulas(curved):
    exact = L1Penalty(gain=1.7, strength=3.0, width=0.4)
    for seed in range(10):
        made, y, _ = drawn(seed, curved)
        beyond = np.maximum(made.g(y), 0.0)
        price = 3.0 * np.minimum(beyond / 0.4, 1.0)
        u, _ = ask(made.game, exact, y, np.zeros(0))
        np.testing.assert_allclose(u, -1.7 * (made.F(y) + made.J(y).T @ price), atol=1e-12)
        u, _ = ask(made.game, QuadraticPenalty(1.7, 3.0), y, np.zeros(0))
        expected = -1.7 * (made.F(y) + made.J(y).T @ (3.0 * beyond))
        np.testing.assert_allclose(u, expected, rtol=1e-13, atol=1e-12)


@GAMES
def test_the_recursive_flow_is_its_formula(curved):
    law = RecursiveSafeFlow(3, gain=1.7, alpha=0.8, time_constant=0.3)

    def slope(made, y, v):
        u = -1.7 * made.F(y) - made.J(y).T @ v
        return u, (made.J(y) @ u + 0.8 * made.g(y)) / 0.3

    for seed in range(10):
        made, y, v = drawn(seed, curved)
        u, rate = ask(made.game, law, y, np.append(v, np.zeros(3)))
        expected, ascent = slope(made, y, v)
        np.testing.assert_allclose(u, expected, rtol=0, atol=1e-12)
        np.testing.assert_allclose(rate[:3], projected(ascent, v), rtol=1e-13, atol=1e-12)
        _, moved = ask(made.game, law, y, np.append(v, np.zeros(3)), held=True)
        count = max(1, int(np.ceil(H * np.trace(made.J(y) @ made.J(y).T) / 0.3)))
        for _ in range(count):
            v = np.maximum(v + H / count * slope(made, y, v)[1], 0.0)
        np.testing.assert_allclose(moved[:3], v, rtol=1e-13, atol=1e-12)
        assert not np.any(rate[3:])
        assert not np.any(moved[3:])


def test_the_recursive_flow_moves_as_the_quadratic_program_says():
    """With y held its multipliers tend to those of min |xi + F|^2, J xi <= -alpha g."""
    law = RecursiveSafeFlow(3, alpha=0.8, time_constant=1e-4)
    for seed in range(3):
        made, y, _ = drawn(seed, curved=True, spread=0.5)
        memory = np.zeros(6)
        for _ in range(100):
            _, memory = ask(made.game, law, y, memory, held=True)
        u, _ = ask(made.game, law, y, memory)
        assert np.all(made.J(y) @ u <= -0.8 * made.g(y) + 1e-6)
        assert abs(memory[:3] @ (made.J(y) @ u + 0.8 * made.g(y))) < 1e-6


@GAMES
def test_feedback_seeking_is_its_formula(curved):
    law = FeedbackSeeking(3, gain=2.5, seeking=0.7, dual_gain=0.6)
    for seed in range(10):
        made, y, l = drawn(seed, curved)  # noqa: E741
        r = y + np.random.default_rng(seed).normal(size=3)
        u, moved = ask(made.game, law, y, np.append(l, r), held=True, limit=1.0)
        np.testing.assert_allclose(u, 2.5 * (r - y), rtol=0, atol=1e-12)
        wanted = r - H * 0.7 * (made.F(y) + made.J(y).T @ l)
        np.testing.assert_allclose(moved[3:], np.clip(wanted, y - 0.4, y + 0.4), rtol=0, atol=1e-12)
        expected = np.maximum(l + H * 0.6 * made.g(y), 0.0)
        np.testing.assert_allclose(moved[:3], expected, rtol=0, atol=1e-12)


def test_feedback_seeking_is_refused_in_mode_continuous():
    made = RandomGame(3, agents=2, constraints=1)
    with pytest.raises(InvalidInput, match=r"mode: got 'continuous'.*once a control period"):
        System("s", made.game, integrators(2), FeedbackSeeking(1), 0.1, np.zeros((2, 1)))


def test_a_tuned_gain_is_a_key_and_its_grid_has_the_default_within():
    rivals = [table for table in map(LAWS.__getitem__, LAWS) if table.tuned]
    assert len(rivals) >= 5
    for table in rivals:
        assert len(table.tuned) <= 3
        for key, grid in table.tuned.items():
            if "." in key or table.model_fields[key].is_required():
                continue  # of the system, not the law's own; or without a default
            default = table.model_fields[key].default
            assert grid == tuple(sorted(grid)), key
            assert grid[0] <= default <= grid[-1], key


@GAMES
@pytest.mark.parametrize("mode", ["continuous", "sampled"])
@SEEDS
def test_where_multipliers_lead_is_the_variational_equilibrium(curved, mode, seeds):
    for seed in seeds:
        made = RandomGame(seed, curved=curved)
        found = variational_equilibrium(made.game, np.zeros(3))
        assert np.max(found.multipliers) > 0.1
        laws = [PrimalDual(3, 1.3, 2.0), RecursiveSafeFlow(3, 1.3, 1.0, 0.1)]
        if mode == "sampled":
            laws.append(FeedbackSeeking(3, 5.0, 0.5, 0.5))
        for law in laws:
            scale = law.gain if isinstance(law, RecursiveSafeFlow) else 1.0

            def close(y, memory, made=made, found=found, scale=scale):
                near = np.max(np.abs(y - found.action)) < 1e-6
                return near and kkt_residual(made, y, memory[:3] / scale) < 1e-6

            assert close(*at_the_end(made, law, done=close, mode=mode)), (law.information, seed)


@GAMES
@SEEDS
def test_penalties_lead_where_wider_bounds_would(curved, seeds):
    """Violations are w l / s < w, or l / s: half of it at half the width, or twice the strength."""
    for seed in seeds:
        made = RandomGame(seed, constraints=1, curved=curved)
        found = variational_equilibrium(made.game, np.zeros(3))
        for laws, price in (
            ([L1Penalty(1.0, 10.0, width) for width in (0.04, 0.02)], lambda law: 10.0 / law.width),
            ([QuadraticPenalty(1.0, 250.0 * n) for n in (1, 2)], lambda law: law.strength),
        ):
            errors = []
            for law in laws:
                y, _ = at_the_end(made, law, h=1e-3, duration=20.0)
                beyond = np.maximum(made.g(y), 0.0)
                l = price(law) * beyond  # noqa: E741
                assert np.max(np.abs(made.F(y) + made.J(y).T @ l)) < 1e-6
                assert np.max(l) < 10.0
                np.testing.assert_allclose(l, found.multipliers, atol=0.2)
                errors.append(np.max(np.abs(y - found.action)))
            assert errors[1] == pytest.approx(0.5 * errors[0], rel=0.1)


def test_the_recursive_flow_nearly_keeps_the_set_and_primal_dual_play_does_not():
    made = RandomGame(1)
    worst = []
    for law in (RecursiveSafeFlow(3, 1.0, 1.0, 0.1), PrimalDual(3)):
        system = System(
            "s", made.game, integrators(3), law, 0.1, np.zeros((3, 1)), on_exit="continue"
        )  # fmt: skip
        loop = system.closed_loop(clock(H, 40.0))
        worst.append(np.max(made.game.constraints(loop.advance(2000, 1).state[:, :, 0])))
    assert worst[0] < 0.05 < 0.3 < worst[1]


def test_a_certificate_says_what_a_rival_promises():
    made = RandomGame(3, agents=2, constraints=1)
    law = PrimalDual(1)
    system = System("s", made.game, integrators(2), law, 0.1, np.zeros((2, 1)))
    told = certify(system, clock(H))
    assert told.status == "not certified"
    assert told.guaranteed == ["nothing"]
    assert law.promise in told.not_certified[0]
