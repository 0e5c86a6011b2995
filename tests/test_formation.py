"""Formations: against plain NumPy, minimisers of a potential, runs under all laws, bad input."""

import numpy as np
import pytest
from builders import clock, integrators
from hypothesis import given, settings
from hypothesis import strategies as st
from position_games import random_formation, random_region
from scipy.optimize import minimize, root

from gne_mj import graph as graphs
from gne_mj import plots
from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.equilibrium import penalised_equilibrium, variational_equilibrium
from gne_mj.errors import InvalidInput
from gne_mj.game_check import examine
from gne_mj.games import formation_game, region_of
from gne_mj.games.formation import FormationTable
from gne_mj.scenario import load_scenario
from gne_mj.simulation import Simulation
from gne_mj.system import System
from gne_mj.theory import certify
from gne_mj.viewer.shares import shares

seeds = st.integers(0, 2**32 - 1)


def potential(numbers, y):
    """P with dP/dy_i = dJ_i/dy_i: each edge and each own wish once."""
    points = y.reshape(-1, 2)
    total = np.sum(numbers["place_weight"][:, None] * (points - numbers["desired_place"]) ** 2)
    for (i, j), w, o in zip(
        numbers["edges"], numbers["edge_weight"], numbers["desired_offset"], strict=True
    ):
        total += w * np.sum((points[i] - points[j] - o) ** 2)
    return total


def affine(numbers):
    """(M, c): F(y) = M y + c, from the weights' Laplacian on each axis."""
    v, place = numbers["place_weight"], numbers["desired_place"]
    matrix, constant = np.diag(2 * v), -2 * v[:, None] * place
    for (i, j), w, o in zip(
        numbers["edges"], numbers["edge_weight"], numbers["desired_offset"], strict=True
    ):
        matrix[[i, j], [i, j]] += 2 * w
        matrix[[i, j], [j, i]] -= 2 * w
        constant[i] -= 2 * w * o
        constant[j] += 2 * w * o
    return np.kron(matrix, np.eye(2)), constant.ravel()


def plain_constraints(numbers, y):
    """Links, then of each agent the region's sides and its disc."""
    region, points = numbers["region"], y.reshape(-1, 2)
    found = []
    for (i, j), r in zip(numbers["links"], numbers["link_length"], strict=True):
        found.append(np.sum((points[i] - points[j]) ** 2) - r**2)
    for point in points:
        found += list(region.normals @ point - region.offsets)
        if region.disc:
            found.append(np.sum((point - region.center) ** 2) - region.radius**2)
    return np.array(found)


def plain_slopes(numbers, y):
    """Their derivatives, (p, m)."""
    columns = [
        np.imag(plain_constraints(numbers, y + 1e-30j * direction)) / 1e-30
        for direction in np.eye(len(y))
    ]
    return np.array(columns).T


@given(seed=seeds)
def test_values_are_those_of_plain_matrices(seed):
    draw = random_formation(seed)
    game, (matrix, constant), y = draw.game, affine(draw.numbers), draw.interior()
    F = matrix @ y + constant
    np.testing.assert_allclose(game.pseudo_gradient(y), F, rtol=0, atol=1e-12 * (1 + abs(F).max()))
    np.testing.assert_allclose(game.pseudo_gradient_jacobian(y), matrix, rtol=0, atol=1e-13)
    np.testing.assert_allclose(
        game.constraints(y), plain_constraints(draw.numbers, y), rtol=0, atol=1e-13
    )
    np.testing.assert_allclose(
        game.constraint_jacobian(y), plain_slopes(draw.numbers, y), rtol=0, atol=1e-13
    )
    assert np.all(game.constraints(y) < 0)
    assert np.all((game.box[0] < y) & (y < game.box[1]))


@settings(max_examples=8)
@given(seed=seeds)
def test_the_game_agrees_with_itself(seed):
    draw = random_formation(seed)
    report = examine(draw.game, draw.interior(), points=4, most=8)
    assert report.holds, "\n".join(report.summary())


