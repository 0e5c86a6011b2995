"""Bounds of actions, bands for equalities, and constraints of some agents alone."""

import re
from dataclasses import replace

import numpy as np
import pytest
from builders import integrators

from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.controllers.settings import GUARDED
from gne_mj.equality import Equality, multipliers
from gne_mj.equilibrium import (
    best_response,
    measured_epsilon,
    middle,
    penalised_equilibrium,
    variational_equilibrium,
)
from gne_mj.errors import InvalidInput, UserCodeError
from gne_mj.expressions import band, game, private
from gne_mj.expressions.table import ExpressionsTable
from gne_mj.graph import complete
from gne_mj.optimality import examine
from gne_mj.simulation import Simulation
from gne_mj.solutions import solve_system, summary
from gne_mj.system import Clock, System
from gne_mj.system.first_input import law_at_start
from gne_mj.theory.guarantees import certify
from gne_mj.viewer.shares import shares


def cost(i, y, p):
    return (y[i] - p.wanted[i]) ** 2 + 0.1 * y[i] * y.sum()


def boxed(lower, upper, **given):
    return game(2, cost, lower=lower, upper=upper, wanted=[1.0, 2.0], **given)


def test_bounds_of_actions_are_constraints_and_curves():
    made = boxed(0.5, [0.8, np.inf], action_name="speed", action_unit="m/s", agent_name="robot")
    assert made.constraint_names == (
        "lower bound of robot 1", "lower bound of robot 2", "upper bound of robot 1",
    )  # fmt: skip
    y = np.array([0.7, 0.9])
    np.testing.assert_allclose(made.constraints(y), [-0.2, -0.4, -0.1])
    assert made.constraint_class == "affine"
    (curve,) = made.quantities
    assert (curve.name, curve.long_name, curve.unit) == ("bounded_action", "speed", "m/s")
    np.testing.assert_array_equal(curve.at(y[None], (2,)), [y])
    bounds = curve.bounds((2,))
    np.testing.assert_array_equal(bounds["bounded_action_bound"], [0.8, np.nan])
    np.testing.assert_array_equal(bounds["bounded_action_lower_bound"], [0.5, 0.5])
    used = shares(made, {"action": y[None], "bounded_action": y[None]})
    np.testing.assert_allclose(used[0, 0], 1 / 3)  # 0.05 of 0.15 above the middle
    y = variational_equilibrium(made, [0.7, 0.9]).action
    np.testing.assert_allclose(y, [0.8, (4.0 - 0.08) / 2.2], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("sizes", "given", "expected"),
    [
        (2, 3.0, [3, 3, 3, 3]), (2, [3.0, 4.0], [3, 3, 4, 4]), (2, [1.0, 2, 3, 4], [1, 2, 3, 4]),
        (2, [[1.0, 2], [3, 4]], [1, 2, 3, 4]), ([1, 3], [3.0, 4.0], [3, 4, 4, 4]),
    ],
)  # fmt: skip
def test_bounds_for_all_agents_or_entries(sizes, given, expected):
    made = game(2, lambda i, y, p: (y[i] ** 2).sum(), upper=given, dimension=sizes)
    np.testing.assert_allclose(made.constraints(np.zeros(4)), -np.array(expected, float))
    curves = np.concatenate([
        np.ravel(q.bounds(made.entries(q))[f"{q.name}_bound"]) for q in made.quantities
    ])  # fmt: skip
    assert sorted(curves) == sorted(expected)


@pytest.mark.parametrize(
    ("lower", "upper", "words"),
    [
        (1.0, 1.0, "lower: got 1.0, but it must be below upper, 1"),
        ([0.0, 1.0, 2.0], None, "one for each of 2 agents"),
        ("none", None, "one for each of 2 agents"),
        (np.nan, None, "-inf is for no bound"),
        (None, -np.inf, "inf is for no bound"),
        (None, None, "at least one constraint"),
    ],
)
def test_bounds_that_make_no_sense_are_refused(lower, upper, words):
    with pytest.raises(InvalidInput, match=re.escape(words)):
        boxed(lower, upper)


def test_changed_bounds_keep_the_machine_code():
    assert boxed(0.0, 1.0).kernels is boxed(-3.0, [5.0, 6.0]).kernels


def table(**given):
    text = {"type": "expressions", "cost": "(y[i] - 1.0)**2"}
    return ExpressionsTable(**{**text, **given})


def test_bounds_in_a_table():
    made = table(lower=0.0, upper=[1.0, "none"]).build(2)
    assert len(made.constraint_names) == 3
    with pytest.raises(InvalidInput, match="cost and constraints"):
        table().build(2)
    with pytest.raises(InvalidInput, match="that name means something else of a game"):
        table(lower=0.0, parameters={"upper": 1.0}).build(2)


def test_private_and_band_in_texts():
    texts = {"own": "private(i, y[i] + y[i-1] <= 1.0)", "total": "band(y.sum(), 0.5, 0.01)"}
    made = table(constraints=texts).build(3)
    assert made.owned_by[:3] == [[0], [1], [2]]
    assert [each.name for each in made.equalities] == ["total"]


