"""Convexity: of the constraints, of each cost in its agent's own action, of the barrier.

What a game's functions are can be looked at in samples only. "met" is said where F's second
derivatives are known (affine, or bounded over the set), or where a tested game declares it; else
"assumed", unless a sample refutes it.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import UserCodeError
from gne_mj.game_model import Box, Game
from gne_mj.system import System
from gne_mj.theory.assumption import ASSUMED, FAILS, MET, UNKNOWN, Assumption
from gne_mj.theory.constants import EXACT, Slopes, profiles
from gne_mj.theory.spectra import gram, positive_definite

Array = NDArray[np.float64]

SAMPLES, _FEW = 40, 4
# How many entries of second derivatives may be computed, by kernels and by plain functions
_ENTRIES, _PLAIN_ENTRIES = 2e7, 2e5
# Rounding in second derivatives, relative to their size, and of those that are differences
_ROUNDING, _DIFFERENCED = 1e-9, 1e-5
# Widened boxes are told apart for so many agents
_MANY = 200


@dataclass(frozen=True)
class Counterexample:
    """Where a constraint is not convex.

    Attributes:
        constraint: its number.
        profile: (m,) where.
        eigenvalue: of its second derivative there; None if the profile is half way between two
            inside and the value there is above their mean.
        above: by how much; not a number if the constraint is none there.
    """

    constraint: int
    profile: Array
    eigenvalue: float | None
    above: float = 0.0


def convex_constraints(system: System) -> Assumption:
    """Convex constraints: without them the set need not be, and phi not either."""
    return _constraints_of(system.game, system.start.tobytes())


@lru_cache(maxsize=16)  # several conditions rest on it
def _constraints_of(game: Game, start: bytes) -> Assumption:
    label = "convex constraints"
    points = _samples(game, np.frombuffer(start))
    found = counterexample(game, points)
    if found is not None:
        name, where = game.constraint_names[found.constraint], shown(found.profile)
        if found.eigenvalue is not None:
            how = f"its second derivative has the eigenvalue {found.eigenvalue:.3g} at y = {where}"
        elif np.isnan(found.above):
            how = f"half way between two interior profiles, at y = {where}, it is not a number"
        else:
            how = (
                f"half way between two interior profiles, at y = {where}, it is"
                f" {found.above:.3g} above their mean"
            )
        return Assumption(label, FAILS, f"constraint '{name}' is not convex: {how}")
    kind = game.convexity
    if game.tested and kind is not None:
        return Assumption(label, MET, f"the constraints are {_SAID.get(kind, kind)}")
    said = f"declared to be {_SAID.get(kind, kind)}, and" if kind is not None else "convex, as"
    return Assumption(
        label,
        ASSUMED,
        f"constraints {said} seen at {len(points)} sampled profiles, which is no proof",
    )


_SAID = {"quadratic": "convex and quadratic", "bounds on gaps": "bounds on gaps, which are convex"}


def counterexample(game: Game, points: Array) -> Counterexample | None:
    """A profile that shows that a constraint is not convex, or None.

    Args:
        game: whose constraints.
        points: (count, m) profiles strictly inside; second derivatives are looked at there, and
            values half way between them, which tell of what lies outside the set too.
    """
    tolerance = _tolerance(game.has_constraint_hessian)
    worst, found = 0.0, None
    for y in points:
        slope = np.max(np.abs(game.constraint_jacobian(y)), axis=1)
        for k in range(game.constraints_count):
            second = game.constraint_hessian(k, y)
            size = float(np.max(np.abs(second)))
            least = float(np.linalg.eigvalsh(0.5 * (second + second.T))[0]) if size else 0.0
            noise = slope[k] / max(1.0, float(np.max(np.abs(y))))
            if least < -tolerance * (size + noise) and least / (size + noise) < worst:
                worst = least / (size + noise)
                found = Counterexample(k, y, least)
    return found or _above_chords(game, points)


def _above_chords(game: Game, points: Array) -> Counterexample | None:
    first, second = np.triu_indices(len(points), 1)
    middles = 0.5 * (points[first] + points[second])
    with np.errstate(all="ignore"):
        ends = game.constraints(points)
        try:
            values = game.constraints(middles)
        except UserCodeError:  # a function that fails there is no number there
            return None
        above = values - 0.5 * (ends[first] + ends[second])
        size = np.abs(ends[first]) + np.abs(ends[second])
        excess = np.where(np.isnan(above), np.inf, above - _ROUNDING * size)
    if not len(excess) or not np.max(excess) > 0.0:
        return None
    at, k = np.unravel_index(np.argmax(excess / np.maximum(size, 1e-300)), excess.shape)
    return Counterexample(int(k), middles[at], None, float(above[at, k]))


def own_convexity(system: System, slopes: Slopes) -> Assumption:
    """Each J_i convex in y_i, wherever its law evaluates it.

    Its own action is in the game's box, those of others where ``slopes`` look: in the set or, under
    partial information, in the box that holds the estimates too.
    """
    game, label = system.game, "costs convex in own actions"
    if slopes.label == EXACT:
        least, i = _least_own(game, game.pseudo_gradient_jacobian(slopes.center))
        if least < -slopes.floor:
            return Assumption(label, FAILS, f"J_{i + 1} is not convex in y_{i + 1}: its second"
                              f" derivative there has the eigenvalue {least:.3g}")  # fmt: skip
        return Assumption(label, MET, "costs convex in own actions")
    bounded = _bounded_own(game, slopes)
    if bounded is not None and bounded >= 0.0:
        return Assumption(label, MET, "costs convex in own actions, over all of the box")
    points = _samples(game, system.start, slopes.box, slopes.feasible)
    where = "" if slopes.feasible else ", in the box that holds the estimates"
    for y in points:
        for i, at in _own_profiles(game, slopes, y):
            least = _own_eigenvalue(game, i, at)
            if np.isnan(least):
                why = f"J_{i + 1} or its derivative is not a number at y = {shown(at)}{where}"
                return Assumption(label, FAILS, why)
            if least < 0.0:
                why = (
                    f"J_{i + 1} is not convex in y_{i + 1}: its second derivative has the"
                    f" eigenvalue {least:.3g} at y = {shown(at)}{where}"
                )
                return Assumption(label, FAILS, why)
    if game.jacobian_bounds is not None:
        why = f"no bounds of d2J_i/dy_i^2 that suffice are known{where}"
        return Assumption(label, UNKNOWN, f"that costs are convex in own actions: {why}")
    return Assumption(
        label,
        ASSUMED,
        f"costs convex in own actions at {len(points)} sampled profiles, which is no proof",
    )


def strictly_convex_barrier(system: System) -> bool:
    """Whether the constraints reach all actions, so that convex ones make phi strictly convex.

    What the barrier's curvature spans does not depend on how near each bound is, or on its unit:
    all weigh alike. Directions in which it is flat are those flat at all samples.
    """
    game = system.game
    span = np.zeros((game.actions, game.actions))
    for y in _samples(game, system.start, most=_FEW):
        slopes = game.constraint_jacobian(y)
        sizes = np.linalg.norm(slopes, axis=1)
        unit = slopes / np.where(sizes > 0.0, sizes, 1.0)[:, None]
        curved = game.weighted_constraint_hessian(y, np.ones(game.constraints_count))
        size = float(np.max(np.abs(curved)))
        span += gram(unit) + (curved / size if size > 0.0 else 0.0)
    floor = (1e-12 if game.has_constraint_hessian else 1e-7) * np.max(np.abs(span))
    span[np.diag_indices(game.actions)] -= floor
    return positive_definite(span)


def shown(y: Array) -> str:
    """A profile for a message."""
    return "[" + ", ".join([f"{v:.4g}" for v in y[:6]] + ["..."] * (len(y) > 6)) + "]"


def _tolerance(given: bool) -> float:
    """Of second derivatives that the author gave, or that are differences."""
    return _ROUNDING if given else _DIFFERENCED


def _samples(
    game: Game,
    start: Array,
    box: Box | None = None,
    feasible: bool = True,
    most: int = SAMPLES,
) -> Array:
    """Profiles to look at: random ones, near the boundary and towards the corners of the box."""
    members = np.diff(game.actions_in_constraints[0])
    each = float(np.sum(members**2)) + game.actions**2
    entries = _ENTRIES if game.native else _PLAIN_ENTRIES
    count = int(np.clip(entries / each, _FEW, most))
    points = profiles(game, start, game.box if box is None else box, count, feasible)
    # Functions need not be numbers on the boundary itself, and differences need room: a little
    # away from it, where the way there is inside
    nearer = start + 0.98 * (points - start)
    if not feasible:
        return nearer
    inside = np.all(game.constraints(nearer) < 0.0, axis=1)
    return np.where(inside[:, None], nearer, points)


def _least_own(game: Game, slopes: Array) -> tuple[float, int]:
    """The least eigenvalue of an agent's own block of a dF/dy (m, m), and which agent's."""
    if max(game.sizes) == 1:
        worst = int(np.argmin(np.diag(slopes)))
        return float(slopes[worst, worst]), worst
    at = game.data.offsets
    each = [
        float(np.linalg.eigvalsh(0.5 * (own + own.T))[0])
        for own in (slopes[a:b, a:b] for a, b in pairwise(at))
    ]
    worst = int(np.argmin(each))
    return each[worst], worst


def _bounded_own(game: Game, slopes: Slopes) -> float | None:
    """A lower bound of all own second derivatives from the game's bounds; None without one."""
    if game.jacobian_bounds is None or slopes.box is None or game.box is None:
        return None
    least, at = np.inf, game.data.offsets
    known: dict[bytes, Box] = {}
    for i in range(game.agents):
        own = slice(at[i], at[i + 1])
        lower, upper = (bound.copy() for bound in slopes.box)
        if game.agents <= _MANY:
            lower[own], upper[own] = game.box[0][own], game.box[1][own]
        key = lower.tobytes() + upper.tobytes()
        if key not in known:
            known = {key: game.jacobian_bounds((lower, upper))}
        low, high = (bound[own, own] for bound in known[key])
        if not np.all(np.isfinite(low) & np.isfinite(high)):
            return None
        middle, radius = 0.5 * (low + high), 0.5 * (high - low)
        center = np.linalg.eigvalsh(0.5 * (middle + middle.T))[0]
        least = min(least, float(center - np.linalg.norm(0.5 * (radius + radius.T), 2)))
    return least


