"""Games from expressions against hand-written kernels, differences and refusals."""

import inspect
import math
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from expression_games import PAIRS, energy
from random_expressions import RandomGame, hyper_dual

import gne_mj as gm
from gne_mj import game_functions
from gne_mj.errors import GneError, InvalidInput, UserCodeError
from gne_mj.expressions import fixed, game
from gne_mj.expressions.llvm import llvm
from gne_mj.expressions.operators import FUNCTIONS
from gne_mj.expressions.table import ExpressionsTable
from gne_mj.scenario import load_scenario


def _interior(game, rng):
    """A random profile; OSNR's powers are positive."""
    y = rng.uniform(0.1, 1.0, game.actions)
    return y if game.name == "OSNR" else 3.0 * rng.normal(size=game.actions)


def _agree(got, expected):
    np.testing.assert_allclose(got, expected, rtol=1e-12, atol=1e-12 * np.max(np.abs(expected)))


@pytest.mark.parametrize("name", PAIRS)
def test_the_same_numbers_as_hand_written_kernels(name):
    own, shipped = PAIRS[name]()
    rng = np.random.default_rng(3)
    assert [sorted(a) for a in own.in_cost] == [sorted(a) for a in shipped.in_cost]
    assert [sorted(a) for a in own.in_constraint] == [sorted(a) for a in shipped.in_constraint]
    assert own.affine == shipped.affine
    assert own.constraint_class == shipped.constraint_class
    assert own.smooth
    assert own.affine_constraints == shipped.affine_constraints
    if shipped.gap_bounds is not None:
        _agree(own.gap_bounds, shipped.gap_bounds)
    np.testing.assert_allclose(own.box, shipped.box, rtol=1e-8, atol=2e-7)
    for _ in range(30):
        y = _interior(shipped, rng)
        weights = rng.uniform(0.1, 1.0, shipped.constraints_count)
        for method in ("costs", "pseudo_gradient", "constraints", "pseudo_gradient_jacobian",
                       "constraint_jacobian"):  # fmt: skip
            _agree(getattr(own, method)(y), getattr(shipped, method)(y))
        _agree(
            own.weighted_constraint_hessian(y, weights),
            shipped.weighted_constraint_hessian(y, weights),
        )


def random_error(seed):
    """The worst relative error of a random game's six functions against hyper-dual numbers."""
    drawn = RandomGame(seed)
    made = game(drawn.count, drawn.cost, drawn.constraints, near=fixed(drawn.near), **drawn.numbers)
    q, y, p, kernels = made.parameters, drawn.y, drawn.plain(), made.kernels
    errors = []

    def compare(got, expected):
        errors.append(abs(got - expected) / (1.0 + abs(expected)))

    for i in range(drawn.count):
        row = np.zeros(drawn.count)
        kernels.add_cost_hessian(q, i, i, y, 1.0, row)
        compare(kernels.cost(q, i, y), drawn.cost(i, y, p))
        for b in range(drawn.count):
            _, first, second = hyper_dual(lambda z, i=i: drawn.cost(i, z, p), y, i, b)
            compare(row[b], second)
        compare(kernels.cost_gradient(q, i, i, y), first)
        for a in made.in_constraint[i]:
            for b in made.in_constraint[i]:
                f, first, second = hyper_dual(lambda z, i=i: drawn.g(i, z, p), y, a, b)
                compare(kernels.constraint_hessian(q, i, a, b, y), second)
            compare(kernels.constraint(q, i, y), f)
            compare(kernels.constraint_gradient(q, i, a, y), first)
        for a in set(range(drawn.count)) - set(made.in_constraint[i]):
            compare(hyper_dual(lambda z, i=i: drawn.g(i, z, p), y, a, a)[1], 0.0)
    return max(errors)


@pytest.mark.parametrize("seed", range(12))
def test_random_games_have_the_derivatives_of_hyper_dual_numbers(seed):
    assert random_error(seed) < 1e-11


@pytest.mark.slow
def test_two_hundred_random_games():
    assert max(random_error(seed) for seed in range(200)) < 1e-11