def test_the_multiplier_of_an_equality():
    """min (y_0 - 1)^2, min (y_1 - 2)^2, y_0 + 2 y_1 = 3: y = w - mu (1, 2) / 2."""
    for width in (1e-3, 1e-6):
        made = game(
            2, lambda i, y, p: (y[i] - [1.0, 2.0][i]) ** 2,
            lambda y, p, w=width: [("plane", band(y[0] + 2 * y[1], 3.0, w))],
        )  # fmt: skip
        found = variational_equilibrium(made, [1.0, 1.0])
        (mu,) = multipliers(made.equalities, found.action, found.multipliers)
        assert mu == pytest.approx(0.8, abs=width)
        np.testing.assert_allclose(found.action, [0.6, 1.2], rtol=0, atol=width)
        # of the two sides, at any rho: rho / (w - e) - rho / (w + e)
        found = penalised_equilibrium(made, 0.1 * width, [1.0, 1.0])
        error = found.action @ [1.0, 2.0] - 3.0
        (mu,) = multipliers(made.equalities, found.action, found.multipliers)
        sides = 0.1 * width / (width - error) - 0.1 * width / (width + error)
        assert mu == pytest.approx(sides, rel=1e-6)


def test_the_report_has_the_multiplier_of_an_equality():
    made = game(
        2, lambda i, y, p: (y[i] - i) ** 2, lambda y, p: [("sum", band(y.sum(), 3.0, 1e-4))]
    )
    own = system(made, [1.5, 1.5], FullInformation())
    solution = solve_system(own)
    (told,) = solution.to_dict()["variational"]["equalities"]
    assert told["multiplier"] == pytest.approx(-2.0, abs=1e-3)
    assert told["error"] == pytest.approx(-1e-4, rel=1e-6)
    assert any("equality" in line and "multiplier -1.999" in line for line in summary(solution))


@pytest.mark.parametrize(
    ("constraint", "error", "words"),
    [
        (lambda y: y.sum() == 1.0, UserCodeError, "write band(a, b, width)"),
        (lambda y: band(y[0], 1.0, y[1]), UserCodeError, "the width of a band is a number"),
        (lambda y: band(y[0], 1.0, 0.0), UserCodeError, "must be positive"),
        (lambda y: private(0, private(1, y[0] <= 1)), UserCodeError, "private twice"),
        (lambda y: private("x", y[0] <= 1), UserCodeError, "an agent's number from 0"),
        (lambda y: private(True, y[0] <= 1), UserCodeError, "an agent's number from 0"),
        (lambda y: private(1, y[0] <= 1), InvalidInput, "private to agent 2, counted from 1"),
        (lambda y: private(7, y[0] <= 1), InvalidInput, "private to agent 8"),
    ],
)
def test_declarations_that_make_no_sense_are_refused(constraint, error, words):
    with pytest.raises(error, match=re.escape(words)):
        game(2, lambda i, y, p: y[i] ** 2, lambda y, p: [constraint(y)])


# ----------------------------------------------------------------- private constraints

A = np.array([[3.0, 0.4, -0.3], [0.2, 2.5, 0.5], [0.1, -0.6, 2.0]])
B = np.array([-4.0, -2.0, -5.0])


def trio():
    """Three players: a circle that is shared, and two constraints of one agent each."""

    def cost(i, y, p):
        return y[i] * (A[i] @ y - 0.5 * A[i, i] * y[i] + B[i])

    def constraints(y, p):
        yield "circle", (y**2).sum() <= 4.0
        yield "first", private(0, y[0] + y[1] ** 2 <= 1.2)
        yield "third", private(2, y[0] ** 2 + y[1] + y[2] <= 1.0)

    return game(3, cost, constraints)


OWNERS = np.array([[1, 1, 1], [1, 0, 0], [0, 0, 1]])


def g(y):
    return np.array([y @ y - 4.0, y[0] + y[1] ** 2 - 1.2, y[0] ** 2 + y[1] + y[2] - 1.0])


def slopes(y):
    return np.array([2 * y, [1.0, 2 * y[1], 0.0], [2 * y[0], 1.0, 1.0]])


def barrier(y, rho):
    """Each agent's gradient of its own barrier."""
    return (rho / -g(y)) @ (slopes(y) * OWNERS)


def test_each_agent_feels_its_own_constraints_only():
    made, rng = trio(), np.random.default_rng(1)
    assert made.owned_by == [[0, 1, 2], [0], [2]]
    assert made.private == (1, 2)
    rho = 0.05
    for _ in range(5):
        y = rng.uniform(-0.5, 0.5, 3)
        pull = A @ y + B
        own = system(made, y, FullInformation())
        np.testing.assert_allclose(law_at_start(own), -pull - barrier(y, rho), rtol=1e-12)
        np.testing.assert_allclose(own.barrier.gradient(y), barrier(y, rho), rtol=1e-12)
        h = 1e-6
        numeric = [(barrier(y + h * e, rho) - barrier(y - h * e, rho)) / (2 * h) for e in np.eye(3)]
        np.testing.assert_allclose(own.barrier.hessian(y), np.transpose(numeric), atol=1e-7)


