"""First and second derivatives against differences of what they are derivatives of."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gne_mj.game_check.functions import Functions, Stencil, shown_profile, unit
from gne_mj.game_check.report import Comparison

Array = NDArray[np.float64]

# What a derivative may be off by, relative to its size, and how many times the differences' own
# estimate of their error on top: an author's mistakes are far greater.
ALLOWED = 1e-5
_SAFETY = 20.0
# Where differences are this uncertain, nothing is compared
_VAGUE = 1e-2
# By which shorter stencils a difference is confirmed
_FINER = (1e-2, 1e-4)
# Rows of one constraint's second derivative looked at for one profile
_ROWS = 4


def chosen(rng: np.random.Generator, count: int, most: int) -> list[int]:
    """Numbers below ``count``: all, or the first, the last and random ones."""
    if count <= most:
        return list(range(count))
    others = 1 + rng.permutation(count - 2)[: max(most - 2, 0)]
    return sorted({0, count - 1, *map(int, others)})


def cost_gradients(f: Functions, y: Array, rng: np.random.Generator, most: int,
                   into: Comparison) -> None:  # fmt: skip
    """dJ_i/dy_a, each action moved alone."""
    owner, data = f.game.agent_of_action, f.game.data
    for a in chosen(rng, f.game.actions, most):
        i = int(owner[a])
        own = data.own_index[data.own_pointer[i] : data.own_pointer[i + 1]]
        stencil = f.stencil(y, unit(len(y), a), own.tolist())
        if stencil is None:
            continue
        value, given = partial(f.cost, i), f.slope(i, a, y)
        if _apart(f, into, given, abs(given), stencil, value):
            what, there = f"agent {i + 1}, dJ_{i + 1}/dy_{a + 1}", stencil.derivative(value)[0]
            into.difference = _difference("cost_gradient", given, what, y, "cost", there)


def second_derivatives(
    f: Functions, y: Array, rng: np.random.Generator, most: int,
    costs: Comparison, gradients: Comparison, hessians: Comparison,
) -> None:  # fmt: skip
    """All others, all actions being moved together in one random direction."""
    stencil = f.stencil(y, _random(rng, y))
    if stencil is None:
        return
    if f.game.has_cost_hessian:
        _cost_hessians(f, y, stencil, chosen(rng, f.game.actions, most), costs)
    for k in chosen(rng, f.game.constraints_count, most):
        _constraint_gradient(f, y, stencil, k, gradients)
        if f.game.has_constraint_hessian:
            _constraint_hessian(f, y, stencil, k, rng, hessians)


def _cost_hessians(
    f: Functions, y: Array, stencil: Stencil, rows: list[int], into: Comparison
) -> None:
    for a in rows:
        i = int(f.game.agent_of_action[a])
        slope, row = partial(f.slope, i, a), f.row(i, a, y)
        if _row_apart(f, into, row, stencil, slope):
            b, given, value = _entry(f, slope, y, row, range(len(y)))
            what = f"agent {i + 1}, d2J_{i + 1}/dy_{a + 1} dy_{b + 1}"
            into.difference = _difference(
                "add_cost_hessian", given, what, y, "cost_gradient", value
            )


def _constraint_gradient(
    f: Functions, y: Array, stencil: Stencil, k: int, into: Comparison
) -> None:
    own, value, row = _own(f, k), partial(f.constraint, k), np.zeros_like(y)
    row[own] = [f.constraint_slope(k, int(a), y) for a in own]
    if _row_apart(f, into, row, stencil, value):
        a, given, there = _entry(f, value, y, row, own)
        what = f"constraint '{f.game.constraint_names[k]}', dg_{k + 1}/dy_{a + 1}"
        into.difference = _difference("constraint_gradient", given, what, y, "constraint", there)


def _constraint_hessian(
    f: Functions, y: Array, stencil: Stencil, k: int, rng: np.random.Generator, into: Comparison
) -> None:
    own = _own(f, k)
    for a in own[chosen(rng, len(own), _ROWS)]:
        slope, row = partial(f.constraint_slope, k, int(a)), np.zeros_like(y)
        row[own] = [f.constraint_curvature(k, int(a), int(b), y) for b in own]
        if _row_apart(f, into, row, stencil, slope):
            b, given, value = _entry(f, slope, y, row, own)
            name = f.game.constraint_names[k]
            what = f"constraint '{name}', d2g_{k + 1}/dy_{a + 1} dy_{b + 1}"
            into.difference = _difference(
                "constraint_hessian", given, what, y, "constraint_gradient", value
            )


def _own(f: Functions, k: int) -> NDArray[np.int64]:
    start, actions = f.game.actions_in_constraints
    return actions[start[k] : start[k + 1]]


def _row_apart(
    f: Functions, into: Comparison, row: Array, stencil: Stencil, function: Callable[[Array], float]
) -> bool:
    """Compare a row of derivatives along a stencil's direction."""
    direction = stencil.direction
    size = float(np.abs(row) @ np.abs(direction))
    return _apart(f, into, float(row @ direction), size, stencil, function)


def _apart(
    f: Functions, into: Comparison, given: float, size: float, stencil: Stencil,
    function: Callable[[Array], float],
) -> bool:  # fmt: skip
    """Compare, where differences are good enough; whether it is the worst difference so far."""
    error, size, allowed = _compared(given, size, stencil.derivative(function))
    if error is None:
        return False
    for factor in _FINER if error > allowed else ():  # a ripple that long steps missed?
        finer = f.finer(stencil, factor)
        if finer is not None:
            there, size_there, allowed_there = _compared(given, size, finer.derivative(function))
            if there is not None and there <= allowed_there:
                error, size, allowed = there, size_there, allowed_there
    return into.add(error, size, allowed)


def _compared(
    given: float, size: float, found: tuple[float, float]
) -> tuple[float | None, float, float]:
    """(error, size, what it may be); no error where the difference is too uncertain to tell."""
    value, uncertain = found
    error, size = abs(given - value), max(size, abs(value))
    allowed = ALLOWED * size + _SAFETY * uncertain
    vague = _SAFETY * uncertain > _VAGUE * size
    if vague and (given != 0.0 or error > allowed):
        return None, size, allowed
    return error, size, allowed


def _entry(
    f: Functions, function: Callable[[Array], float], y: Array, row: Array, entries: object
) -> tuple[int, float, float]:
    """The entry of a row that is farthest from its own difference: number, given, difference."""
    worst = (0, 0.0, 0.0)
    for b in np.asarray(entries):
        stencil = f.stencil(y, unit(len(y), int(b)))
        if stencil is not None:
            value, _ = stencil.derivative(function)
            if abs(row[b] - value) >= abs(worst[1] - worst[2]):
                worst = int(b), float(row[b]), value
    return worst


def _difference(
    name: str, given: float, what: str, y: Array, of: str, value: float
) -> tuple[str, float, str]:
    return (
        f"game.{name}",
        float(f"{given:.7g}"),
        f"the difference quotient of {of} is {value:.7g}, {abs(given - value):.3g} away: {what} at"
        f" y = {shown_profile(y)}",
    )


def _random(rng: np.random.Generator, y: Array) -> Array:
    """A direction of which no entry is small, so that no entry's error goes unseen."""
    return rng.uniform(0.5, 1.0, len(y)) * rng.choice([-1.0, 1.0], len(y))