@pytest.mark.parametrize("seed", range(3))
def test_machine_code_of_random_games_computes_what_their_kernels_say(seed):
    drawn = RandomGame(seed)
    made = game(drawn.count, drawn.cost, drawn.constraints, near=fixed(drawn.near), **drawn.numbers)
    q, y, kernels, each = made.parameters, drawn.y, made.kernels, range(drawn.count)
    rows = np.zeros((drawn.count, drawn.count))
    for i in each:
        kernels.add_cost_hessian(q, i, i, y, 1.0, rows[i])
    _agree(made.pseudo_gradient_jacobian(y), rows)
    _agree(made.costs(y), [kernels.cost(q, i, y) for i in each])
    gradients = np.zeros(drawn.count)
    kernels.pseudo_gradient(q, y, gradients)
    _agree(gradients, [kernels.cost_gradient(q, i, i, y) for i in each])
    _agree(made.pseudo_gradient(y), gradients)
    _agree(made.constraints(y), [kernels.constraint(q, k, y) for k in each])
    slopes = made.constraint_jacobian(y)
    for k, own in enumerate(made.in_constraint):
        _agree(slopes[k, own], [kernels.constraint_gradient(q, k, a, y) for a in own])
        bends = [[kernels.constraint_hessian(q, k, a, b, y) for b in own] for a in own]
        _agree(made.constraint_hessian(k, y), bends)


def test_what_all_costs_share_is_formed_once_for_all():
    def cost(i, y, p):  # of two kinds
        others = (y**2).sum()
        return y[i] * y.mean() * others if i % 3 else p.price * y[i] * others

    made = game(7, cost, lambda y, p: [y <= 9.0], price=2.0)
    text = inspect.getsource(made.kernels)
    first = text.index("def pseudo_gradient")
    before, loop = text[first : text.index("\n\n", first)].split("    for i in range(7):")
    assert before.count("for k") == 2
    assert "for k" not in loop
    y = np.linspace(-1.0, 2.0, 7)
    mean, others, odd = y.mean(), (y**2).sum(), np.arange(7) % 3 > 0
    expected = np.where(
        odd, mean * others + y * others / 7 + 2 * y**2 * mean, 2 * (others + 2 * y**2)
    )
    _agree(made.pseudo_gradient(y), expected)
    some = np.full(7, np.nan)  # in a solver agents may be held
    game_functions.gradients(made.data, np.array([1, 4]), y, some)
    _agree(some[[1, 4]], expected[[1, 4]])
    assert np.isnan(some[[0, 2, 3, 5, 6]]).all()


def test_a_closed_loop_that_forms_sums_once_is_that_of_hand_written_kernels():
    start = np.linspace(0.5, 1.5, 6)
    own, hand = (
        gm.run(each, agents=gm.pi_cascades(6), start=start, duration=0.2) for each in energy()
    )
    _agree(own.data["action"].to_numpy(), hand.data["action"].to_numpy())


def test_machine_code_has_every_function_of_numpy_that_formulas_have():
    inside, names = ("arcsin", "arccos", "arctanh"), sorted(set(FUNCTIONS) - {"abs"})
    powers = (
        lambda y, p: (2.0 + y) ** p.power,
        lambda y, p: (2.0 + y) ** -3,
        lambda y, p: abs(y - 0.1) + p.base**y,
        lambda y, p: y**7 - 2 * y**2,
    )

    def cost(i, y, p):
        if i < len(powers):
            return powers[i](y[i], p) / (2.0 + y[i - 1])
        name = names[i - len(powers)]
        return getattr(np, name)(0.1 * y[i] if name in inside else 1.1 + y[i])

    numbers = {"power": 2.5, "base": 1.7}
    plain, count = SimpleNamespace(**numbers), len(names) + len(powers)
    made, y = game(count, cost, lower=-1.0, upper=3.0, **numbers), np.linspace(0.2, 1.3, count)
    _agree(made.costs(y), [cost(i, y, plain) for i in range(count)])
    for i, at in enumerate(np.eye(count) * 1e-5):
        slope = (cost(i, y + at, plain) - cost(i, y - at, plain)) / 2e-5
        assert made.pseudo_gradient(y)[i] == pytest.approx(slope, rel=1e-7)


def test_machine_code_of_what_kernels_never_have_is_refused():
    with pytest.raises(NotImplementedError, match="While"):
        llvm("def cost(q, i, y):\n    while i > 0:\n        pass\n")


def test_the_energy_game_says_what_it_is():
    made, _ = energy()
    assert made.affine
    assert made.constraint_class == "quadratic"
    assert made.constraint_names == ("energy", *(f"gap {i}" for i in range(6)))
    assert [sorted(members) for members in made.in_constraint[1:3]] == [[0, 5], [0, 1]]
    assert {q.name: q.each for q in made.quantities} == {"energy_value": "", "gap_value": "agent"}
    y = np.linspace(-1.0, 1.0, 6)
    total, gaps = (q.at(y[None], made.entries(q))[0] for q in made.quantities)
    assert total == pytest.approx(np.sum(y**2))
    np.testing.assert_allclose(gaps, y - np.roll(y, 1))
    np.testing.assert_allclose(made.box[1], np.sqrt(30.0), rtol=1e-8)