@given(seed=seeds)
def test_costs_are_what_the_potential_changes_by(seed):
    """J_i(y) - J_i(y') = P(y) - P(y') where only agent i moves."""
    draw = random_formation(seed)
    game, y = draw.game, draw.interior()
    for i in range(game.agents):
        moved = y.copy()
        moved[2 * i : 2 * i + 2] += draw.rng.normal(size=2)
        change = game.costs(moved)[i] - game.costs(y)[i]
        expected = potential(draw.numbers, moved) - potential(draw.numbers, y)
        assert change == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_the_variational_equilibrium_is_the_potentials_least_value(seed):
    draw = random_formation(seed, count=4)
    (matrix, constant), start = affine(draw.numbers), draw.interior(0.9)
    found = variational_equilibrium(draw.game, start)
    least = minimize(
        lambda y: 0.5 * y @ matrix @ y + constant @ y, start, jac=lambda y: matrix @ y + constant,
        constraints={"type": "ineq", "fun": lambda y: -plain_constraints(draw.numbers, y),
                     "jac": lambda y: -plain_slopes(draw.numbers, y)},
        method="SLSQP", options={"ftol": 1e-15, "maxiter": 500},
    ).x  # fmt: skip
    assert np.allclose(found.action, least, rtol=0, atol=1e-6)
    # the conditions themselves, which SLSQP meets less closely
    residual = draw.game.pseudo_gradient(found.action) + (
        plain_slopes(draw.numbers, found.action).T @ found.multipliers
    )
    assert np.max(np.abs(residual)) < 1e-8
    assert np.max(found.multipliers * -plain_constraints(draw.numbers, found.action)) < 1e-8


@settings(max_examples=15)
@given(seed=seeds)
def test_the_penalised_equilibrium_is_scipys(seed):
    draw, rho = random_formation(seed), 0.1
    matrix, constant = affine(draw.numbers)
    found = penalised_equilibrium(draw.game, rho, draw.interior(0.9)).action

    def residual(y):
        weights = rho / -plain_constraints(draw.numbers, y)
        return matrix @ y + constant + plain_slopes(draw.numbers, y).T @ weights

    again = root(residual, found + 1e-4, tol=1e-14).x
    assert np.allclose(again, found, rtol=0, atol=1e-7)


def test_everyone_is_in_place_where_nothing_binds():
    place = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]
    game = formation_game(
        place, graphs.ring(4).edges, [1.0, 0.0, 0.0, 0.0], region_of(radius=9.0), link_length=4.0
    )
    found = variational_equilibrium(game, np.zeros(8))
    assert found.action == pytest.approx(np.ravel(place), abs=1e-7)
    assert game.gap_bounds.tolist() == [4.0] * 4 + [9.0] * 4
    assert game.convexity == "bounds on gaps"


# ----------------------------------------------------------------------------------- the region


@given(seed=seeds)
def test_the_regions_middle_and_shares(seed):
    rng = np.random.default_rng(seed)
    region = region_of(**random_region(rng))
    angle = np.linspace(0, 2 * np.pi, 100)
    around = np.column_stack([np.cos(angle), np.sin(angle)])
    assert np.all(region.share(region.middle + 0.999999 * region.depth * around) < 1)
    points = rng.uniform(-6, 6, (200, 2))
    inside = np.all(points @ region.normals.T < region.offsets, axis=1)
    if region.disc:
        inside &= np.linalg.norm(points - region.center, axis=1) < region.radius
    assert np.array_equal(region.share(points) < 1, inside)
    lower, upper = region.box
    assert np.all((points[inside] > lower) & (points[inside] < upper))


