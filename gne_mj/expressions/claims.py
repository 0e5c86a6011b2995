"""What can be proved of expressions: degree, convexity, smoothness, and bounds of actions."""

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.expressions.entries import ordered
from gne_mj.expressions.nodes import Node
from gne_mj.expressions.operators import evaluate
from gne_mj.expressions.tracing import Bound
from gne_mj.game_model import Box, ConstraintClass

_ABOVE = 3  # a degree that is not 0, 1 or 2
_CONVEX = {"exp": 1, "expm1": 1, "log": -1, "log1p": -1, "sqrt": -1}  # or concave, if monotone
_SWEEPS = 50  # of bounds of actions, each from the others'
_SLACK = 1e-9  # by which bounds of actions are wider than rounding can tell


class Claims:
    """Of some expressions, at the present values of parameters."""

    def __init__(self, roots: list[Node]) -> None:
        self.degree: dict[int, int] = {}
        self._curvature: dict[int, int | None] = {}
        self.actions: dict[int, frozenset[int]] = {}
        self.smooth = True
        shared: dict[frozenset[int], frozenset[int]] = {}
        for node in ordered(roots):
            self.degree[id(node)] = self._degree_of(node)
            self._curvature[id(node)] = self._curvature_of(node)
            if node.op == "y":
                members = frozenset(node.args)
            elif node.op in "qc":
                members = frozenset()
            else:
                members = frozenset().union(*(self.actions[id(arg)] for arg in node.args))
            self.actions[id(node)] = shared.setdefault(members, members)
            self.smooth &= node.op != "abs" or not node.varies

    def affine(self, costs: list[Node]) -> bool:
        """Whether all derivatives are affine."""
        return all(self.degree[id(cost)] < _ABOVE for cost in costs)

    def constraint_class(self, bounds: list[Bound]) -> ConstraintClass | None:
        """Of all constraints; None where it cannot be proved."""
        degrees = [self.degree[id(bound.g)] for bound in bounds]
        if max(degrees) < 2:
            return "affine"
        if not all(self._convex(bound) for bound in bounds):
            return None
        return "quadratic" if max(degrees) < _ABOVE else "convex"

    def _convex(self, bound: Bound) -> bool:
        if bound.gap is not None:  # |gap| <= limit: g is gap^2, shifted
            return self.degree[id(bound.gap)] < 2
        return self._curvature[id(bound.g)] in (0, 1)

    def _degree_of(self, node: Node) -> int:
        if not node.varies:
            return 0
        if node.op == "y":
            return 1
        inner = [self.degree[id(arg)] for arg in node.args]
        if node.op in ("+", "-", "sum", "neg"):
            return max(inner)
        if node.op == "*":
            return min(sum(inner), _ABOVE)
        if node.op == "/" and inner[1] == 0:
            return inner[0]
        if node.op == "**" and not node.args[1].varies:
            exponent = node.tape.value(node.args[1]) if node.args[1].op == "c" else 0.0
            if exponent in (1.0, 2.0):
                return min(int(exponent) * inner[0], _ABOVE)
        return _ABOVE

    def _curvature_of(self, node: Node) -> int | None:
        """1 convex, -1 concave, 0 affine, None unknown."""
        if self.degree[id(node)] < 2:
            return 0
        inner = [self._curvature[id(arg)] for arg in node.args]
        if node.op in ("+", "sum", "-", "neg"):
            signs = [-1 if node.op == "neg" or (node.op == "-" and k) else 1
                     for k in range(len(inner))]  # fmt: skip
            bent = {c if c is None else c * s for c, s in zip(inner, signs, strict=True)} - {0}
            return None if len(bent) > 1 else next(iter(bent), 0)
        if node.op in "*/" and not node.args[1].varies:
            return _scaled(inner[0], node.tape.value(node.args[1]))
        if node.op == "*" and not node.args[0].varies:
            return _scaled(inner[1], node.tape.value(node.args[0]))
        if node.op == "*" and node.args[0] is node.args[1] and inner[0] == 0:
            return 1
        if node.op == "**" and not node.args[1].varies:
            exponent = node.tape.value(node.args[1])
            even = exponent > 0 and exponent % 2 == 0
            return 1 if inner[0] == 0 and even else None
        if node.op == "abs":
            return 1 if inner[0] == 0 else None
        bend = _CONVEX.get(node.op)
        return bend if bend is not None and inner[0] in (0, bend) else None

    def squares(self, node: Node) -> list[tuple[float, Node]] | None:
        """(c, e) with the expression sum c e^2, c > 0 and all e affine; None if it is none."""
        found, waiting = [], [(node, 1.0)]
        while waiting:
            each, factor = waiting.pop()
            if each.op in ("+", "sum"):
                waiting += [(arg, factor) for arg in each.args]
                continue
            if each.op in "*/" and not each.args[1].varies:
                by = each.tape.value(each.args[1])
                waiting.append((each.args[0], factor * by if each.op == "*" else factor / by))
                continue
            if each.op == "*" and not each.args[0].varies:
                waiting.append((each.args[1], factor * each.tape.value(each.args[0])))
                continue
            power = each.op == "**" and not each.args[1].varies
            square = (power and each.tape.value(each.args[1]) == 2.0) or (
                each.op == "*" and each.args[0] is each.args[1]
            )
            if not square or not factor > 0.0 or self.degree[id(each.args[0])] != 1:
                return None
            found.append((factor, each.args[0]))
        return found

    def gap_bound(self, bound: Bound) -> float | None:
        """delta of a constraint |gap| <= delta whose gap is affine, of one or more entries.

        Raises:
            InvalidInput: no sum of squares is below this bound.
        """
        if bound.gap is not None and bound.limit is not None:
            limit = bound.limit.tape.value(bound.limit)
            return limit if self.degree[id(bound.gap)] == 1 else None
        assert bound.sides is not None
        less, more = bound.sides
        squares = None if more.varies else self.squares(less)
        if squares is None or any(factor != 1.0 for factor, _ in squares):
            return None
        limit = more.tape.value(more)
        if not limit > 0.0:
            expected = f"it has no inside: squares do not add up to less than {limit:g}"
            raise InvalidInput("constraints", bound.name, expected)
        return float(np.sqrt(limit))