def test_changed_numbers_keep_the_machine_code():
    def cost(i, y, p):
        return p.weight[i] * y[i] ** 2

    def constraints(y, p):
        yield "total", y.sum() <= p.most

    first = game(3, cost, constraints, weight=[1.0, 2.0, 3.0], most=1.0)
    second = game(3, cost, constraints, weight=[5.0, 2.0, 4.0], most=7.0)
    assert first.kernels is second.kernels


def _branch(i, y, p):
    if y[i] > 0:
        return y[i] ** 2
    return y[i]


def _least(i, y, p):
    return min(y[i], y[0])


def _math(i, y, p):
    return math.sin(y[i])


def _misspelt(i, y, p):
    return p.weigth * y[i]


def _nothing(i, y, p):
    y[i] ** 2


@pytest.mark.parametrize(
    ("cost", "words"),
    [
        (_branch, "a branch on the actions"),
        (_least, "a branch on the actions"),
        (_math, "write np.sin for math.sin"),
        (_misspelt, "did you mean 'weight'?"),
        (_nothing, "a cost is one number, not None"),
    ],
)
def test_what_cannot_be_traced_is_refused_with_file_and_line(cost, words):
    line = cost.__code__.co_firstlineno + (cost is not _nothing)
    with pytest.raises(UserCodeError, match=re.escape(words)) as refused:
        game(2, cost, lambda y, p: [y <= 1.0], weight=1.0)
    if cost is not _nothing:
        assert f"test_expressions.py, line {line}, in {cost.__name__}: " in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    ("relation", "words"),
    [
        (lambda y, p: 0 < y[0] < 1, "a branch on the actions"),
        (lambda y, p: y[0] == 1.0, "an equality has no inside"),
        (lambda y, p: abs(y[0]) >= 1.0, "two separate sets"),
        (lambda y, p: abs(y[0]) <= -1.0, "must be positive"),
        (lambda y, p: p.one <= 2.0, "contains no action"),
        (lambda y, p: y[0], "is a comparison such as a <= b"),
    ],
)
def test_constraints_that_are_none_are_refused(relation, words):
    with pytest.raises(UserCodeError, match=re.escape(words)):
        game(2, lambda i, y, p: y[i] ** 2, lambda y, p: [relation(y, p)], one=1.0)


def _table(**more):
    given = {
        "type": "expressions",
        "cost": "0.5 * weight[i] * (y[i] - p.wanted[i])**2 + price * y[i] * y.mean()",
        "constraints": {
            "energy": "sum(y[j]**2 for j in range(N)) <= budget",
            "gap": "abs(y[i] - y[i-1]) <= gap if i > 0 else None",
        },
        "parameters": {
            "weight": 1.0, "wanted": [1.0, 2.0, 3.0], "price": 0.2, "budget": 5.0, "gap": 2.0,
        },
    }  # fmt: skip
    return ExpressionsTable(**{**given, **more})


def test_texts_are_the_game_of_the_functions():
    made = _table().build(3)
    assert made.constraint_names == ("energy", "gap 2", "gap 3")
    y, q = np.array([0.3, -0.2, 0.5]), made.parameters
    wanted, k = np.array([1.0, 2.0, 3.0]), made.kernels
    for i in range(3):
        expected = y[i] - wanted[i] + 0.2 * (np.mean(y) + y[i] / 3)
        assert k.cost_gradient(q, i, i, y) == pytest.approx(expected, rel=1e-14)
    assert k.constraint(q, 0, y) == pytest.approx(np.sum(y**2) - 5.0)
    assert k.constraint(q, 2, y) == pytest.approx(0.7**2 - 4.0)


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("cost", "().__class__", "numbers have no '__class__'"),
        ("cost", "open('x')", "'open' is no parameter"),
        ("cost", "y[i] +", "it must be a formula"),
        ("cost", "(lambda: 1)()", "a formula has no"),
        ("cost", "p._known", "numbers have no '_known'"),
        ("constraints", {"a": "y[i] <= 'b'"}, "'b' is no real number"),
        ("parameters", {"y": 1.0}, "means something else"),
        ("file", "energy.py", "either a file, or cost and constraints"),
    ],
)
def test_texts_that_are_no_formulas_are_refused(key, value, words):
    with pytest.raises(InvalidInput, match=re.escape(words)):
        _table(**{key: value}).build(3)


