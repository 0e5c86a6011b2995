"""A game that contradicts itself is refused; one that does not never is."""

import json
import math
from dataclasses import replace

import coupled_game
import numpy as np
import own_games
import pytest
from builders import V0, integrators, random_consensus
from commands import gne_here
from hypothesis import given, settings
from hypothesis import strategies as st
from own_games import boxed, coupled
from position_games import random_formation, random_platoon

from gne_mj.controllers import FullInformation
from gne_mj.errors import InvalidInput, UserCodeError
from gne_mj.game_check import examine
from gne_mj.game_check.differences import derivative, steps
from gne_mj.game_model import Game
from gne_mj.games import cournot_game, osnr_game, ten_channels, velocity_game

START = np.array([0.3, -0.4, 0.5, -0.2])


def load(game, start=START):
    """What a scenario's loading does with a game."""
    return own_games.system(game, integrators(len(start)), FullInformation(), start)


def refused(game, start=START):
    with pytest.raises(InvalidInput) as caught:
        load(game, start)
    return caught.value


# --------------------------------------------------------------------------------- differences


@settings(max_examples=200)
@given(
    kind=st.sampled_from(["exp", "sin", "power", "log", "line"]),
    at=st.floats(-3.0, 3.0),
    rate=st.floats(-2.0, 4.0),
    reach=st.floats(-6.0, 0.0),
)
def test_differences_know_their_error(kind, at, rate, reach):
    """Against closed forms, with rates from 0.01 to 10^4 and steps from 1e-6 to 1."""
    k, h = 10.0**rate, steps(10.0**reach)
    f, slope = {
        "exp": (lambda x: math.exp(min(k * x, 600.0)), k * math.exp(min(k * at, 600.0))),
        "sin": (lambda x: math.sin(k * x) + 1e3, k * math.cos(k * at)),
        "power": (lambda x: (k * x) ** 5, 5 * k * (k * at) ** 4),
        "log": (lambda x: math.log(k * (x + 5.0)), 1.0 / (at + 5.0)),
        "line": (lambda x: k * x - 1e6, k),
    }[kind]
    if (kind == "exp" and k * (at + 1.0) > 600.0) or k * h[-1] > 1e-2:
        return  # too steep, or a ripple that no step resolves
    ahead, behind = (np.array([f(at + sign * step) for step in h]) for sign in (1.0, -1.0))
    value, error = derivative(ahead, behind, h)
    assert abs(value - slope) <= 20.0 * error + 1e-9 * abs(slope)


def test_differences_know_what_rounding_does_next_to_a_bound():
    """A disc's bound is there a difference of great numbers, of which short steps see the steps."""
    vague = 0
    for seed in range(3000):
        rng = np.random.default_rng(seed)
        slope, center, radius = rng.uniform([1.0, -0.5, 0.3], [4.0, 0.5, 2.0])
        y = (center + radius * (1.0 - 10.0 ** rng.uniform(-10.0, -8.0))) / slope
        h = steps(0.1 * (1.0 - (slope * y - center) / radius))
        ahead, behind = (
            np.array([(slope * (y + sign * t) - center) ** 2 - radius**2 for t in h])
            for sign in (1.0, -1.0)
        )
        value, error = derivative(ahead, behind, h, around=1.0)
        right = 2.0 * slope * (slope * y - center)
        assert abs(value - right) <= 20.0 * error + 1e-5 * right, seed
        vague += 20.0 * error > 1e-2 * right
    assert vague < 2000


def test_differences_are_accurate_where_functions_are_smooth():
    h = steps(0.5)
    value, error = derivative(np.exp(1 + h), np.exp(1 - h), h)
    assert abs(value - math.e) < 1e-10
    assert error < 1e-9


# --------------------------------------------------------------------------- mistakes are found


def scaled(name, factor):
    kernel = getattr(coupled_game, name)
    return {name: lambda *given: factor * kernel(*given)}


def forgets_cross_term(q, i, a, y, scale, out):
    out[a] += scale * (1.0 + 3.0 * q[0] * y[a] ** 2)


def overwrites(q, i, a, y, scale, out):
    row = np.zeros(4)
    coupled_game.add_cost_hessian(q, i, a, y, scale, row)
    out[:] = row


def ignores_scale(q, i, a, y, scale, out):
    coupled_game.add_cost_hessian(q, i, a, y, 1.0, out)


