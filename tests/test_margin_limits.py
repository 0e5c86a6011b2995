"""What margins cover agent by agent, norms of agents' rows, and lists that native code is given."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from builders import EQUAL, FIVE, V0, clock, integrators, robot_state, robot_system, robots

from gne_mj import graph as graphs
from gne_mj.controllers import FullInformation, PartialInformation
from gne_mj.controllers.propagation import Propagator, no_propagator
from gne_mj.errors import InvalidInput
from gne_mj.faults import Bias, Noise, Push, Saturation
from gne_mj.games import cournot_game, velocity_game
from gne_mj.graph import GraphData
from gne_mj.margins import Disturbance, influence, largest_push, tightening
from gne_mj.system import System
from gne_mj.theory import certify
from gne_mj.theory.constants import Slopes, _row_norms
from gne_mj.theory.disturbances import strength

# ----------------------------------------------------------------------------- the largest push


def test_the_largest_push_is_that_of_the_tightest_constraint():
    """Affine constraints of one firm each: t_l = gain (push + noise), and the least t_l decides."""
    game, effect = cournot_game(3), influence(integrators(3), 0.01, "euler", 20)
    gain = 0.2
    assert effect.push_gain == pytest.approx(np.full(3, gain))
    for noise in (0.0, 0.01):
        bound = Disturbance(np.zeros(3), np.full(3, noise))
        t = np.array([0.5, 0.2, 0.9, 0.7, 0.6, 0.8])
        expected = (0.2 - noise) / gain
        assert largest_push(game, effect, bound, t) == pytest.approx(expected, rel=1e-9)
        some = np.array([0.5, 0.0, 0.9, 0.7, 0.6, 0.8])
        assert largest_push(game, effect, bound, some) == 0.0, "one bound has no room at all"
    assert largest_push(game, effect, Disturbance(np.zeros(3), np.full(3, 0.3)), t) == 0.0


def test_the_largest_push_on_gaps_is_covered_and_no_greater_one_is():
    """Unequal robots: the push is the same on all, and at it the worst gap's room is used up."""
    numbers = {**EQUAL, "main_mass": [1.0, 2.5, 0.7, 1.3, 4.0]}
    game, effect = velocity_game(5, V0, [3.0, 2.0, 1.0, 2.5, 0.5]), None
    effect = influence(robots(numbers), 0.002, "euler", 5)
    bound = Disturbance(np.zeros(5), np.full(5, 0.001))
    t = tightening(game, effect.of(Disturbance(np.array([9.0, 1.0, 5.0, 2.0, 3.0]), bound.noise)))
    found = largest_push(game, effect, bound, t)
    for factor, covered in ((1 - 1e-6, True), (1 + 1e-6, False)):
        error = effect.of(Disturbance(np.full(5, factor * found), bound.noise))
        assert bool(np.all(tightening(game, error) <= t)) == covered
    assert 1.0 < found < 9.0


def test_a_push_that_uses_up_a_bound_is_not_covered():
    game, effect = velocity_game(2, V0, [3.0, 0.1]), influence(integrators(2), 0.01, "euler", 1)
    bound = Disturbance(np.zeros(2), np.zeros(2))
    found = largest_push(game, effect, bound, np.array([9.0, 0.01 - 1e-12]))
    # both agents of the second gap move by 0.01 * push: up to its bound of 0.1 together
    assert found == pytest.approx(5.0, rel=1e-3)


# ------------------------------------------------------------------------------- agents' rows


@pytest.mark.parametrize("sizes", [(2, 1, 1), (1, 1, 2), (2, 2), (3, 1), (1, 1, 1, 1), (4,)])
def test_norms_of_agents_rows_are_those_of_their_blocks(sizes):
    """The greatest singular value of a block is at least each row's norm, and at most all rows'."""
    rng = np.random.default_rng(len(sizes))
    at = np.concatenate([[0], np.cumsum(sizes)])
    game = SimpleNamespace(sizes=sizes, agents=len(sizes), data=SimpleNamespace(offsets=at))
    slopes = rng.normal(size=(5, 4, 4))
    found = _row_norms(game, slopes)
    assert found.shape == (5, len(sizes))
    for one, norms in zip(slopes, found, strict=True):
        for i, norm in enumerate(norms):
            block = one[at[i] : at[i + 1]]
            greatest = np.sqrt(np.max(np.linalg.eigvalsh(block @ block.T)))
            assert norm == pytest.approx(greatest, rel=1e-12)


