"""What a game declares of itself against its functions: affine F, class of constraints, bounds."""

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import UserCodeError
from gne_mj.game_check.derivatives import chosen
from gne_mj.game_check.functions import Functions, shown_profile, unit
from gne_mj.game_check.report import Comparison

Array = NDArray[np.float64]
Points = list[Array]

# How much less than the change along a chord a departure from a straight line must be
_STRAIGHT = 1e-6
_ROUNDING = 1e-12
# Constraints whose second derivative is built entry by entry
_SMALL = 24
# Constraints up to which extremes of actions are searched
_FEW = 100
# Actions of which extremes are searched
_EXTREMES = 4


def affine(f: Functions, points: Points, rng: np.random.Generator, most: int) -> Comparison:
    """F at the middle of a chord is the mean of F at its ends."""
    into = Comparison("affine", "F at the middle of chords")
    owner = f.game.agent_of_action
    for one, other, middle in _chords(f, points):
        for a in chosen(rng, f.game.actions, most):
            i = int(owner[a])
            ends = f.slope(i, a, one), f.slope(i, a, other)
            bend = f.slope(i, a, middle) - 0.5 * (ends[0] + ends[1])
            size = abs(ends[1] - ends[0])
            allowed = _STRAIGHT * size + _ROUNDING * max(abs(ends[0]), abs(ends[1]))
            if into.add(abs(bend), size, allowed):
                into.difference = (
                    "game.affine", True,
                    f"F is not affine: dJ_{i + 1}/dy_{a + 1} half way between y ="
                    f" {shown_profile(one)} and {shown_profile(other)} is {bend:.3g} off the mean",
                )  # fmt: skip
    return into


def constraint_class(
    f: Functions, points: Points, rng: np.random.Generator, most: int
) -> Comparison:
    """Values at the middle of chords; second derivatives, where they are to be constant."""
    game, kind = f.game, f.game.constraint_class
    into = Comparison("constraint_class", "constraints at the middle of chords")
    for one, other, middle in _chords(f, points, inside=False):
        for k in chosen(rng, game.constraints_count, most):
            ends = f.constraint(k, one), f.constraint(k, other)
            bend = f.constraint(k, middle) - 0.5 * (ends[0] + ends[1])
            size = max(abs(ends[0]), abs(ends[1]))
            off = abs(bend) if kind == "affine" else max(bend, 0.0)
            if into.add(off, size, 1e-9 * size):
                into.difference = (
                    "game.constraint_class", kind,
                    f"constraint '{game.constraint_names[k]}' half way between y ="
                    f" {shown_profile(one)} and {shown_profile(other)} is {abs(bend):.3g}"
                    f" {'above' if bend > 0 else 'below'} the mean",
                )  # fmt: skip
    if kind == "quadratic":
        _constant_curvature(f, points, rng, most, into)
    return into


def _constant_curvature(
    f: Functions, points: Points, rng: np.random.Generator, most: int, into: Comparison
) -> None:
    game = f.game
    start, actions = game.actions_in_constraints
    for k in chosen(rng, game.constraints_count, most):
        own = actions[start[k] : start[k + 1]]
        a = int(rng.choice(own))
        rows = [_curvature_row(f, k, a, own, y) for y in points]
        if any(row is None for row in rows):
            continue
        for row, y in zip(rows[1:], points[1:], strict=True):
            assert row is not None and rows[0] is not None  # noqa: PT018
            size = max(float(np.max(np.abs(row))), float(np.max(np.abs(rows[0]))))
            off = float(np.max(np.abs(row - rows[0])))
            if into.add(off, size, 1e-5 * size):
                into.difference = (
                    "game.constraint_class", "quadratic",
                    f"the second derivative of constraint '{game.constraint_names[k]}' changes by"
                    f" {off:.3g} between y = {shown_profile(points[0])} and {shown_profile(y)}",
                )  # fmt: skip


