"""Small games of plain functions, as users write them, some of them wrong."""

from types import ModuleType

import coupled_game
import numpy as np

from gne_mj.game_model import Game
from gne_mj.plain import FUNCTIONS
from gne_mj.system import System


def plain_game(functions, sizes, in_cost, in_constraint, parameters=(0.0,), **fields):
    """A game of these plain functions, by name."""
    module = ModuleType("own")
    for name, function in functions.items():
        setattr(module, name, function)
    names = tuple(f"g{k}" for k in range(len(in_constraint)))
    return Game(
        "own", module, np.array(parameters, float), sizes, in_cost, in_constraint,
        **{"constraint_names": names, **fields},
    )  # fmt: skip


def coupled(changed=(), without=(), **fields):
    """The coupled game of kernels as plain functions, some changed or left out."""
    functions = {name: getattr(coupled_game, name) for name in FUNCTIONS if name not in without}
    plain = {n: lambda *given, f=f: f(*given) for n, f in functions.items()} | dict(changed)
    given = {
        "sizes": coupled_game.SIZES, "in_cost": [(0, 1, 2)] * 3,
        "in_constraint": coupled_game.IN_CONSTRAINT, "parameters": (0.7,),
        "constraint_names": ("ball", "product"),
    }  # fmt: skip
    return plain_game(plain, **{**given, **fields})


def boxed(cost, slope, width, count=2, second=None, **fields):
    """Agents in 0 <= y_i <= width with costs of functions of (i, y)."""
    functions = {
        "cost": lambda q, i, y: cost(i, y),
        "cost_gradient": lambda q, i, a, y: slope(i, y),
        "constraint": lambda q, k, y: -y[k] if k < count else y[k - count] - width,
        "constraint_gradient": lambda q, k, a, y: -1.0 if k < count else 1.0,
        "constraint_hessian": lambda q, k, a, b, y: 0.0,
    }
    if second is not None:
        functions["add_cost_hessian"] = lambda q, i, a, y, scale, out: second(i, y, scale, out)
    members = [[i] for i in range(count)] * 2
    everyone = [list(range(count))] * count
    return plain_game(functions, (1,) * count, everyone, members, **fields)


def quadratic(matrix, count=2, width=1.0, **fields):
    """F = matrix y in a box, with its second derivatives."""
    matrix = np.asarray(matrix, float)

    def second(i, y, scale, out):
        out += scale * matrix[i]

    def cost(i, y):
        return y[i] * (matrix[i] @ y) - 0.5 * matrix[i, i] * y[i] ** 2

    return boxed(
        cost, lambda i, y: matrix[i] @ y, width, count, second, **{"affine": True, **fields}
    )


def ring(inner=0.9, weight=5.0, **fields):
    """Two players in inner <= |y|^2 <= 1, F = weight (y - (-3, -0.02))."""
    wanted = (-3.0, -0.02)

    def add_cost_hessian(q, i, a, y, scale, out):
        out[i] += scale * weight

    functions = {
        "cost": lambda q, i, y: 0.5 * weight * (y[i] - wanted[i]) ** 2,
        "cost_gradient": lambda q, i, a, y: weight * (y[i] - wanted[i]),
        "add_cost_hessian": add_cost_hessian,
        "constraint": lambda q, k, y: y @ y - 1.0 if k == 0 else inner - y @ y,
        "constraint_gradient": lambda q, k, a, y: 2.0 * y[a] if k == 0 else -2.0 * y[a],
        "constraint_hessian": lambda q, k, a, b, y: (a == b) * (2.0 if k == 0 else -2.0),
    }
    return plain_game(
        functions, (1, 1), [[0], [1]], [[0, 1]] * 2, affine=True,
        constraint_names=("outer", "inner"), **fields,
    )  # fmt: skip


def system(game, agents, law, start, **options):
    """A system of a game at rest at y = start."""
    return System("own", game, agents, law, 0.01, agents.equilibrium(np.array(start)), **options)