def test_theta_2_of_planar_agents_is_that_of_both_rows():
    """dF/dy of the same game along both axes at once: known by its blocks."""
    from gne_mj.games import velocity_consensus_game

    game = velocity_consensus_game([(0, 1), (1, 2)], [1.0, 0.0, 0.0], [1.0, 0.0], [2.0] * 2, [2.0])
    slopes = Slopes(game, game.box, np.tile([1.0, 0.0], 3), feasible=False)
    jacobian = game.pseudo_gradient_jacobian(np.tile([1.0, 0.0], 3))
    blocks = [np.linalg.svd(jacobian[2 * i : 2 * i + 2])[1][0] for i in range(3)]
    assert slopes.theta_2.value == pytest.approx(max(blocks), rel=1e-12)
    assert slopes.theta_2.value == pytest.approx(np.sqrt(4.0**2 + 2 * 2.0**2), rel=1e-12)


# ---------------------------------------------------------------------------- what is promised


def inputs_condition(limit, faults=()):
    agents = robots(EQUAL)
    agents = replace(agents, input_limit=np.asarray(limit, dtype=float))
    system = System(
        "robots", velocity_game(5, V0, 3.0), agents, FullInformation(), 0.1, robot_state(FIVE),
        mode="implicit", integrator="euler", faults=faults,
    )  # fmt: skip
    held = certify(system, clock(0.01)).held
    (condition,) = [c for c in held["conditions"] if c["label"] == "inputs"]
    return condition["status"]


def test_a_limit_on_some_agents_is_a_limit():
    """Whoever has it: one agent, all but one, or all."""
    free, tight = np.inf, 0.01
    assert inputs_condition([free] * 5) == "met"
    for limits in ([free, free, tight, free, free], [tight] * 4 + [free], [tight] * 5):
        assert inputs_condition(limits) != "met"
    assert inputs_condition([free] * 5, (Saturation(limit=0.01),)) != "met"


def test_faults_of_one_agent_add_up():
    system = robot_system(robot_state(FIVE), mode="implicit", integrator="euler")
    faults = (
        Push(agents=(0,), force=-2.0), Push(force=0.5), Noise(agents=(1, 2), amplitude=0.1),
        Bias(agents=(2,), offset=-0.3), Saturation(limit=1.0),
    )  # fmt: skip
    most = strength(replace(system, faults=faults))
    assert most.push == pytest.approx([2.5, 0.5, 0.5, 0.5, 0.5])
    assert most.noise == pytest.approx([0.0, 0.1, 0.4, 0.0, 0.0])


# ------------------------------------------------------------- lists that native code is given


@dataclass(frozen=True, eq=False)
class Listed(PartialInformation):
    """A law of one's own that says itself who hears whom, and how estimates move."""

    lists: GraphData | None = None
    moves: Propagator | None = None

    @property
    def graph_data(self):
        return self.lists or super().graph_data

    def propagator(self, period):
        return self.moves or super().propagator(period)


RING = graphs.ring(5)


def listed(pointer=None, neighbour=None, **options):
    own = RING.data
    lists = GraphData(
        own.pointer if pointer is None else np.array(pointer),
        own.neighbour if neighbour is None else np.array(neighbour),
    )
    law = Listed(RING, lists=lists, **options)
    return robot_system(robot_state(FIVE), law=law, mode="sampled", integrator="euler")


@pytest.mark.parametrize(
    "lists",
    [
        {"pointer": [0], "neighbour": []},  # as of a law without a graph
        {"pointer": [0, 2, 4, 6, 8]},
        {"pointer": [0, 2, 4, 6, 8, 11]},
        {"pointer": [0, 2, 4, 6, 8, 9]},
        {"pointer": [2, 2, 4, 6, 8, 10]},
        {"pointer": [0, 4, 2, 6, 8, 10]},
        {"neighbour": [1, 4, 0, 2, 1, 3, 2, 4, 0, 5]},
        {"neighbour": [1, 4, 0, 2, 1, 3, 2, 4, 0, -1]},
        {"neighbour": [1, 4, 0, 2]},
    ],
)
def test_lists_that_native_code_would_read_beyond_are_refused(lists):
    with pytest.raises(InvalidInput, match=r"^law.graph: got .*must"):
        listed(**lists).setup(clock(0.01))


@pytest.mark.parametrize(
    "moves", [no_propagator(), Propagator(np.zeros((4, 4, 4)), np.zeros(0), np.zeros(3))]
)
def test_a_propagator_of_other_agents_is_refused(moves):
    system = listed(moves=moves)
    with pytest.raises(InvalidInput, match=r"propagator of shape .*\(5, 5, 5\)"):
        system.setup(clock(0.01))
    replace(system, mode="continuous").setup(clock(0.01))  # which has no use for it


def test_a_laws_own_lists_are_taken_as_they_are():
    assert np.array_equal(listed().setup(clock(0.01)).problem.graph.pointer, RING.data.pointer)
    own = robot_system(robot_state(FIVE), law=PartialInformation(RING), mode="sampled")
    assert own.setup(clock(0.01)).problem.graph is RING.data or np.array_equal(
        own.setup(clock(0.01)).problem.graph.neighbour, RING.data.neighbour
    )
