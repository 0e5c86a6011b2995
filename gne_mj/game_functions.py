"""A game's kernels as C functions, compiled by themselves, and the kernels that call them.

A native loop or solver is compiled once for all games. It finds the game's functions by their
addresses in ``GameData.functions``, and calls them with the kernels here, which take the game's
data where a module of kernels takes q. What is needed often is found for many agents or constraints
in one call; the six functions by themselves cost a call each.
"""

from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from numba import types
from numpy.typing import NDArray

from gne_mj.linked_game import compiled_for
from gne_mj.native import address_in, call_integer, call_number, callback, kernel, source_key
from gne_mj.parameter_block import floats_at, integers_at

_COST, _GRADIENT, _ROW, _CONSTRAINT, _SLOPE, _CURVATURE = range(6)
_EVALUATE, _VALUES, _GRADIENTS, _SLOPES, _ROWS = range(6, 11)

_whole, _real = types.int64, types.float64
_OF_Y = _real(_whole, _whole, _whole, _whole, _whole, _whole, _whole)
_OF_ROW = _whole(_whole, _whole, _whole, _whole, _whole, _whole, _real, _whole)
_WEIGHTS = _whole(_whole, _whole, _whole, _whole, _real, _whole, _whole, _whole, _whole)
_OF_MANY = _whole(*[_whole] * 9)


@kernel
def weigh(game, q, tightening, rho, y, g, weights):
    """Fill g with g(y) and weights with rho / (-g - t); return -1, or the first g + t >= 0.

    A value that is not a number counts as not negative. Where a constraint is not tightened
    (t = 0) that is g itself.
    """
    outside = -1
    for k in range(len(g)):
        value = game.constraint(q, k, y)
        slack = -value - tightening[k]
        g[k] = value
        weights[k] = rho / slack
        if not slack > 0.0 and outside < 0:
            outside = k
    return outside


@kernel
def each_gradient(game, q, agents, at, y, out):
    """Fill these agents' entries of out (m,), which begin at ``at``, with dJ_i/dy_a."""
    for entry in range(len(agents)):
        i = agents[entry]
        for a in range(at[i], at[i + 1]):
            out[a] = game.cost_gradient(q, i, a, y)


def compiled_functions(game: ModuleType) -> NDArray[np.int64]:
    """The addresses of a module's functions, as ``GameData.functions`` has them."""
    return np.array([owner.address for owner in _compiled(game)], dtype=np.int64)


@cache
def _compiled(game: ModuleType) -> list[Any]:
    """The C functions, in the order of their numbers; q and y are given by address and length."""
    return compiled_for(game, _made)


def _made(game: ModuleType) -> list[Any]:
    source = source_key(game)
    many = [*_functions_of_many(game, source), _cost_rows(game, source)]
    return [*_own_functions(game, source), *many]


def _own_functions(game: ModuleType, source: str) -> list[Any]:
    """The module's six."""

    def cost(q, size, i, _a, _b, y, m):
        _ = source
        return game.cost(floats_at(q, size), i, floats_at(y, m))

    def cost_gradient(q, size, i, a, _b, y, m):
        _ = source
        return game.cost_gradient(floats_at(q, size), i, a, floats_at(y, m))

    def add_cost_hessian(q, size, i, a, y, m, scale, out):
        _ = source
        game.add_cost_hessian(
            floats_at(q, size), i, a, floats_at(y, m), scale, floats_at(out, m)
        )  # fmt: skip
        return 0

    def constraint(q, size, k, _a, _b, y, m):
        _ = source
        return game.constraint(floats_at(q, size), k, floats_at(y, m))

    def constraint_gradient(q, size, k, a, _b, y, m):
        _ = source
        return game.constraint_gradient(floats_at(q, size), k, a, floats_at(y, m))

    def constraint_hessian(q, size, k, a, b, y, m):
        _ = source
        return game.constraint_hessian(floats_at(q, size), k, a, b, floats_at(y, m))

    return [
        callback(_OF_Y, cost),
        callback(_OF_Y, cost_gradient),
        callback(_OF_ROW, add_cost_hessian),
        callback(_OF_Y, constraint),
        callback(_OF_Y, constraint_gradient),
        callback(_OF_Y, constraint_hessian),
    ]


