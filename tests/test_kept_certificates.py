"""What certificates say where agents keep some estimates only."""

import numpy as np
import pytest
from builders import FIVE, robot_state, robot_system
from hypothesis import given
from hypothesis import strategies as st
from test_keepers import random_graph

from gne_mj import graph as graphs
from gne_mj.controllers import FullyDistributed, PartialInformation
from gne_mj.controllers.keepers import Keepers, fewest, readers
from gne_mj.controllers.kept import Kept
from gne_mj.games import velocity_game
from gne_mj.system import Clock
from gne_mj.theory import certify
from gne_mj.theory.coupling import least_coupling
from gne_mj.theory.report_text import report_text
from gne_mj.theory.theorem import Theorem

GAME = velocity_game(5, 3.0, 3.0)
CLOCK = Clock(1.0, 1e-3, 1e-3, 1e-3)


def drawn(seed):
    """A strongly monotone sparse dF/dy, sizes of actions, and what is kept on a random graph."""
    rng = np.random.default_rng(seed)
    agents = int(rng.integers(2, 7))
    sizes = rng.integers(1, 3, agents)
    owner = np.repeat(np.arange(agents), sizes)
    reads = (rng.random((agents, agents)) < 0.3) | np.eye(agents, dtype=bool)
    slope = rng.normal(size=(len(owner), len(owner))) * reads[np.ix_(owner, owner)]
    least = np.linalg.eigvalsh(0.5 * (slope + slope.T))[0]
    slope += (rng.uniform(0.05, 1.0) - least) * np.eye(len(owner))
    graph = random_graph(rng, agents, agents // 2)
    must = [set(np.flatnonzero(reads[:, j]).tolist()) for j in range(agents)]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    return slope, owner, Kept(graph, offsets, fewest(graph, must))


def quadratic_form(slope, owner, kept, gain):
    """The form in all entries that are kept, own actions among them: entry by entry."""
    at = {(i, r): e for e, (i, r) in enumerate(zip(kept.holder, kept.action, strict=True))}
    form = np.zeros((kept.size, kept.size))
    for (i, r), e in at.items():
        for l in np.flatnonzero(kept.graph.laplacian[i] < 0):  # noqa: E741
            if (l, r) in at:
                form[e, e] += gain
                form[e, at[l, r]] -= gain
    for a, b in zip(*np.nonzero(slope), strict=True):
        form[at[owner[a], a], at[owner[a], b]] += slope[a, b]
    return 0.5 * (form + form.T)


@given(st.integers(0, 2**32 - 1))
def test_the_least_gain_is_where_the_form_becomes_definite(seed):
    slope, owner, kept = drawn(seed)
    least = least_coupling(slope, kept.graph, owner, kept=kept)
    above = quadratic_form(slope, owner, kept, 1.001 * least + 1e-6)
    assert np.linalg.eigvalsh(above)[0] > 0
    if least > 1e-6:
        assert np.linalg.eigvalsh(quadratic_form(slope, owner, kept, 0.999 * least))[0] < 0


@given(st.integers(0, 2**32 - 1))
def test_the_rigorous_condition_with_the_worst_lambda_2_implies_it(seed):
    slope, owner, kept = drawn(seed)
    mu = np.linalg.eigvalsh(0.5 * (slope + slope.T))[0]
    theta_1 = np.linalg.norm(slope, 2)
    theta_2 = max(np.linalg.norm(slope[owner == i], 2) for i in range(owner[-1] + 1))
    needed = (theta_1 + theta_2) ** 2 / (4 * mu) + theta_2
    least = least_coupling(slope, kept.graph, owner, kept=kept)
    assert least <= needed / kept.connectivity * (1 + 1e-9)


def test_with_all_kept_it_is_what_all_estimates_have():
    graph, agents = graphs.ring(5), np.arange(5)
    rows = tuple(np.concatenate([[j], np.delete(agents, j)]) for j in agents)
    every = Kept(graph, GAME.data.offsets, Keepers(rows, np.ones(5, dtype=bool)))
    slope = GAME.pseudo_gradient_jacobian(FIVE)
    least = least_coupling(slope, graph, agents, kept=every)
    assert least == pytest.approx(least_coupling(slope, graph, agents), rel=1e-12)
    assert every.connectivity == pytest.approx(graph.algebraic_connectivity, rel=1e-12)


def robots(estimates=None, coupling=4.0):
    graph = graphs.line(5)
    kept = Kept(graph, GAME.data.offsets, fewest(graph, readers(GAME.data, constraints=False)))
    law = PartialInformation(graph, coupling, kept=kept)
    memory = law.initial_memory(FIVE, estimates)
    return robot_system(robot_state(FIVE), law=law, memory=memory)


def test_the_rigorous_condition_asks_for_less_than_with_a_whole_line():
    """And the quadratic form for the same: what hangs on a line's ends takes no part in it."""
    theorem = Theorem(robots())
    assert theorem.status == "certified"
    assert theorem.coupling.quadratic.least == pytest.approx(3.4709, abs=1e-4)
    assert theorem.coupling.rigorous.least == pytest.approx(22.146, abs=1e-3)  # lambda_2 = 2
    assert Theorem(robots(coupling=3.0)).status == "not certified"


def test_the_report_tells_what_is_kept():
    found = certify(robots(), CLOCK)
    assert found.graph["kept"] == {
        "estimates": 4, "of": 20, "lambda_2": pytest.approx(2.0), "smallest": True
    }  # fmt: skip
    text = "\n".join(report_text(found))
    assert "4 of 20 kept, the fewest that will do; least lambda_2 of keepers 2" in text
    assert certify(robot_system(robot_state(FIVE)), CLOCK).graph is None


def test_only_estimates_that_are_kept_widen_the_box():
    rows = np.tile(FIVE, (5, 1))
    rows[0, 4], rows[4, 3], rows[2, 2] = 100.0, 50.0, 500.0
    system = robots(rows)
    box = Theorem(system).slopes.box
    assert box[1][3] == 50.0
    assert np.array_equal(np.delete(box[1], 3), np.delete(system.game.box[1], 3))
    assert certify(system, CLOCK).start["estimates"] == {"largest_distance_from_actions": 49.5}


def test_the_distributed_theorem_speaks_of_kept_estimates_too():
    graph = graphs.ring(5)
    kept = Kept(graph, GAME.data.offsets, fewest(graph, readers(GAME.data, constraints=True)))
    law = FullyDistributed(graph, 0.01, 1.0, kept)
    labels = {a.label: a for a in Theorem(robot_system(robot_state(FIVE), law=law)).assumptions}
    assert labels["lemma:centreInv, start"].status == "met"
    assert "each action" in labels["asmp:graph"].why