@pytest.mark.parametrize("law", ["partial", "distributed"])
def test_laws_with_estimates_feel_their_own_constraints_only(law):
    """Estimates, with which agents see costs and, fully distributed, barriers."""
    made, rng, rho = trio(), np.random.default_rng(2), 0.05
    y = rng.uniform(-0.5, 0.5, 3)
    seen = y + rng.uniform(-0.1, 0.1, (3, 3))
    at = seen.copy()
    np.fill_diagonal(at, y)
    pull = np.array([A[i] @ at[i] + B[i] for i in range(3)])
    if law == "partial":
        own = system(made, y, PartialInformation(complete(3), 2.0), seen)
        apart = np.array([sum(y[i] - at[j, i] for j in range(3)) for i in range(3)])
        expected = -pull - barrier(y, rho) - 2.0 * apart
    else:
        own = system(made, y, FullyDistributed(complete(3), 0.01, 3.0), seen)
        expected = -3.0 * (pull + np.array([barrier(at[i], rho)[i] for i in range(3)]))
    np.testing.assert_allclose(law_at_start(own), expected, rtol=1e-12)


def test_a_game_with_private_constraints_is_solved():
    made = trio()
    rho, start = 1e-3, np.zeros(3)
    y = penalised_equilibrium(made, rho, start).action
    np.testing.assert_allclose(A @ y + B + barrier(y, rho), 0.0, atol=1e-9)
    found = variational_equilibrium(made, start)
    y, pushes = found.action, found.multipliers @ (slopes(found.action) * OWNERS)
    np.testing.assert_allclose(A @ y + B + pushes, 0.0, atol=1e-9)
    assert np.all(found.multipliers * g(y) > -1e-9)
    assert found.multipliers[1] > 0.1  # and binds agent 1, whom agent 2 pushes with its y_2
    assert np.max(measured_epsilon(made, y)) < 1e-8
    np.testing.assert_allclose(best_response(made, 1, y).action, y, rtol=0, atol=1e-5)
    assert examine(made, found).not_minima == ()
    shared = replace_owners(made)
    other = variational_equilibrium(shared, start).action
    assert np.max(np.abs(other - y)) > 0.01
    assert np.all(g(middle(made, np.zeros(3))) < 0.0)


def replace_owners(made):
    """The same game, all of whose constraints are shared."""
    return replace(made, owners=None)


def test_private_constraints_are_not_certified():
    own = system(trio(), np.zeros(3), FullInformation())
    found = certify(own, Clock(1.0, 0.01, 0.01, 0.1))
    assert found.status == "not certified"
    (first,) = [a for a in found.theorem["assumptions"] if a["label"] == "eq:GNE"]
    assert first["status"] == "not met"
    assert first["why"].startswith("2 of 3 constraints are private ('first', 'third')")
    assert not found.lyapunov_claimed
    # what agents can gain is bounded by their own constraints all the same
    assert found.equilibrium["own_bound"] == pytest.approx([0.1, 0.05, 0.1])
    assert own.law_settings(own.rho)[GUARDED] == 0.0
    assert system(replace_owners(trio()), np.zeros(3), FullInformation()).law_settings(0.1)[GUARDED]


def test_mode_implicit_refuses_private_constraints():
    with pytest.raises(InvalidInput, match="constraint 'first' is private"):
        system(trio(), np.zeros(3), FullInformation(), mode="implicit")


def test_a_run_tends_to_the_penalised_equilibrium():
    own = system(trio(), np.zeros(3), FullInformation())
    run = Simulation([own], Clock(20.0, 0.01, 0.01, 0.1)).run()
    actions = run["own"]["action"].values
    assert np.all([np.all(g(y) < 0.0) for y in actions])
    y = actions[-1]
    np.testing.assert_allclose(A @ y + B + barrier(y, own.rho), 0.0, atol=1e-5)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("owners", [[0]], "there must be 3, one a constraint"),
        ("owners", [[0, 1, 2], [2], [2]], "some of the agents in the constraint, [0, 1]"),
        ("owners", [[0, 1, 2], [], [2]], "some of the agents in the constraint, [0, 1]"),
        ("owners", [1, 2, 3], "it must list lists of agents' numbers"),
        ("equalities", ["a"], "it must list gne_mj Equalities"),
        ("equalities", (Equality("e", 3, np.sum, 1.0),), "numbered from 0 to 2"),
    ],
)
def test_games_of_kernels_name_owners_that_fit(key, value, words):
    with pytest.raises(InvalidInput, match=re.escape(words)):
        replace(trio(), **{key: value})


def system(made, start, law, estimates=None, **options):
    agents = integrators(made.actions)
    start = np.array(start, float)
    memory = {} if estimates is None else {"memory": law.initial_memory(start, estimates)}
    return System("own", made, agents, law, 0.05, start[:, None], **memory, **options)