def box(f: Functions, points: Points, rng: np.random.Generator, most: int) -> Comparison:
    """Every profile inside lies in the box: those just beyond its faces are outside.

    Looked at from each point along the axes, towards the corners and in random directions.
    """
    game = f.game
    assert game.box is not None
    lower, upper = game.box
    into = Comparison("box", "profiles just beyond it")
    for y in points:
        if np.any(y < lower) or np.any(y > upper):
            into.add(1.0, 1.0, 0.0)
            into.difference = _unbounded(f, int(np.argmax(np.maximum(lower - y, y - upper))), y)
            continue
        ways = [sign * unit(len(y), a) for a in chosen(rng, len(y), most) for sign in (1.0, -1.0)]
        ways += list(np.where(rng.random((2 * most, len(y))) < 0.5, upper - y, lower - y))
        ways += [upper - y, lower - y, *(rng.normal(size=(2 * most, len(y))) * (upper - lower))]
        for way in ways:
            with np.errstate(divide="ignore", invalid="ignore"):
                room = np.where(way > 0, (upper - y) / way, (lower - y) / way)
            least = float(np.nanmin(np.where(way == 0.0, np.inf, room)))
            beyond = y + least * (1.0 + 1e-6) * way + 1e-9 * np.sign(way) * (upper - lower)
            found = f.inside([beyond])
            if into.add(float(found), 1.0, 0.0):
                a = int(np.argmax(np.maximum(lower - beyond, beyond - upper)))
                into.difference = _unbounded(f, a, beyond)
    if into.difference is None and game.actions <= _SMALL and game.constraints_count <= _FEW:
        for a in chosen(rng, game.actions, _EXTREMES):
            for sign in (1.0, -1.0):
                farthest = _farthest(f, points[-1], a, sign)
                found = bool(farthest[a] > upper[a] if sign > 0 else farthest[a] < lower[a])
                if into.add(float(found), 1.0, 0.0):
                    into.difference = _unbounded(f, a, farthest)
    return into


def _unbounded(f: Functions, a: int, y: Array) -> tuple[str, list[float], str]:
    assert f.game.box is not None
    return (
        "game.box",
        [float(bound[a]) for bound in f.game.box],
        f"the constraints do not imply these bounds of y_{a + 1}: y = {shown_profile(y)} is inside"
        " all of them",
    )


def _farthest(f: Functions, y: Array, a: int, sign: float) -> Array:
    """A profile strictly inside with y_a as great (sign 1) or small (-1) as a search finds it."""
    from scipy.optimize import minimize  # slow to load, and for few games only

    game, goal = f.game, -sign * unit(len(y), a)
    try:
        found = minimize(
            lambda at: goal @ at, y, jac=lambda at: goal, method="SLSQP",
            constraints={
                "type": "ineq",
                "fun": lambda at: -game.constraints(at),
                "jac": lambda at: -game.constraint_jacobian(at),
            },
        )  # fmt: skip
    except UserCodeError:  # a constraint fails outside
        return y
    nearer = y + (1.0 - 1e-7) * (found.x - y)
    return nearer if f.inside([nearer]) else y


def jacobian_bounds(
    f: Functions, points: Points, rng: np.random.Generator, most: int
) -> Comparison:
    """Rows of dF/dy lie within the bounds over the box, and keep their direction (row_scaled)."""
    game = f.game
    into = Comparison("jacobian_bounds", "dF/dy at the points")
    assert game.jacobian_bounds is not None
    if game.box is None:
        into.note = "there is no box that they could be compared over"
        return into
    lower, upper = game.jacobian_bounds(game.box)
    m = game.actions
    if np.shape(lower) != (m, m) or np.shape(upper) != (m, m):
        into.difference = (
            "game.jacobian_bounds", [np.shape(lower), np.shape(upper)],
            f"it must return (lower, upper), each ({m}, {m})",
        )  # fmt: skip
        return into
    if game.feasible_jacobian_bounds is not None:  # the points are feasible
        closer = game.feasible_jacobian_bounds
        lower, upper = np.maximum(lower, closer[0]), np.minimum(upper, closer[1])
    for a in chosen(rng, m, most):
        i = int(game.agent_of_action[a])
        rows = [_cost_row(f, i, a, y) for y in points]
        known = [(row, y) for row, y in zip(rows, points, strict=True) if row is not None]
        for row, y in known:
            size = float(np.max(np.abs(row)))
            off = np.maximum(lower[a] - row, row - upper[a])
            b = int(np.argmax(off))
            if into.add(max(float(off[b]), 0.0), size, 1e-7 * size):
                into.difference = (
                    "game.jacobian_bounds", [float(lower[a, b]), float(upper[a, b])],
                    f"d2J_{i + 1}/dy_{a + 1} dy_{b + 1} is {row[b]:.7g} at y = {shown_profile(y)}",
                )  # fmt: skip
            if game.row_scaled:
                first = known[0][0]
                largest = int(np.argmax(np.abs(first)))
                scaled = first * (row[largest] / first[largest]) if first[largest] else row
                off_way = float(np.max(np.abs(row - scaled)))
                if into.add(off_way, size, 1e-5 * size):
                    into.difference = (
                        "game.row_scaled", True,
                        f"row {a + 1} of dF/dy changes its direction between y ="
                        f" {shown_profile(known[0][1])} and {shown_profile(y)}",
                    )  # fmt: skip
    return into


