"""A set that the fully distributed loop does not leave, for all epsilon up to a given one.

S holds what has W <= W(0), every slack s_l >= its floor, and errors of the estimates that motions
no faster than those of S can bring about (:mod:`gne_mj.theory.fast_errors`). It is found by going
around: floors and errors bound the speeds, speeds and epsilon bound the errors, and each floor is
where the barrier's push outweighs all else, so that s_l rises there.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gne_mj.theory.fast_errors import Lags
from gne_mj.theory.linear_loop import LinearLoop
from gne_mj.theory.relaxation import Cells, least_sum

Array = NDArray[np.float64]

# Intervals of each action, rounds until nothing grows any more, and by how much more than was
# found is taken each time
_CELLS, _ROUNDS, _AHEAD = 64, 40, 1.03


@dataclass(frozen=True, eq=False)
class InvariantSet:
    """Bounds that hold on S.

    Attributes:
        level: V <= this.
        floor, ceiling: of the slacks at the actions, (p,).
        short, over: by how much what agent i takes a slack to be may fall short of it, and exceed
            it, (p, N).
        behind, ahead: by how much estimates, and z on own entries, may be below and above the
            actions, (N, m).
        lower, upper: of the actions, (m,).
    """

    level: float
    floor: Array
    ceiling: Array
    short: Array
    over: Array
    behind: Array
    ahead: Array
    lower: Array
    upper: Array


@dataclass(frozen=True, eq=False)
class Speeds:
    """What bounds y' on S: of each action up and down, (m,), and of the sums
    sum_a (A_la y_a')^+ that shrink each slack (``closing``) or widen it (``opening``), (p,)."""

    up: Array
    down: Array
    closing: Array
    opening: Array


def invariant_set(
    loop: LinearLoop, lags: Lags, epsilon: float, weight: float
) -> InvariantSet | None:
    """S for all epsilon up to this one, W = V + weight V_fast; None if none was found."""
    spread = np.array([lags.of_greatest(loop.owner[row != 0.0]) for row in loop.slopes])
    level = loop.start[0] + weight * loop.start[1]
    least = np.minimum(loop.slack, loop.start_slack)
    held = _first(loop, lags, level, 0.99 * least)
    for _ in range(_ROUNDS):
        held = _within(loop, held)
        forces = Forces(loop, held) if _has_room(held) else None
        if forces is None or forces.bounds is None:
            return None
        floor = np.minimum([forces.floor(row) for row in range(len(least))], 0.99 * least)
        after = _with_errors(loop, lags, spread, epsilon, replace(held, floor=floor), forces.speeds)
        if not np.all(floor > 0.0):
            return None
        if _covers(held, after):
            return held
        held = replace(
            after, floor=np.where(held.floor <= floor, held.floor, floor / _AHEAD),
            short=np.maximum(held.short, _AHEAD * after.short),
            over=np.maximum(held.over, _AHEAD * after.over),
            behind=np.maximum(held.behind, _AHEAD * after.behind),
            ahead=np.maximum(held.ahead, _AHEAD * after.ahead),
        )  # fmt: skip
    return None


def _first(loop: LinearLoop, lags: Lags, level: float, floor: Array) -> InvariantSet:
    """Errors of the start alone."""
    none = np.zeros((loop.game.agents, len(loop.action)))
    found = InvariantSet(
        level, floor, floor, np.zeros((len(floor), loop.game.agents)),
        np.zeros((len(floor), loop.game.agents)), none, none, loop.action, loop.action,
    )  # fmt: skip
    still = Speeds(*(np.zeros(size) for size in (len(loop.action),) * 2 + (len(floor),) * 2))
    return _with_errors(loop, lags, np.zeros((len(floor), 1)), 0.0, found, still)


def _within(loop: LinearLoop, held: InvariantSet) -> InvariantSet:
    """With bounds of the actions and slacks that follow from V's level and the floors."""
    radius = np.sqrt(2.0 * held.level * loop.room)
    lower, upper = loop.action - radius, loop.action + radius
    if loop.game.box is not None:
        lower = np.maximum(lower, loop.game.box[0])
        upper = np.minimum(upper, loop.game.box[1])
    a = loop.slopes
    most = loop.slack + a @ loop.action - held.floor  # A y <= this
    least_terms = np.minimum(a * lower, a * upper)
    rest = (most - least_terms.sum(axis=1))[:, None] + least_terms  # A_la y_a <= this
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = rest / a
    upper = np.minimum(upper, np.min(np.where(a > 0.0, ends, np.inf), axis=0))
    lower = np.maximum(lower, np.max(np.where(a < 0.0, ends, -np.inf), axis=0))
    reach = np.sqrt(2.0 * held.level * (a * a) @ loop.room)
    box = loop.slack + a @ loop.action - np.minimum(a * lower, a * upper).sum(axis=1)
    return replace(held, lower=lower, upper=upper, ceiling=np.minimum(loop.slack + reach, box))


def _has_room(held: InvariantSet) -> bool:
    inside = np.all(held.floor[:, None] > held.short)
    return bool(inside and np.all(held.upper >= held.lower))


def _with_errors(
    loop: LinearLoop, lags: Lags, spread: Array, epsilon: float, held: InvariantSet, speeds: Speeds
) -> InvariantSet:
    """With the errors that come of the speeds, and of where the estimates start."""
    share = lags.total[:, loop.owner]  # (N, m)
    start = share * np.max(np.abs(loop.offset) / share, axis=0)
    behind, ahead = epsilon * share * speeds.up, epsilon * share * speeds.down
    a, size = loop.slopes, np.abs(loop.slopes)
    opening = np.maximum(a, 0.0) @ behind.T + np.maximum(-a, 0.0) @ ahead.T
    closing = np.maximum(a, 0.0) @ ahead.T + np.maximum(-a, 0.0) @ behind.T
    of_start = size @ start.T
    return replace(
        held,
        short=of_start + np.minimum(closing, epsilon * spread * speeds.opening[:, None]),
        over=of_start + np.minimum(opening, epsilon * spread * speeds.closing[:, None]),
        behind=start + behind,
        ahead=start + ahead,
    )


def _covers(held: InvariantSet, after: InvariantSet) -> bool:
    """Whether the floors are low and the errors large enough to hold what follows from them."""
    return bool(
        np.all(held.floor <= after.floor)
        and np.all(held.short >= after.short)
        and np.all(held.over >= after.over)
        and np.all(held.behind >= after.behind)
        and np.all(held.ahead >= after.ahead)
    )


class Forces:
    """Bounds over S of k (F + grad phi) as agents take it to be, interval by interval.

    Args:
        loop: the loop.
        held: S.

    Attributes:
        bounds: (lower, upper), each (K, m), or None if the game bounds no slopes of F here.
        pushes: the parts of each constraint in them, (lower, upper), each (p, K, m).
    """

    def __init__(self, loop: LinearLoop, held: InvariantSet) -> None:
        self._loop, self._held = loop, held
        edges = np.linspace(held.lower, held.upper, _CELLS + 1)
        self._cells = Cells(
            edges[:-1] - loop.action, edges[1:] - loop.action, loop.room, loop.drifts[1],
            2.0 * held.level,
        )  # fmt: skip
        along = loop.drifts[0] * np.stack([self._cells.lower, self._cells.upper])
        self._drift = along.min(axis=0), along.max(axis=0)
        costs = self._costs(edges)
        self.pushes = self._pushes(edges)
        self.bounds = None
        if costs is not None:
            parts = zip(costs, self.pushes, strict=True)
            self.bounds = tuple(loop.gain * (cost + np.sum(push, axis=0)) for cost, push in parts)

    def _costs(self, edges: Array) -> tuple[Array, Array] | None:
        """F_a on each interval: by each other entry it rises or falls, the same way everywhere."""
        loop, held = self._loop, self._held
        own = loop.owner[None, :] == np.arange(loop.game.agents)[:, None]
        low = np.where(own, held.lower, held.lower - held.behind)[loop.owner]  # (m, m), by rows
        high = np.where(own, held.upper, held.upper + held.ahead)[loop.owner]
        rows = loop.jacobian_bounds(low.min(axis=0), high.max(axis=0))
        if rows is None:
            return None
        rising = rows[1] >= 0.0
        found = []
        for least in (True, False):
            corner = np.where(rising == least, low, high)
            profiles = np.repeat(corner[None], _CELLS, axis=0)
            ends = edges[:-1] if least else edges[1:]
            index = np.arange(len(loop.action))
            profiles[:, index, index] = ends
            values = loop.game.pseudo_gradient(profiles)
            found.append(values[:, index, index])
        return found[0], found[1]

    def _pushes(self, edges: Array) -> tuple[Array, Array]:
        """A_la rho / (slack that a's owner takes it to be), (p, K, m) from below and above."""
        loop, held, a = self._loop, self._held, self._loop.slopes
        terms = (
            np.minimum(a * held.lower, a * held.upper),
            np.maximum(a * held.lower, a * held.upper),
        )
        whole = loop.slack + a @ loop.action
        moving = np.stack([a[:, None] * edges[:-1], a[:, None] * edges[1:]])  # (2, p, K, m)
        least = whole[:, None, None] - moving.max(axis=0)
        least -= (terms[1].sum(axis=1)[:, None] - terms[1])[:, None]
        most = whole[:, None, None] - moving.min(axis=0)
        most -= (terms[0].sum(axis=1)[:, None] - terms[0])[:, None]
        floor, ceiling = held.floor[:, None, None], held.ceiling[:, None, None]
        near = np.clip(least, floor, ceiling) - held.short[:, None, loop.owner]
        far = np.clip(most, floor, ceiling) + held.over[:, None, loop.owner]
        strong, weak = loop.rho * a[:, None] / near, loop.rho * a[:, None] / far
        return np.minimum(strong, weak), np.maximum(strong, weak)

    @property
    def speeds(self) -> Speeds:
        """How fast actions and slacks can move on S."""
        assert self.bounds is not None
        loop, (low, high) = self._loop, self.bounds
        up = np.max(self._drift[1] - low + self._cells.left, axis=0)
        down = np.max(high - self._drift[0] + self._cells.left, axis=0)
        rows = range(len(loop.slopes))
        sums = np.array([[self._moving(row, sign) for sign in (1.0, -1.0)] for row in rows])
        return Speeds(np.maximum(up, 0.0), np.maximum(down, 0.0), sums[:, 0], sums[:, 1])

    def _moving(self, which: int, sign: float) -> float:
        """sup of sum_a (sign A_a y_a')^+ over S, y_a' being f_a'e less the force."""
        assert self.bounds is not None
        row = self._loop.slopes[which]
        low, high = self.bounds
        ends = sign * row * (self._drift[0] - high), sign * row * (self._drift[1] - low)
        fastest = np.maximum(np.maximum(*ends), 0.0)
        plane = float(self._loop.slack[which] - self._held.floor[which])
        return -least_sum(-fastest, self._cells, row, plane, equality=False)

    def floor(self, which: int) -> float:
        """Up to which slack the constraint's own push outweighs all else at the present floor.

        There s' = -A y' = sum_a A_a (k F_a + k pushes of all constraints - f_a'e). What is not its
        own push is bounded below where A'e = slack at y* - floor.
        """
        assert self.bounds is not None
        loop, held, row = self._loop, self._held, self._loop.slopes[which]
        others = [bound - loop.gain * push[which]
                  for bound, push in zip(self.bounds, self.pushes, strict=True)]  # fmt: skip
        ends = row * (others[0] - self._drift[1]), row * (others[1] - self._drift[0])
        values = np.minimum(*ends)
        plane = float(loop.slack[which] - held.floor[which])
        term = row * self._cells.lower, row * self._cells.upper
        least, most = np.minimum(*term), np.maximum(*term)
        sums = least.min(axis=0).sum(), most.max(axis=0).sum()
        fits = most >= plane - (sums[1] - most.max(axis=0))
        fits &= least <= plane - (sums[0] - least.min(axis=0))
        if not np.all(np.any(fits, axis=0)):
            return float(held.floor[which])  # no such profile: the slack never gets there
        values = np.where(fits, values, np.inf)
        need = -least_sum(values, self._cells, row, plane, equality=True)
        over = held.over[which, loop.owner]
        return _where_push_is(need, loop.gain * loop.rho * row**2, over, float(loop.slack[which]))


def _where_push_is(need: float, weights: Array, over: Array, most: float) -> float:
    """The greatest s <= most with sum_a weights_a / (s + over_a) > need; 0 if there is none."""
    lower, upper = 0.0, most
    for _ in range(50):
        middle = 0.5 * (lower + upper)
        if np.sum(weights / (middle + over)) > need:
            lower = middle
        else:
            upper = middle
    return lower
