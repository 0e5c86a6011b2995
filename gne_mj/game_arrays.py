"""Costs, constraints and their derivatives as arrays: native functions that serve all games.

They are given ``GameData`` (:mod:`gne_mj.game_model`), profiles and an array to fill, whose shapes
are those of the :class:`gne_mj.game_model.Game` methods of the same names.
"""

from functools import cache
from types import SimpleNamespace
from typing import Any

from gne_mj import game_functions as functions
from gne_mj.native import compiled, kernel, source_key


@cache
def array_functions() -> SimpleNamespace:
    """The native functions by their names, compiled at their first call."""
    return SimpleNamespace(**_values(source_key()), **_derivatives(source_key()))


def _values(source: str) -> dict[str, Any]:
    @compiled
    def costs(data, profiles, out):
        _ = source
        for row in range(len(profiles)):
            for i in range(len(data.offsets) - 1):
                out[row, i] = functions.cost(data, i, profiles[row])

    @compiled
    def pseudo_gradient(data, profiles, out):
        _ = source
        for row in range(len(profiles)):
            functions.gradients(data, data.everyone, profiles[row], out[row])

    @compiled
    def constraints(data, profiles, out):
        _ = source
        for row in range(len(profiles)):
            functions.values(data, data.all_constraints, profiles[row], out[row])

    return {"costs": costs, "pseudo_gradient": pseudo_gradient, "constraints": constraints}


def _derivatives(source: str) -> dict[str, Any]:
    @compiled
    def pseudo_gradient_jacobian(data, y, out):
        _ = source
        at = data.offsets
        for i in range(len(at) - 1):
            for a in range(at[i], at[i + 1]):
                functions.add_cost_hessian(data, i, a, y, 1.0, out[a])

    @compiled
    def constraint_jacobian(data, y, out):
        _ = source
        at = data.offsets
        for k in range(len(out)):
            for entry in range(data.member_pointer[k], data.member_pointer[k + 1]):
                i = data.member_index[entry]
                for a in range(at[i], at[i + 1]):
                    out[k, a] = functions.constraint_gradient(data, k, a, y)

    @compiled
    def weighted_hessian(data, y, weights, out):
        _ = source
        for k in range(len(weights)):
            first, last = data.member_pointer[k], data.member_pointer[k + 1]
            for row in range(first, last):
                for column in range(first, last):
                    i, j = data.member_index[row], data.member_index[column]
                    _add_block(data, k, i, j, y, weights[k], out)

    @compiled
    def constraint_hessian(data, y, k, own, out):
        _ = source
        for row in range(len(own)):
            for column in range(len(own)):
                a, b = own[row], own[column]
                out[row, column] = functions.constraint_hessian(data, k, a, b, y)

    return {
        "pseudo_gradient_jacobian": pseudo_gradient_jacobian,
        "constraint_jacobian": constraint_jacobian,
        "weighted_hessian": weighted_hessian,
        "constraint_hessian": constraint_hessian,
    }


@kernel
def _add_block(data, k, i, j, y, weight, out):
    """out[a, b] += weight d2g_k/dy_a dy_b for the actions a of agent i, and b of agent j."""
    at = data.offsets
    for a in range(at[i], at[i + 1]):
        for b in range(at[j], at[j + 1]):
            out[a, b] += weight * functions.constraint_hessian(data, k, a, b, y)
