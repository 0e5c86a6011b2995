"""Laws of others against their formulas in NumPy, and where they lead."""

import numpy as np
import pytest
from builders import clock, integrators
from random_games import RandomGame

from gne_mj.controllers import PrimalDual
from gne_mj.loops import functions
from gne_mj.loops.feedback import Problem, work
from gne_mj.loops.layout import LoopClock, Setup, problem_and_parameter_block
from gne_mj.loops.link import link
from gne_mj.loops.ode import CONTINUOUS
from gne_mj.plants.functions import EULER
from gne_mj.system import System
from gne_mj.theory import certify

H = 0.02


def ask(game, law, y, memory, *, held=False):
    """u and the memory's rate (``held``: the memory a period of H later) by compiled kernels."""
    addresses = link(law.kernels, game.kernels, memory=len(memory) > 0, held=held)
    move = law.propagator if held else law.step_propagator
    m, p = game.actions, game.constraints_count
    problem = Problem(
        game.data, law.graph_data, law.settings(0.1), np.full(m, np.inf), np.zeros(m), move(H),
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


def projected(value, multiplier):
    return np.maximum(value, -multiplier / H)


@pytest.mark.parametrize("curved", [False, True])
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


def test_a_certificate_says_what_a_rival_promises():
    made = RandomGame(3, agents=2, constraints=1)
    law = PrimalDual(1)
    system = System("s", made.game, integrators(2), law, 0.1, np.zeros((2, 1)))
    told = certify(system, clock(H))
    assert told.status == "not certified"
    assert told.guaranteed == ["nothing"]
    assert law.promise in told.not_certified[0]