def gap_bounds(f: Functions, points: Points, rng: np.random.Generator, most: int) -> Comparison:
    """g_l + delta_l^2 is the square of an affine gap: quadratic, and 0 at its least."""
    game = f.game
    bounds = game.gap_bounds
    assert bounds is not None
    into = Comparison("gap_bounds", "least values and second derivatives of constraints")
    start, actions = game.actions_in_constraints
    for k in chosen(rng, game.constraints_count, most):
        own = actions[start[k] : start[k + 1]]
        if len(own) > _SMALL:
            into.note = f"not of constraints of more than {_SMALL} actions"
            continue
        for y in points:
            rows = [_curvature_row(f, k, int(a), own, y) for a in own]
            if any(row is None for row in rows):
                continue
            curvature = np.array(rows)
            slope = np.array([f.constraint_slope(k, int(a), y) for a in own])
            least = f.constraint(k, y) - 0.5 * slope @ np.linalg.pinv(curvature, 1e-6) @ slope
            size = float(bounds[k]) ** 2
            values = np.linalg.eigvalsh(curvature)
            off = abs(least + size)
            if values[0] < -1e-5 * values[-1]:
                off = np.inf
            if into.add(off, size, 1e-5 * max(size, abs(f.constraint(k, y)))):
                into.difference = (
                    "game.gap_bounds", float(bounds[k]),
                    f"constraint '{game.constraint_names[k]}' is no bound on a gap's square: that"
                    f" is convex with a least value of {-size:.6g}, and this is"
                    + (" not convex" if np.isinf(off) else f"'s is {least:.6g}"),
                )  # fmt: skip
            if game.affine_constraints is not None and len(own) > 1:
                into.count += 1
                if abs(values[-2]) > 1e-5 * abs(values[-1]):
                    into.difference = (
                        "game.affine_constraints", game.affine_constraints,
                        f"the gap of constraint '{game.constraint_names[k]}' has more than one"
                        " entry, so that no affine constraints describe the same set",
                    )  # fmt: skip
    return into


def _chords(f: Functions, points: Points, inside: bool = True) -> list[tuple[Array, Array, Array]]:
    """Pairs of points with their middle, which need not be inside in a set that is not convex."""
    found = []
    for n, one in enumerate(points):
        for other in points[n + 1 : n + 4]:
            middle = 0.5 * (one + other)
            if not inside or f.inside([middle]):
                found.append((one, other, middle))
    return found


def _cost_row(f: Functions, i: int, a: int, y: Array) -> Array | None:
    """d2J_i/dy_a dy, the author's or by differences; None where there is no room for them."""
    if f.game.has_cost_hessian:
        return f.row(i, a, y)
    return _differences(f, partial(f.slope, i, a), y, range(len(y)))


def _curvature_row(f: Functions, k: int, a: int, own: NDArray[np.int64], y: Array) -> Array | None:
    """d2g_k/dy_a dy_b for the constraint's own actions b, likewise."""
    if f.game.has_constraint_hessian:
        return np.array([f.constraint_curvature(k, a, int(b), y) for b in own])
    return _differences(f, partial(f.constraint_slope, k, a), y, own)


def _differences(
    f: Functions, function: Callable[[Array], float], y: Array, entries: Iterable[int]
) -> Array | None:
    values = []
    for b in entries:
        stencil = f.stencil(y, unit(len(y), int(b)))
        if stencil is None:
            return None
        values.append(stencil.derivative(function)[0])
    return np.array(values)