@pytest.mark.parametrize("name", ["energy", "texts"])
def test_the_example_converges_inside(name):
    folder = Path(__file__).parents[1] / "examples" / "expressions"
    changes = {"simulation.duration": 0.2}
    run = load_scenario(folder / f"{name}.toml", changes).simulation_object().run()
    data = run["robots"]
    assert float(np.max(np.abs(data["gap_value"]))) < 2.0
    assert float(np.max(data["energy_value"])) < 12.0


@pytest.mark.parametrize("seed", range(6))
def test_bounds_of_slopes_hold_over_a_box(seed):
    drawn = RandomGame(seed)
    made = game(drawn.count, drawn.cost, drawn.constraints, near=fixed(drawn.near), **drawn.numbers)
    if made.affine:
        return
    rng = np.random.default_rng(seed)
    lower, upper = made.jacobian_bounds((drawn.y - 0.05, drawn.y + 0.05))
    assert np.all(np.isfinite([lower, upper]))
    for _ in range(10):
        y = drawn.y + rng.uniform(-0.05, 0.05, drawn.count)
        slopes = np.zeros((drawn.count, drawn.count))
        for i in range(drawn.count):
            made.kernels.add_cost_hessian(made.parameters, i, i, y, 1.0, slopes[i])
        assert np.all(lower <= slopes)
        assert np.all(slopes <= upper)


def test_bounds_of_slopes_of_osnr_are_those_that_its_author_found():
    own, shipped = PAIRS["osnr"]()
    for got, expected in zip(
        own.jacobian_bounds(shipped.box), shipped.jacobian_bounds(shipped.box), strict=True
    ):
        np.testing.assert_allclose(got, expected, rtol=1e-9)


def test_a_constraint_on_one_entry_of_an_action_has_no_slope_in_the_others():
    made = game(
        2,
        lambda i, y, p: (y[i] ** 2).sum() + y[0, 1] * y[1, 0],
        lambda y, p: [y[1] <= p.most, y[0, 0] ** 2 * y[1, 1] <= 5.0],
        dimension=2,
        most=[1.0, 2.0],
    )
    y = np.array([0.3, 0.4, -0.2, 0.6])
    slopes = made.constraint_jacobian(y)
    np.testing.assert_array_equal(slopes[:2], [[0, 0, 1, 0], [0, 0, 0, 1]])
    np.testing.assert_allclose(slopes[2], [2 * 0.3 * 0.6, 0.0, 0.0, 0.09])
    bend = np.zeros((4, 4))
    bend[0, 0], bend[0, 3], bend[3, 0] = 1.2, 0.6, 0.6
    np.testing.assert_allclose(made.constraint_hessian(2, y), bend)
    np.testing.assert_allclose(
        made.pseudo_gradient_jacobian(y), 2 * np.eye(4) + np.diag([0, 1, 0], 1)
        + np.diag([0, 1, 0], -1)
    )  # fmt: skip


def test_actions_of_different_sizes():
    made = game(
        3,
        lambda i, y, p: np.sum((y[i] - 1.0) ** 2) + y[0] * y[2].sum(),
        lambda y, p: {"one": y[0] + y[1].sum() <= 3.0, "two": y[2] <= p.most},
        dimension=[1, 2, 3],
        most=2.0,
    )
    y = np.linspace(0.1, 0.6, 6)
    expected = 2.0 * (y - 1.0) + np.array([y[3:].sum(), 0, 0, y[0], y[0], y[0]])
    np.testing.assert_allclose(made.pseudo_gradient(y), expected)
    np.testing.assert_array_equal(made.constraint_jacobian(y)[2], [0, 0, 0, 0, 1, 0])
    assert made.constraint_names == ("one", "two 1", "two 2", "two 3")


def test_what_nests_too_deeply_is_refused():
    def cost(i, y, p):
        value = y[i]
        for _ in range(3000):
            value = np.sin(value) + 1.0
        return value

    with pytest.raises(InvalidInput, match="must not nest"):
        game(2, cost, lambda y, p: [y <= 1.0])


def test_little_is_lost_close_to_a_bound():
    made = game(2, lambda i, y, p: y[i] ** 2, lambda y, p: [abs(y[0] - y[1]) <= p.gap], gap=0.1)
    y = np.array([1000.1 - 1e-11, 1000.0])
    gap = y[0] - y[1]  # exact
    assert made.kernels.constraint(made.parameters, 0, y) == (gap - 0.1) * (gap + 0.1)