def _functions_of_many(game: ModuleType, source: str) -> list[Any]:
    """What is asked of many agents, or constraints, in one call."""

    def evaluate(q, size, tightening, p, rho, y, m, g, weights):
        _ = source
        return weigh(
            game, floats_at(q, size), floats_at(tightening, p), rho, floats_at(y, m),
            floats_at(g, p), floats_at(weights, p),
        )  # fmt: skip

    def values(q, size, constraints, count, _rows, _columns, y, m, out):
        _ = source
        which, found = integers_at(constraints, count), floats_at(out, count)
        for k in range(count):
            found[k] = game.constraint(floats_at(q, size), which[k], floats_at(y, m))
        return 0

    def gradients(q, size, agents, count, offsets, _columns, y, m, out):
        _ = source
        each_gradient(
            game, floats_at(q, size), integers_at(agents, count), integers_at(offsets, m + 1),
            floats_at(y, m), floats_at(out, m),
        )  # fmt: skip
        return 0

    def gradients_at_once(q, size, agents, count, offsets, _columns, y, m, out):
        _ = source
        at = integers_at(offsets, m + 1)
        if at[count] == m:  # of all agents
            game.pseudo_gradient(floats_at(q, size), floats_at(y, m), floats_at(out, m))
        else:
            each_gradient(
                game, floats_at(q, size), integers_at(agents, count), at, floats_at(y, m),
                floats_at(out, m),
            )  # fmt: skip
        return 0

    def slopes(q, size, constraints, count, rows, columns, y, m, out):
        _ = source
        which, first = integers_at(constraints, count), integers_at(rows, count + 1)
        column, found = integers_at(columns, first[count]), floats_at(out, first[count])
        for k in range(count):
            for entry in range(first[k], first[k + 1]):
                found[entry] = game.constraint_gradient(
                    floats_at(q, size), which[k], column[entry], floats_at(y, m)
                )
        return 0

    return [
        callback(_WEIGHTS, evaluate),
        callback(_OF_MANY, values),
        callback(_OF_MANY, gradients_at_once if hasattr(game, "pseudo_gradient") else gradients),
        callback(_OF_MANY, slopes),
    ]


def _cost_rows(game: ModuleType, source: str) -> Any:
    """All rows of dF/dy in one call."""

    def rows(q, size, agents, count, offsets, stride, y, m, out):
        _ = source
        which, at, profile = (
            integers_at(agents, count),
            integers_at(offsets, m + 1),
            floats_at(y, m),
        )
        for entry in range(count):
            i = which[entry]
            for a in range(at[i], at[i + 1]):
                row = floats_at(out + 8 * a * stride, m)
                for c in range(m):
                    row[c] = 0.0
                game.add_cost_hessian(floats_at(q, size), i, a, profile, 1.0, row)
        return 0

    return callback(_OF_MANY, rows)


@kernel
def _at_profile(data, function, number, a, b, y):
    q = data.parameters
    return call_number(
        data.functions[function], (address_in(q), len(q), number, a, b, address_in(y), len(y))
    )


@kernel
def cost(data, i, y):
    """J_i(y)."""
    return _at_profile(data, _COST, i, 0, 0, y)


@kernel
def cost_gradient(data, i, a, y):
    """dJ_i/dy_a."""
    return _at_profile(data, _GRADIENT, i, a, 0, y)


@kernel
def add_cost_hessian(data, i, a, y, scale, out):
    """out[b] += scale * d2J_i/dy_a dy_b."""
    q = data.parameters
    call_integer(
        data.functions[_ROW],
        (address_in(q), len(q), i, a, address_in(y), len(y), scale, address_in(out)),
    )


@kernel
def constraint(data, k, y):
    """g_k(y)."""
    return _at_profile(data, _CONSTRAINT, k, 0, 0, y)


@kernel
def constraint_gradient(data, k, a, y):
    """dg_k/dy_a."""
    return _at_profile(data, _SLOPE, k, a, 0, y)


@kernel
def constraint_hessian(data, k, a, b, y):
    """d2g_k/dy_a dy_b."""
    return _at_profile(data, _CURVATURE, k, a, b, y)


@kernel
def evaluate(data, rho, y, g, weights):
    """Fill g with g(y) and weights with rho / (-g - t); -1, or the first g + t that is not < 0."""
    q, tightening = data.parameters, data.tightening
    return call_integer(
        data.functions[_EVALUATE],
        (
            address_in(q), len(q), address_in(tightening), len(g), rho, address_in(y), len(y),
            address_in(g), address_in(weights),
        ),
    )  # fmt: skip


@kernel
def _for_many(data, function, which, rows, columns, y, out):
    q = data.parameters
    call_integer(
        data.functions[function],
        (
            address_in(q), len(q), address_in(which), len(which), rows, columns, address_in(y),
            len(y), address_in(out),
        ),
    )  # fmt: skip


@kernel
def values(data, constraints, y, out):
    """Fill out, one entry for each of these constraints, with g_l(y)."""
    _for_many(data, _VALUES, constraints, 0, 0, y, out)


@kernel
def gradients(data, agents, y, out):
    """Fill these agents' entries of out (m,) with dJ_i/dy_a."""
    _for_many(data, _GRADIENTS, agents, address_in(data.offsets), 0, y, out)


@kernel
def slopes(data, constraints, rows, columns, y, out):
    """Fill out with dg_l/dy_a, in compressed rows: of the k-th of these constraints for each a in
    columns[rows[k]:rows[k + 1]]."""
    _for_many(data, _SLOPES, constraints, address_in(rows), address_in(columns), y, out)


@kernel
def cost_rows(data, y, stride, out):
    """Fill out, from a * stride on for each a, with dF_a/dy (m,)."""
    _for_many(data, _ROWS, data.everyone, address_in(data.offsets), stride, y, out)