def _own_profiles(game: Game, slopes: Slopes, y: Array) -> Iterator[tuple[int, Array]]:
    """Agents with the profile at which to look at each: its own action is one of the game's box."""
    for i in range(min(game.agents, _MANY)):
        own = slice(game.data.offsets[i], game.data.offsets[i + 1])
        if slopes.feasible or game.box is None:
            yield i, y
        else:
            at = y.copy()
            at[own] = np.clip(y[own], game.box[0][own], game.box[1][own])
            yield i, at


def _own_eigenvalue(game: Game, i: int, y: Array) -> float:
    """The least eigenvalue of d2J_i/dy_i^2, 0 if rounding; not a number where J_i is none."""
    own = slice(game.data.offsets[i], game.data.offsets[i + 1])
    try:
        with np.errstate(all="ignore"):
            value, rows = game.costs(y)[i], game.pseudo_gradient_jacobian(y)[own]
            size = float(np.max(np.abs(game.pseudo_gradient(y)[own])))
    except UserCodeError:
        return float("nan")
    if not (np.isfinite(value) and np.all(np.isfinite(rows))):
        return float("nan")
    block = rows[:, own]
    least = float(np.linalg.eigvalsh(0.5 * (block + block.T))[0])
    scale = float(np.max(np.abs(rows))) + size / max(1.0, float(np.max(np.abs(y))))
    return least if least < -_tolerance(game.has_cost_hessian) * scale else 0.0