MISTAKES = {
    "cost": (scaled("cost", 1.001), "cost_gradient", "dJ_"),
    "cost_gradient": (scaled("cost_gradient", 1.001), "cost_gradient", "difference quotient of"),
    "cross term": ({"add_cost_hessian": forgets_cross_term}, "add_cost_hessian", "dy_"),
    "constraint_gradient": (scaled("constraint_gradient", 0.999), "constraint_gradient", "dg_"),
    "constraint_hessian": (scaled("constraint_hessian", -1.0), "constraint_hessian", "d2g_"),
    "overwrites": ({"add_cost_hessian": overwrites}, "add_cost_hessian", "must add"),
    "ignores scale": ({"add_cost_hessian": ignores_scale}, "add_cost_hessian", "must add"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_in_functions_are_refused(mistake):
    changed, key, said = MISTAKES[mistake]
    error = refused(coupled(changed))
    assert error.key == f"game.{key}"
    assert said in error.expected
    assert not examine(coupled(changed), START).holds


def test_the_wrong_entry_is_named():
    """d2J_i/dy_a dy_b = 0.1 (a + b + 1) cos y_b, which this game forgets."""
    error = refused(coupled({"add_cost_hessian": forgets_cross_term}))
    a, b = (int(part.split()[0]) - 1 for part in error.expected.split("/dy_")[1].split(" dy_"))
    there = [float(v) for v in error.expected.split("y = [")[1].rstrip("]").split(",")]
    missing = 0.1 * (a + b + 1) * np.cos(there[b])
    assert error.value == 0.0
    assert f"cost_gradient is {missing:.4g}" in error.expected.replace("00,", ",") or (
        abs(float(error.expected.split("cost_gradient is ")[1].split(",")[0]) - missing) < 1e-4
    )


def test_lists_that_leave_out_an_agent_are_refused():
    error = refused(coupled(in_cost=[(0, 1), (0, 1, 2), (0, 1, 2)]))
    assert error.key == "game.in_cost"
    assert "of agent 1" in error.expected
    assert "agent 3" in error.expected
    # also where no second derivatives are given
    bare = refused(coupled(without=("add_cost_hessian",), in_cost=[(0, 1), (0, 1, 2), (0, 1, 2)]))
    assert "depends on agent 3" in bare.expected
    error = refused(coupled(in_constraint=((0, 1), (0, 1))))
    assert error.key == "game.in_constraint"
    assert "'ball' depends on agent 3" in error.expected


WRONG = {
    "box of another place": (
        {"box": (np.full(4, -2.0), np.array([2.0, 2.0, 0.4, 2.0]))}, "box", "bounds of y_3",
    ),
    "affine": ({"affine": True}, "affine", "not affine"),
    "box": ({"box": (np.full(4, -1.2), np.full(4, 2.1))}, "box", "do not imply"),
    "corner": ({"box": (np.full(4, -2.0), np.array([2.0, 2.0, 2.0, 1.9]))}, "box", "y_4"),
    "jacobian_bounds": (
        {"box": (np.full(4, -2.0), np.full(4, 2.0)),
         "jacobian_bounds": lambda box: (np.eye(4), 5.0 * np.eye(4))},
        "jacobian_bounds", "d2J_",
    ),
    "row_scaled": (
        {"box": (np.full(4, -2.0), np.full(4, 2.0)), "row_scaled": True,
         "jacobian_bounds": lambda box: (np.full((4, 4), -9.0), np.full((4, 4), 9.0))},
        "row_scaled", "direction",
    ),
    "class affine": ({"constraint_class": "affine"}, "constraint_class", "mean"),
    "class convex": ({"constraint_class": "convex"}, "constraint_class", "'product'"),
    "gap_bounds": ({"gap_bounds": np.array([2.0, 1.0])}, "gap_bounds", "'product'"),
}  # fmt: skip


@pytest.mark.parametrize("claim", WRONG)
def test_wrong_declarations_are_refused(claim):
    fields, key, said = WRONG[claim]
    error = refused(coupled(**fields))
    assert error.key == f"game.{key}"
    assert said in error.expected


def test_right_declarations_are_not():
    bounds = np.full(4, 2.0)
    load(coupled(box=(-bounds, bounds), smooth=True))
    ball = coupled(
        {"constraint": lambda q, k, y: y @ y - 4.0, "constraint_gradient": lambda q, k, a, y:
         2 * y[a], "constraint_hessian": lambda q, k, a, b, y: 2.0 * (a == b)},
        in_constraint=((0, 1, 2),), constraint_names=("ball",), constraint_class="quadratic",
        gap_bounds=np.array([2.0]),
    )  # fmt: skip
    load(ball)
    # a disc is no polygon
    assert "more than one entry" in refused(replace_plain(ball, affine_constraints=2)).expected


def replace_plain(game, **fields):
    """The same functions with other declarations."""
    kept = ("name", "sizes", "in_cost", "in_constraint", "constraint_names", "gap_bounds")
    given = {name: getattr(game, name) for name in kept}
    return Game(kernels=game.written.module, parameters=game.written.parameters, **given, **fields)


@pytest.mark.parametrize(
    "fields",
    [
        {"constraint_class": "round"},
        {"box": (np.zeros(3), np.ones(3))},
        {"box": (np.ones(4), np.zeros(4))},
        {"gap_bounds": np.ones(3)},
        {"gap_bounds": np.array([1.0, -1.0])},
        {"affine_constraints": 4},
    ],
)
def test_declarations_that_make_no_sense_are_refused_at_once(fields):
    with pytest.raises(InvalidInput, match=f"^{next(iter(fields))}"):
        coupled(**fields)


# ------------------------------------------------------------------- right games are not refused


@pytest.mark.parametrize("seed", range(6))
def test_the_packages_games_agree_with_themselves(seed):
    """They say that they are tested: this is the test."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 7))
    delta, y = rng.uniform(0.3, 3.0, n), rng.uniform(-0.9, 0.9, n)
    lower = rng.uniform(-5.0, 5.0, n)
    p = ten_channels()
    draw = random_consensus(seed, 1 + seed % 3)
    games = [
        (velocity_game(n, V0, delta, rng.normal(size=n), rng.uniform(0, 2, n)),
         V0 + np.cumsum(y * delta)),
        (cournot_game(n, rng.uniform(0, 5, n).tolist(), 7.0, lower, lower + 3.0), lower + 1.0),
        (osnr_game(**p), rng.uniform(0.01, 0.2, 10)),
        (draw.game, draw.interior()),
        *((each.game, each.interior()) for each in (random_platoon(seed), random_formation(seed))),
    ]  # fmt: skip
    for game, start in games:
        assert game.tested
        assert game.smooth
        report = examine(game, start, points=6, most=8)
        assert report.holds, "\n".join(report.summary())
        done = {c.what: c.count for c in report.comparisons}
        assert all(done[name] > 0 for name in (
            "cost_gradient", "add_cost_hessian", "constraint_gradient", "constraint_hessian",
            "constraint_class", "box",
        ))  # fmt: skip


@pytest.mark.parametrize("scale", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("room", [1e-9, 0.3])
def test_right_games_of_any_unit_and_near_a_bound_are_not_refused(scale, room):
    """Rational, exponential and oscillating costs with a great constant, far and near the bound."""

    def cost(i, y):
        total = y[0] + y[1]
        return scale * (1e3 + math.exp(y[i]) / (1 + total) + math.cos(20 * y[i]) * y[1 - i])

    def slope(i, y):
        total = y[0] + y[1]
        return scale * (
            math.exp(y[i]) * total / (1 + total) ** 2 - 20 * math.sin(20 * y[i]) * y[1 - i]
        )

    load(boxed(cost, slope, 4.0), [room, 1.0])


@pytest.mark.parametrize("rate", [1e2, 1e4, 1e6])
def test_ripples_that_long_steps_miss_are_no_mistakes(rate):
    load(boxed(lambda i, y: y[i] + np.sin(rate * y[i]) / rate,
               lambda i, y: 1 + np.cos(rate * y[i]), 4.0), [0.3, 1.0])  # fmt: skip


def test_functions_are_never_called_outside():
    """J = y - 0.3 log y, which Python's log refuses for y <= 0, from starts near the bound."""
    called = []

    def cost(i, y):
        called.append(y.copy())
        return y[i] - 0.3 * math.log(y[i])

    for start in ([1.0, 1.0], [1e-12, 1.0], [5.9999, 1e-7]):
        game = boxed(cost, lambda i, y: 1 - 0.3 / y[i] + 0.0 * cost(i, y), 6.0)
        load(game, start)
        assert examine(game, np.array(start)).holds
    assert len(called) > 1000
    assert np.min(called) > 0.0
    assert np.max(called) < 6.0


def test_a_game_is_compared_once():
    calls = []

    def cost(i, y):
        calls.append(i)
        return y[i] ** 2

    def game(width):
        return boxed(cost, slope, width)

    slope = lambda i, y: 2 * y[i]  # noqa: E731
    one = game(3.0)
    load(one, [1.0, 1.0])
    done = len(calls)
    assert done > 0
    load(one, [1.5, 1.0])
    load(replace_plain(one), [1.0, 1.0])
    assert len(calls) == done
    load(replace_plain(one, affine=True), [1.0, 1.0])  # says more of itself
    assert len(calls) > done


def test_what_is_no_number_at_the_start_is_the_users_mistake():
    def slope(i, y):
        return np.log(y[i] - 1.0)

    game = boxed(lambda i, y: y[i] ** 2, slope, 3.0)
    with pytest.raises(UserCodeError, match=r"own_games.py, line \d+.*agent 2.*y = \[2, 0.5\]"):
        load(game, [2.0, 0.5])
    # elsewhere it is told of, and nothing is refused for it
    report = examine(boxed(lambda i, y: (y[i] - 1.0) * slope(i, y) - y[i], slope, 3.0),
                     np.array([2.0, 2.5]))  # fmt: skip
    assert not report.holds
    for words in (r"own_games.py, line ", "invalid value encountered in log", "for agent 2 at y ="):
        assert words in report.failures[0]
    # what overflows, and what raises, is told with its place too
    for cost, words in (
        (lambda i, y: np.exp(1000.0 * y[i]), "overflow encountered in exp for agent 1 at y = [1"),
        (lambda i, y: 1.0 / (int(y[i]) - 1), "ZeroDivisionError.* for agent 1 at y = [1"),
    ):
        with pytest.raises(UserCodeError, match=words.replace("[", r"\[")):
            load(boxed(cost, lambda i, y: 0.0, 3.0), [1.0, 2.0])


def test_kernels_are_called_as_the_python_that_they_are():
    game, y = replace(cournot_game(3), tested=False), np.full(3, 20.0)
    assert examine(game, y).holds
    shorter = replace(game, parameters=game.written.parameters[:-1])  # reads beyond its end
    with pytest.raises(UserCodeError, match="IndexError"):
        examine(shorter, y)


# ----------------------------------------------------------------------------------- the command


SCENARIO = """
[systems.s.game]
type = "custom"
file = "mine.py"
[systems.s.agents]
type = "integrator"
count = 2
[systems.s.initial]
action = [0.1, -0.1]
"""
MINE = """
import sys
import numpy as np
from gne_mj.game_model import Game

def game(count):
    return Game(
        name="mine", kernels=sys.modules[__name__], parameters=np.zeros(0), sizes=(1, 1),
        in_cost=[[0, 1], [0, 1]], in_constraint=[[0], [1], [0], [1]],
        constraint_names=("low 1", "low 2", "high 1", "high 2"), affine=True,
        box=(np.full(2, -1.0), np.full(2, 1.0)),
    )

def cost(q, i, y):
    return y[i] ** 2 + 3 * y[0] * y[1]

def cost_gradient(q, i, a, y):
    return 2 * y[i] + 3 * y[1 - i]

def add_cost_hessian(q, i, a, y, scale, out):
    out[i] += 2 * scale

def constraint(q, l, y):
    return -1 - y[l] if l < 2 else y[l - 2] - 1

def constraint_gradient(q, l, a, y):
    return -1.0 if l < 2 else 1.0
"""


@pytest.fixture
def scenario(tmp_path):
    (tmp_path / "s.toml").write_text(SCENARIO)
    (tmp_path / "mine.py").write_text(MINE)
    return tmp_path / "s.toml"


def test_the_command_tells_what_differs(scenario):
    done = gne_here("check", scenario)
    assert done.returncode == 1
    (row,) = [line for line in done.stdout.splitlines() if line.startswith("  add_cost_hessian ")]
    assert row.endswith("differs")
    assert "the difference quotient of cost_gradient is 3, 3 away: agent 1, d2J_1/dy_1 dy_2" in (
        done.stdout
    )
    document = json.loads(gne_here("check", scenario, "--json").stdout)["s"]
    assert not document["holds"]
    differs = [c["what"] for c in document["comparisons"] if c["verdict"] == "differs"]
    assert differs == ["add_cost_hessian"]
    # and nothing else is done with such a game
    for command in ("run", "certify", "solve"):
        refusal = gne_here(command, scenario)
        assert refusal.returncode == 2
        assert "systems.s.game.add_cost_hessian: got 0.0, but the difference" in refusal.stderr


def test_the_command_is_content_with_a_right_game(scenario):
    right = MINE.replace("out[i] += 2 * scale", "out[i] += 2 * scale; out[1 - i] += 3 * scale")
    (scenario.parent / "mine.py").write_text(right)
    done = gne_here("check", scenario)
    assert done.returncode == 0
    assert "differs" not in done.stdout
    for key in ("cost_gradient", "add_cost_hessian", "in_cost", "affine", "box"):
        assert any(line.split()[:1] == [key] for line in done.stdout.splitlines()), key
    # a start is found where none is given
    scenario.write_text(SCENARIO[: SCENARIO.index("[systems.s.initial]")])
    assert gne_here("check", scenario).returncode == 0


def test_the_command_refuses_bad_input(scenario):
    assert gne_here("check", scenario, "--set", "game.parameters.a=1").returncode == 2
    (scenario.parent / "mine.py").write_text(MINE.replace("2 * y[i] + 3", "1 / 0 + 3"))
    failed = gne_here("check", scenario)
    assert failed.returncode == 1
    assert "user_code_failed: mine.py, line 18, in cost_gradient: ZeroDivisionError" in (
        failed.stderr
    )