def _scaled(curvature: int | None, factor: float) -> int | None:
    if curvature is None:
        return None
    return curvature * int(np.sign(factor))


def _sides(bounds: list[Bound], claims: Claims) -> list[tuple[Node, float, float]]:
    """(e, sign, limit) for what follows of affine e: e sign <= limit."""
    found = []
    for bound in bounds:
        value = bound.g.tape.value
        if bound.gap is not None and bound.limit is not None:
            found += [(bound.gap, sign, value(bound.limit)) for sign in (1.0, -1.0)]
            continue
        found.append((bound.g, 1.0, 0.0))
        assert bound.sides is not None
        less, more = bound.sides
        if not more.varies and value(more) > 0.0:
            for factor, gap in claims.squares(less) or ():
                most = float(np.sqrt(value(more) / factor))
                found += [(gap, 1.0, most), (gap, -1.0, most)]
    return [each for each in found if claims.degree[id(each[0])] == 1]


def box(bounds: list[Bound], claims: Claims, actions: int) -> Box | None:
    """Bounds of all actions that follow from affine constraints, each from the others'; None if
    an action has none."""
    rows = []
    for node, sign, limit in _sides(bounds, claims):
        slopes, offset = _affine_parts(node)
        which, by = np.array([*slopes]), sign * np.array([*slopes.values()])
        rows.append((which, by, limit - sign * offset))
    lower, upper = np.full(actions, -np.inf), np.full(actions, np.inf)
    for _ in range(_SWEEPS):
        before = (lower.copy(), upper.copy())
        for which, slope, most in rows:
            _tighten(which, slope, most, lower, upper)
        if all(np.array_equal(a, b) for a, b in zip(before, (lower, upper), strict=True)):
            break
    if not np.all(np.isfinite([lower, upper])) or not np.all(lower < upper):
        return None
    room = _SLACK * (1.0 + np.maximum(np.abs(lower), np.abs(upper)))
    return lower - room, upper + room


def _tighten(which: NDArray[np.int64], slope: NDArray[np.float64], most: float,
             lower: NDArray[np.float64], upper: NDArray[np.float64]) -> None:  # fmt: skip
    """From slope . y[which] <= most."""
    keep = slope != 0.0
    which, slope = which[keep], slope[keep]
    least = np.where(slope > 0, slope * lower[which], slope * upper[which])
    unknown = ~np.isfinite(least)
    found = np.ones(len(which), dtype=bool) if not np.any(unknown) else unknown
    if np.count_nonzero(unknown) > 1 or not len(which):
        return
    known = np.where(unknown, 0.0, least)
    bound = ((most - np.sum(known) + known) / slope)[found]
    which, rises = which[found], slope[found] > 0
    upper[which[rises]] = np.minimum(upper[which[rises]], bound[rises])
    lower[which[~rises]] = np.maximum(lower[which[~rises]], bound[~rises])


def _affine_parts(root: Node) -> tuple[dict[int, float], float]:
    """Slopes by action, and offset."""
    slopes: dict[int, float] = {}
    offset, waiting = 0.0, [(root, 1.0)]
    while waiting:
        node, factor = waiting.pop()
        if not node.varies:
            offset += factor * node.tape.value(node)
        elif node.op == "y":
            slopes[node.args[0]] = slopes.get(node.args[0], 0.0) + factor
        elif node.op in ("+", "sum"):
            waiting += [(arg, factor) for arg in node.args]
        elif node.op == "-":
            waiting += [(node.args[0], factor), (node.args[1], -factor)]
        elif node.op == "neg":
            waiting.append((node.args[0], -factor))
        elif node.op == "/":
            waiting.append((node.args[0], factor / node.tape.value(node.args[1])))
        elif node.op == "**":  # by one
            waiting.append((node.args[0], factor))
        else:
            known, other = node.args if not node.args[0].varies else node.args[::-1]
            waiting.append((other, factor * node.tape.value(known)))
    return slopes, offset


def values(roots: list[Node], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Expressions at profiles (samples, m): (samples, roots)."""
    found: dict[int, NDArray[np.float64] | float] = {}
    with np.errstate(all="ignore"):
        for node in ordered(roots):
            if node.op == "y":
                found[id(node)] = y[:, node.args[0]]
            elif not node.varies:
                found[id(node)] = node.tape.value(node)
            else:
                found[id(node)] = evaluate(node.op, [found[id(arg)] for arg in node.args])
    columns = [np.broadcast_to(found[id(root)], len(y)) for root in roots]
    return np.stack(columns, axis=1)
