"""Who keeps estimates of whom: sets that must do, and sets that a user gives."""

from itertools import combinations

import numpy as np
import pytest
from builders import random_consensus
from hypothesis import given
from hypothesis import strategies as st

from gne_mj import graph as graphs
from gne_mj.controllers.keepers import fewest, readers
from gne_mj.controllers.keepers import given as looked_at
from gne_mj.controllers.kept import Kept
from gne_mj.errors import InvalidInput
from gne_mj.games import velocity_game
from gne_mj.scenario import load_scenario


def connected(graph, members):
    """Whether agents form a connected part of a graph, by powers of its adjacency."""
    near = (graph.laplacian[np.ix_(members, members)] < 0) | np.eye(len(members), dtype=bool)
    return bool(np.all(np.linalg.matrix_power(near.astype(float), len(members))[0] > 0))


def random_graph(rng, count, extra):
    tree = [(int(rng.integers(i)), i) for i in range(1, count)]
    more = [tuple(map(int, rng.choice(count, 2, replace=False))) for _ in range(extra)]
    return graphs.Graph(count, (*tree, *more))


def least_size(graph, must):
    """The size of the smallest connected set around some agents, by trying all."""
    others = [v for v in range(graph.agents) if v not in must]
    for more in range(len(others) + 1):
        if any(connected(graph, sorted(must | set(extra))) for extra in combinations(others, more)):
            return len(must) + more
    raise AssertionError


@given(st.integers(0, 2**32 - 1))
def test_sets_that_are_found_do_and_are_the_smallest_where_it_says_so(seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(2, 9))
    graph = random_graph(rng, count, int(rng.integers(0, 4)))
    if seed % 4 == 0:
        graph = graphs.ring(count)
    must = [
        {j, *map(int, rng.choice(count, int(rng.integers(0, count)), replace=False))}
        for j in range(count)
    ]
    found = fewest(graph, must)
    for j, kept in enumerate(found.of):
        assert kept[0] == j
        assert list(kept[1:]) == sorted(set(kept[1:].tolist()) - {j})
        assert must[j] <= set(kept.tolist())
        assert connected(graph, kept)
        if found.smallest[j]:
            assert len(kept) == least_size(graph, must[j])
        if connected(graph, sorted(must[j])):
            assert set(kept.tolist()) == must[j]
            assert found.smallest[j]
    if len(graph.edges) == count - 1:
        assert np.all(found.smallest)


@given(st.integers(0, 10**6), st.booleans())
def test_what_games_say_is_what_their_functions_read(seed, constraints):
    """Every entry of an agent's slopes that is not zero belongs to an action that it keeps."""
    drawn = random_consensus(seed, 2)
    game, owner = drawn.game, drawn.game.agent_of_action
    found = readers(game.data, constraints=constraints)
    needed = game.pseudo_gradient_jacobian(drawn.interior()) != 0
    for row, column in zip(*np.nonzero(needed), strict=True):
        assert owner[row] in found[owner[column]]
    if constraints:
        for members in game.in_constraint:
            assert all(i in found[j] for i in members for j in members)


def test_on_a_line_neighbours_are_enough_and_the_star_passes_on():
    game = velocity_game(6, 3.0, 1.0)
    must = readers(game.data, constraints=False)
    assert [set(each.tolist()) for each in fewest(graphs.line(6), must).of] == [
        {0, 1}, {1, 2}, {2, 3}, {3, 4}, {4, 5}, {5},
    ]  # fmt: skip
    by_star = fewest(graphs.star(6), must)
    assert [set(each.tolist()) for each in by_star.of][1:3] == [{0, 1, 2}, {0, 2, 3}]
    assert np.all(by_star.smallest)
    both = readers(game.data, constraints=True)
    assert both[2] == {1, 2, 3}
    kept = Kept(graphs.line(6), game.data.offsets, fewest(graphs.line(6), both))
    assert kept.connectivity == pytest.approx(1.0)  # of a path of three
    assert kept.links.tolist() == [1, 2, 2, 2, 2, 1]


def test_how_much_is_kept_grows_with_the_neighbourhood_only():
    sizes = []
    for count in (50, 100, 200):
        game = velocity_game(count, 3.0, 1.0)
        kept = Kept(
            graphs.ring(count), game.data.offsets,
            fewest(graphs.ring(count), readers(game.data, constraints=False)),
        )  # fmt: skip
        sizes.append(kept.size + sum(map(len, kept.data)))
    assert sizes[2] - sizes[1] == 2 * (sizes[1] - sizes[0])


OWN = [[], [1], [2], [3], [4]]  # of the robots on a line: the one in front
LINE = {"information": "partial", "graph": "line"}


@pytest.mark.parametrize(
    ("estimates", "graph", "why"),
    [
        (OWN[:4], "line", "there must be 5, one an agent"),
        ([*OWN[:4], [6]], "line", "agents are numbered 1 to 5"),
        ([[], [1], [], [3], [4]], "line", "agent 3 must keep an estimate of agent 2"),
        (
            [[], [1], [2], [3], [4, 1]], "line",
            "agent 5 cannot hear of agent 1.*let agents 3, 4 keep one too",
        ),
        ("some", "line", "choose from all, needed|did you mean|'all' or 'needed'"),
        (
            "needed", {"type": "disc", "radius": 3.0},
            "it must be 'all' over a graph that changes",
        ),
        (OWN, "star", "agent 3 cannot hear of agent 2.*let agent 1 keep one too"),
    ],
)  # fmt: skip
def test_sets_that_do_not_do_are_refused(estimates, graph, why):
    law = {**LINE, "graph": graph, "estimates": estimates}
    with pytest.raises(InvalidInput, match=rf"controller.estimates: got .*{why}"):
        load_scenario("velocity-sync", {"controller": law}).system_objects()


def test_sets_of_ones_own_may_be_larger():
    game = velocity_game(5, 3.0, 1.0)
    more = [[], [0], [0, 1], [2], [3]]
    found = looked_at(graphs.line(5), readers(game.data, constraints=False), more)
    assert set(found.of[0].tolist()) == {0, 1, 2}
    assert not found.everyone


def test_the_rosenbrock_integrator_needs_all_estimates():
    scenario = {"controller.estimates": [[2], *([[1]] * 9)], "controller.graph": "complete"}
    with pytest.raises(InvalidInput, match="must keep an estimate"):
        load_scenario("osnr", scenario).system_objects()
    law = {"information": "distributed", "epsilon": 0.01, "graph": "ring", "estimates": "needed"}
    changes = {"controller": law, "plant.engine": "ode", "plant.integrator": "rosenbrock"}
    with pytest.raises(InvalidInput, match="with all estimates"):
        load_scenario("velocity-sync", changes).system_objects()