@given(seed=seeds)
def test_the_outline_is_the_boundary(seed):
    region = region_of(**random_region(np.random.default_rng(seed)))
    corners = region.outline
    assert region.share(corners) == pytest.approx(1.0, abs=1e-9)
    # in order round it, and nothing is missing but what an arc's chords cut off
    along = np.roll(corners, -1, axis=0) - corners
    ahead = np.roll(along, -1, axis=0)
    assert np.all(along[:, 0] * ahead[:, 1] - along[:, 1] * ahead[:, 0] > -1e-9)
    assert np.all(region.share(corners + 0.5 * along) > 0.99)


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e9])
def test_the_middle_is_found_at_every_size(size):
    region = region_of(vertices=size * np.array([[0, 0], [4, 0], [0, 3]]))
    assert region.middle / size == pytest.approx([4 / 3, 1.0], rel=1e-9)  # the centroid
    assert region.depth / size == pytest.approx(0.8, rel=1e-9)


SQUARE = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]


def test_the_order_of_vertices_is_no_matter():
    for vertices in (SQUARE, SQUARE[::-1]):
        region = region_of(vertices=vertices)
        assert np.sort(region.offsets).tolist() == [0.0, 0.0, 1.0, 1.0]
        assert region.share(np.array([0.5, 0.75])) == pytest.approx(0.5)
        same = region_of(box=[[0.0, 0.0], [1.0, 1.0]])
        assert {*map(tuple, same.normals + 0.0)} == {*map(tuple, region.normals + 0.0)}


@pytest.mark.parametrize(
    ("given", "key", "words"),
    [
        ({}, "region", "it needs a box, vertices or a radius"),
        ({"box": [[0, 0], [1, 0]]}, "box", r"\[\[least x, least y\]"),
        ({"box": [[0, 0], [1, np.nan]]}, "box", "two finite numbers"),
        ({"box": [0.0, 1.0]}, "box", "two finite numbers"),
        ({"vertices": SQUARE[:2]}, "vertices", "three or more"),
        ({"vertices": [[0, 0], [1, 0], [2, 0]]}, "vertices", "three or more"),
        ({"vertices": [[0, 0], [1]]}, "vertices", "two finite numbers"),
        ({"vertices": [SQUARE[k] for k in (0, 2, 1, 3)]}, "vertices", "in order round it"),
        ({"vertices": [[0, 0], [2, 0], [0.5, 0.5], [0, 2]]}, "vertices", "convex polygon"),
        ({"vertices": [[np.cos(t), np.sin(t)] for t in 0.8 * np.pi * np.arange(5)]}, "vertices",
         "in order round it"),
        ({"radius": 0.0}, "radius", "positive and finite"),
        ({"radius": 1e-300}, "radius", "from 1e-100"),
        ({"box": [[-1e154, -1e154], [1e154, 1e154]]}, "box", "at most 1e\\+100"),
        ({"center": [0.0, 0.0]}, "radius", "a disc has"),
        ({"center": [0.0], "radius": 1.0}, "center", "two finite numbers"),
        ({"vertices": SQUARE, "center": [3.0, 3.0], "radius": 1.0}, "region", "well inside"),
        ({"vertices": SQUARE, "box": [[2, 2], [3, 3]]}, "region", "well inside"),
        ({"box": [[0, 0], [1, 1e-7]]}, "region", "well inside"),
    ],
)  # fmt: skip
def test_bad_regions(given, key, words):
    with pytest.raises(InvalidInput, match=words) as caught:
        region_of(**given)
    assert caught.value.key == key


# ------------------------------------------------------------------------- what is shown of it


