"""Bounds of actions, declared as numbers: the constraints and the curves that come of them."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.quantity import Quantity

Array = NDArray[np.float64]


class Limits(NamedTuple):
    """Bounds of all actions, (m,) each; infinite where there is none."""

    lower: Array
    upper: Array


def limits_of(lower: Any, upper: Any, sizes: tuple[int, ...]) -> Limits:
    """Declared bounds, one number, one an agent, or one an entry of the profile (also by agents).

    Raises:
        InvalidInput: names ``lower`` or ``upper``.
    """
    below, above = _limit("lower", lower, -np.inf, sizes), _limit("upper", upper, np.inf, sizes)
    for a in np.flatnonzero(~(below < above)):
        raise InvalidInput("lower", float(below[a]), f"it must be below upper, {above[a]:g}")
    return Limits(below, above)


def _limit(key: str, given: Any, nothing: float, sizes: tuple[int, ...]) -> Array:
    total, count = sum(sizes), len(sizes)
    if given is None:
        return np.full(total, nothing)
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        values = np.zeros((0, 0, 0))
    if values.shape == (count, max(sizes)) and min(sizes) == max(sizes):
        values = values.ravel()
    elif values.shape == (count,):
        values = np.repeat(values, sizes)
    if values.shape not in ((), (total,)):
        several = f", one for each of {total} actions" if total != count else ""
        expected = f"it must be one number, one for each of {count} agents{several}"
        raise InvalidInput(key, f"{given!r:.60}", expected)
    if np.any(np.isnan(values)) or np.any(values == -nothing):
        raise InvalidInput(key, given, f"it must be numbers; {nothing:g} is for no bound")
    return np.broadcast_to(values, (total,)).copy()


def names_of(sizes: tuple[int, ...], agent_name: str, axes: tuple[str, ...]) -> list[str]:
    """What each entry of the profile is called: "agent 2", or "agent 2, x"."""
    return [
        f"{agent_name} {i + 1}" + (f", {axes[k] if k < len(axes) else k + 1}" if size > 1 else "")
        for i, size in enumerate(sizes)
        for k in range(size)
    ]


def quantities(
    limits: Limits, sizes: tuple[int, ...], name: str, unit: str, axes: tuple[str, ...]
) -> list[Quantity]:
    """The bounded actions as curves with their bounds: one curve an agent and axis."""
    if not np.any(np.isfinite([*limits.lower, *limits.upper])):
        return []
    each = "agent" if min(sizes) == max(sizes) else ""
    at = np.concatenate([[0], np.cumsum(sizes)])
    rows = (
        [at[:-1] + k for k in range(sizes[0])]
        if each
        else [np.array([a]) for a in range(int(at[-1]))]
    )
    found = []
    for k, row in enumerate(rows):
        axis = (axes[k] if each and k < len(axes) else str(k + 1)) if len(rows) > 1 else ""
        sides = {"bound": limits.upper[row], "lower_bound": limits.lower[row]}
        bounds: dict[str, Any] = {
            key: np.where(np.isfinite(side), side, np.nan) if each else float(side[0])
            for key, side in sides.items()
            if np.any(np.isfinite(side))
        }
        if bounds:
            label = f"bounded_action_{axis}" if axis else "bounded_action"
            values = partial(_columns, row=row, one=not each)
            found.append(Quantity(label, f"{name} {axis}".strip(), unit, values, each, **bounds))
    return found


def _columns(y: Array, row: NDArray[np.int64], one: bool) -> Array:
    return y[:, row[0]] if one else y[:, row]