def test_a_number_that_nothing_reads_is_refused():
    def cost(i, y, p):
        return p.price * y[i] ** 2

    def constraints(y, p):
        yield y.sum() <= 1.0

    with pytest.raises(
        InvalidInput, match=r"prise: got 3\.0, but no formula reads it; did you mean"
    ):
        game(2, cost, constraints, price=1.0, prise=3.0)
    assert game(2, cost, constraints, price=1.0, edges=fixed([(0, 1)])).agents == 2


@pytest.mark.parametrize("bound", [-1.0, 0.0])
def test_a_bound_without_an_inside_is_refused(bound):
    def constraints(y, p):
        yield "energy", (y**2).sum() <= p.budget

    with pytest.raises(InvalidInput, match=f"'energy', but it has no inside.* {bound:g}"):
        game(2, lambda i, y, p: y[i] ** 2, constraints, budget=bound)


def test_names_that_differ_in_numbers_are_one_figure_without_their_ends():
    def constraints(y, p):
        for i in range(len(y)):
            yield f"gap {i}-{i + 1}", abs(y[i] - y[i - 1]) <= 1.0

    (gaps,) = game(3, lambda i, y, p: y[i] ** 2, constraints).quantities
    assert (gaps.name, gaps.long_name) == ("gap_value", "gap")


@pytest.mark.parametrize(
    ("cost", "words"),
    [
        ("y[i]**2 if y[i] > 0 else y[i]", "cost: .*a branch on the actions"),
        ("y[i + 1]**2", "cost: .*for agent 2: NoEntry: an array of 2 has no entry \\[2\\]"),
    ],
)
def test_what_a_text_does_is_told_by_its_key(cost, words):
    table = ExpressionsTable(
        type="expressions", cost=cost, constraints={"all": "y.sum() <= 1"}
    )  # fmt: skip
    with pytest.raises(InvalidInput, match=words):
        table.build(2)


LINKS = [(0, 1), (1, 2)]


def _linked(y, p):
    for k, (i, j) in enumerate(LINKS):
        yield f"link {k}", y[i] + y[j] <= p.most[k]
    if p.kind[0] > 0:  # read as well, though no formula has it
        yield p.matrix @ y <= p.right


def _lists(**changed):
    given = {"weight": [1.0, 2.0, 3.0], "most": [1.0, 2.0], "matrix": np.ones((2, 3)),
             "right": [1.0, 2.0], "kind": [1.0], **changed}  # fmt: skip
    # the first agent has no use for its weight
    return game(3, lambda i, y, p: (p.weight[i] if i else 1) * y[i] ** 2, _linked, **given)


def test_lists_have_as_many_entries_as_formulas_read():
    assert _lists().agents == 3  # for each agent, link, row, column and one


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"weight": [1.0] * 4}, r"weight: .*no formula reads its entries \[0\], \[3\] "),
        ({"weight": [1.0] * 2}, r"weight: .*line \d+, in <lambda>, reads its entry \[2\] \(from 0\)"
                                " for agent 3, and it has 2; with one for each agent it has 3"),
        ({"most": [1.0] * 4}, r"most: .*entries \[2\], \[3\] .*it has 4 and must have 2$"),
        ({"most": [1.0]}, r"most: got \[1.0\], but .* in _linked, reads its entry \[1\]"),
        ({"kind": [1.0, 2.0]}, r"kind: .*reads its entry \[1\] .* must have 1$"),
        ({"matrix": np.ones((2, 4))}, "@ of 'matrix' of 2x4 and an array of 3"),
        ({"right": [1.0] * 4}, "an array of 2 and 'right' of 4 do not go together"),
    ],
)  # fmt: skip
def test_lists_of_other_lengths_are_refused_by_name(changed, words):
    with pytest.raises(GneError, match=words):
        _lists(**changed)


def test_columns_that_no_formula_reads_are_refused():
    def cost(i, y, p):
        return p.pairs[i][0] * y[i] ** 2

    with pytest.raises(InvalidInput, match=r"entry \[:, 1\] .*it has 3x2 and must have 1 there"):
        game(3, cost, upper=1.0, pairs=np.ones((3, 2)))


def test_a_list_of_a_scenario_is_told_by_its_key():
    file = Path(__file__).parents[1] / "examples" / "expressions" / "texts.toml"
    scenario = load_scenario(file, {"game.parameters.wanted": [1.0, 2.0]})
    with pytest.raises(InvalidInput, match=r"systems\.robots\.game\.parameters\.wanted: got"):
        scenario.system_objects()