def test_names_quantities_and_shares():
    game = formation_game(
        [[0.0, 0.0]] * 3, [(0, 1), (1, 2)], [1.0, 0.0, 0.0],
        region_of(box=[[-2, -1], [2, 1]], radius=2.0), links=[(2, 0)], link_length=2.0,
    )  # fmt: skip
    assert game.constraint_names[:6] == (
        "link of agents 3 and 1", "side 1 of the region, agent 1", "side 2 of the region, agent 1",
        "side 3 of the region, agent 1", "side 4 of the region, agent 1",
        "disc of the region, agent 1",
    )  # fmt: skip
    assert game.axis_of_action == ("x", "y") * 3
    assert game.gap_bounds is None
    y = np.array([[0.6, 0.0, 0.0, 0.5, -0.6, 0.0]])
    length, share = game.quantities
    assert length.at(y, (16,))[0, 0] == pytest.approx(1.2)
    assert np.all(np.isnan(length.at(y, (16,))[0, 1:]))
    np.testing.assert_allclose(share.at(y, (3,)), [[0.3, 0.5, 0.3]], atol=1e-9)
    values = {"action": y, "link_length": length.at(y, (16,)), "region_share": share.at(y, (3,))}
    np.testing.assert_allclose(shares(game, values), [[0.6, 0.5, 0.6]], atol=1e-9)


def test_few_digits_are_lost_close_to_a_link_of_any_direction():
    game = formation_game(np.zeros((2, 2)), [(0, 1)], [1.0, 0.0], region_of(radius=9.0))
    for angle in np.linspace(0, 2 * np.pi, 37):
        at = (3.0 - 1e-9) * np.array([np.cos(angle), np.sin(angle)])
        g = game.constraints(np.concatenate([at, np.zeros(2)]))[0]
        assert g == pytest.approx(-6e-9, abs=3e-15)


@pytest.mark.parametrize("count", [1, 2, 7, 40])
@pytest.mark.parametrize(
    "keys",
    [
        {},
        {"link_length": 0.1, "edges": "line"},
        {"link_length": [], "links": []},
        {"region": {"center": [9.0, 0.0], "radius": 0.5}, "links": "complete"},
        {"region": {"vertices": [[0, 0], [4, 0], [0, 3]], "radius": 2.0}, "links": []},
    ],
)
def test_the_default_start_is_inside(count, keys):
    if count == 1:
        keys = {**keys, "edges": [], "links": []}
    table = FormationTable(type="formation", **keys)
    game, start = table.build(count), table.default_start(count)
    assert np.all(game.constraints(start) < -1e-3)


# ---------------------------------------------------------------------------------------- runs

PLACE = 1.2 * np.array([[1.0, 0.0], [0.3, 1.0], [-0.8, 0.6], [-0.8, -0.6], [0.3, -1.0]])
LAWS = {
    "full": FullInformation(),
    "partial": PartialInformation(graphs.ring(5), coupling=20.0, time_constant=0.1),
    "distributed": FullyDistributed(graphs.ring(5), 5e-3, 1.0),
}


@pytest.mark.parametrize("law", LAWS)
def test_integrators_stay_inside_and_settle_under_every_law(law):
    """The places' third one is outside the region, and the first link too short for the shape."""
    game = formation_game(
        PLACE, graphs.ring(5).edges, [1.0, 0.0, 0.5, 0.0, 0.0],
        region_of(box=[[-0.7, -1.5], [2.0, 1.5]], radius=1.8),
        link_length=[1.1, 2.0, 2.0, 2.0, 2.0],
    )  # fmt: skip
    start = np.array([[1.5, 0.3], [0.8, 1.0], [-0.6, 1.1], [-0.65, -0.8], [1.1, -0.6]])
    system = System("fleet", game, integrators(10), LAWS[law], 0.05, start.reshape(10, 1))
    run = Simulation([system], clock(0.002, 20.0, sample=0.5)).run()
    report = run.reports["fleet"]
    assert report["status"] == "converged"
    assert report["worst_constraint"]["margin"] > 0
    used = run["fleet"]["link_length"].values[:, :5] / run["fleet"]["link_length_bound"].values[:5]
    assert np.max(used) < 1
    assert np.max(run["fleet"]["region_share"].values) < 1


def test_a_scenario_is_certified_runs_and_is_drawn():
    tables = {
        "simulation": {"duration": 0.5, "timestep": 0.01},
        "systems": {"fleet": {
            "game": {"type": "formation", "region": {"vertices": [[-3, -3], [4, -3], [0, 4]]},
                     "edges": "line", "links": [[1, 3]], "link_length": 2.0},
            "agents": {"type": "integrator", "count": 3}}},
    }  # fmt: skip
    (system,) = load_scenario(tables).system_objects()
    assert system.game.in_constraint[0] == [0, 2]
    report = certify(system, clock(0.01, 0.5))
    assert {a["label"]: a["status"] for a in report.theorem["assumptions"]} == {
        "asmp:cost": "met", "asmp:pseudo(a)": "met", "asmp:nonlinearPlant": "met",
    }  # fmt: skip
    mu = np.linalg.eigvalsh(system.game.pseudo_gradient_jacobian(system.start))[0]
    assert report.constants["mu"]["value"] == pytest.approx(mu, rel=1e-12)
    run = load_scenario(tables).simulation_object().run()
    assert run.status == "completed"
    assert set(plots.draw(run)) >= {"fleet-positions", "fleet-link-lengths", "fleet-region-shares"}


# ------------------------------------------------------------------------------------ bad input

GOOD = {
    "desired_place": np.zeros((3, 2)), "edges": [(0, 1), (1, 2)], "place_weight": [1.0, 0.0, 0.0],
    "region": region_of(radius=5.0),
}  # fmt: skip


@pytest.mark.parametrize(
    ("key", "bad", "words"),
    [
        ("desired_place", np.zeros((2, 2)), r"3 times \[x, y\], one for each agent"),
        ("desired_place", [[0.0, 0.0], [0.0], [0.0, 0.0]], "one for each agent"),
        ("desired_place", [[0.0, np.nan]] * 3, "finite numbers"),
        ("edges", [(0, 3), (1, 2)], "numbered 1 to 3"),
        ("edges", [(0, 1), (1, 0), (1, 2)], "once only"),
        ("edges", [(0, 1)], "that of agent 3 has none"),
        ("place_weight", [[1.0, 0.0, 0.0]], "a list of 1, one for each agent"),
        ("place_weight", [0.0, 0.0, 0.0], "agents 1, 2, 3 has none"),
        ("place_weight", [1.0, -1.0, 0.0], "not negative"),
        ("edge_weight", 0.0, "positive and finite"),
        ("edge_weight", [1.0], "2, one for each edge"),
        ("desired_offset", np.zeros((3, 2)), "2 times .* one for each edge"),
        ("links", [(0, 0)], "joins two agents"),
        ("link_length", [1.0, 0.0], "positive and finite"),
        ("link_length", [1.0], "2, one for each link"),
    ],
)
def test_bad_numbers(key, bad, words):
    assert formation_game(**GOOD).constraints_count == 5
    with pytest.raises(InvalidInput, match=words) as caught:
        formation_game(**{**GOOD, key: bad})
    assert caught.value.key == ("place_weight" if "has none" in words else key)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"region": {"radius": -1.0}}, r"systems\.s\.game\.region\.radius: got -1\.0, but it must"),
        ({"region": {}}, r"systems\.s\.game\.region: nothing is given, but it needs a box"),
        ({"region": {"bax": [[0, 0], [1, 1]]}}, "did you mean 'box'"),
        ({"region": {"box": [[0, 0, 0], [1, 1]]}}, r"game\.region\.box"),
        ({"links": [[1, 5]]}, r"systems\.s\.game\.links: got \[1, 5\], but agents are numbered"),
        ({"edges": "stern"}, r"game\.edges"),
        ({"place_weight": [1.0]}, r"systems\.s\.game\.place_weight: .* a list of 3"),
        ({"desired_place": [[0.0, 0.0]]}, r"systems\.s\.game\.desired_place: .* list 3 times"),
    ],
)
def test_bad_numbers_in_a_scenario_name_the_key(changes, words):
    game = {"type": "formation", **changes}
    tables = {"systems": {"s": {"game": game, "agents": {"type": "integrator", "count": 3}}}}
    with pytest.raises(InvalidInput, match=words):
        load_scenario(tables).simulation_object()
