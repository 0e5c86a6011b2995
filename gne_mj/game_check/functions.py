"""A game's functions as its author wrote them, called one by one at profiles inside the set.

Kernels are plain Python functions too, and called as such: hardly anything is compiled, and an
entry beyond an array's end is noticed.
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import UserCodeError
from gne_mj.game_check.differences import derivative, steps
from gne_mj.game_model import Game
from gne_mj.plain import not_a_number, number_of

Array = NDArray[np.float64]
_HALVINGS = 60
_OF_COSTS = ("cost", "cost_gradient", "add_cost_hessian")


class Functions:
    """A game's functions; every method may raise UserCodeError.

    Args:
        game: whose.
    """

    def __init__(self, game: Game) -> None:
        self.game = game
        self._functions = game.written.functions
        self._q = game.written.parameters.copy()
        self._q.flags.writeable = False
        self._margins, self._violated = game.margins, 0
        self._all = range(game.constraints_count)

    def cost(self, i: int, y: Array) -> float:
        """J_i."""
        return self._number("cost", y, i)

    def slope(self, i: int, a: int, y: Array) -> float:
        """dJ_i/dy_a, a of agent i."""
        return self._number("cost_gradient", y, i, a)

    def add_row(self, i: int, a: int, y: Array, scale: float, out: Array) -> None:
        """What the author's add_cost_hessian does to ``out`` (m,)."""
        self._call("add_cost_hessian", y, i, a, _readonly(y), scale, out)
        if not np.all(np.isfinite(out)):
            again = (i, a, _readonly(y), scale, np.zeros(len(out)))
            raise self._no_number("add_cost_hessian", y, *again)

    def row(self, i: int, a: int, y: Array) -> Array:
        """d2J_i/dy_a dy, (m,)."""
        out = np.zeros(self.game.actions)
        self.add_row(i, a, y, 1.0, out)
        return out

    def constraint(self, k: int, y: Array) -> float:
        """g_k."""
        return self._number("constraint", y, k)

    def constraint_slope(self, k: int, a: int, y: Array) -> float:
        """dg_k/dy_a."""
        return self._number("constraint_gradient", y, k, a)

    def constraint_curvature(self, k: int, a: int, b: int, y: Array) -> float:
        """d2g_k/dy_a dy_b."""
        return self._number("constraint_hessian", y, k, a, b)

    def actions_of(self, agents: Iterable[int]) -> NDArray[np.int64]:
        """The entries of a profile that belong to these agents."""
        return np.flatnonzero(np.isin(self.game.agent_of_action, list(agents)))

    def inside(self, profiles: Iterable[Array], constraints: Sequence[int] | None = None) -> bool:
        """Whether all profiles are strictly inside (these constraints, tightened or not).

        Where a constraint fails or is no number, a profile is not.
        """
        t = self._margins
        if constraints is None and self.game.native:  # compiled anyway, to look at the start
            return bool(np.all(self.game.constraints(np.array(list(profiles))) + t < 0.0))
        which = self._all if constraints is None else constraints
        try:
            for y in map(_readonly, profiles):
                for k in (self._violated, *which):  # what stopped the last one often stops the next
                    if not self.constraint(k, y) + t[k] < 0.0:
                        self._violated = k
                        return False
        except UserCodeError:
            return False
        return True

    def reach(self, y: Array, direction: Array, constraints: Sequence[int] | None = None) -> float:
        """How far y +- reach * direction is surely inside; 0 if not at all."""
        moved = direction != 0.0
        length = max(1.0, float(np.max(np.abs(y[moved]), initial=0.0)))
        length *= 0.25 / float(np.max(np.abs(direction)))
        for _ in range(_HALVINGS):
            if self.inside((y + length * direction, y - length * direction), constraints):
                return length
            length *= 0.5
        return 0.0

    def stencil(
        self, y: Array, direction: Array, constraints: Sequence[int] | None = None
    ) -> "Stencil | None":
        """Profiles along a direction for differences, none of them outside.

        Args:
            y: (m,) strictly inside.
            direction: (m,).
            constraints: those that the direction can change; all if left out.

        Returns:
            None where there is no room for a step.
        """
        # Not all the way: near a bound a function may be steep
        reach = 0.5 * self.reach(y, direction, constraints)
        for _ in range(_HALVINGS):
            h = steps(reach)
            ahead = _readonly(y + h[:, None] * direction)
            behind = _readonly(y - h[:, None] * direction)
            if reach == 0.0 or self.inside((*ahead, *behind), constraints):
                break
            reach *= 0.5
        if reach < 1e-10 * max(1.0, float(np.max(np.abs(y)))):
            return None
        return Stencil(y, direction, h, ahead, behind)

    def finer(self, stencil: "Stencil", factor: float) -> "Stencil | None":
        """The same with steps that are shorter by a factor; None where one is outside."""
        h = factor * stencil.h
        ahead = _readonly(stencil.middle + h[:, None] * stencil.direction)
        behind = _readonly(stencil.middle - h[:, None] * stencil.direction)
        if not self.inside((*ahead, *behind)):
            return None
        return Stencil(stencil.middle, stencil.direction, h, ahead, behind)

    def _call(self, name: str, y: Array, *arguments: Any) -> Any:
        function = self._functions[name]
        try:
            return function(self._q, *arguments)
        except KeyboardInterrupt:
            raise
        except BaseException as error:
            raise UserCodeError(function, error, self._place(name, y, arguments[0])) from error

    def _number(self, name: str, y: Array, *numbers: int) -> float:
        value = self._call(name, y, *numbers, _readonly(y))
        number = number_of(self._functions[name], value)
        if not math.isfinite(number):
            raise self._no_number(name, y, *numbers, _readonly(y))
        return number

    def _no_number(self, name: str, y: Array, *arguments: Any) -> UserCodeError:
        function = self._functions[name]

        def again() -> None:
            with np.errstate(over="raise"):
                function(self._q, *arguments)

        return not_a_number(function, again, self._place(name, y, arguments[0]))

    def _place(self, name: str, y: Array, which: int) -> str:
        names = self.game.constraint_names
        whose = f"agent {which + 1}" if name in _OF_COSTS else f"constraint '{names[which]}'"
        return f"for {whose} at y = {shown_profile(y)}"


@dataclass(frozen=True, eq=False)
class Stencil:
    """Profiles on both sides of one, all inside.

    Attributes:
        middle: (m,).
        direction: (m,).
        h: (STEPS,) how far from the middle.
        ahead, behind: (STEPS, m).
    """

    middle: Array
    direction: Array
    h: Array
    ahead: Array
    behind: Array

    def derivative(self, function: Callable[[Array], float]) -> tuple[float, float]:
        """A function's derivative along the direction, and its error."""
        ahead = np.array([function(y) for y in self.ahead])
        behind = np.array([function(y) for y in self.behind])
        moved = self.middle[self.direction != 0.0]
        around = max(1.0, float(np.max(np.abs(moved)))) / float(np.max(np.abs(self.direction)))
        return derivative(ahead, behind, self.h, around)


def unit(length: int, a: int) -> Array:
    """The direction of one action."""
    direction = np.zeros(length)
    direction[a] = 1.0
    return direction


def _readonly(y: Array) -> Array:
    if y.flags.writeable:
        y = y.copy()
        y.flags.writeable = False
    return y


def shown_profile(y: Array) -> str:
    """A profile for a message."""
    entries = [f"{value:.6g}" for value in y[:8]]
    return "[" + ", ".join(entries + (["..."] if len(y) > 8 else [])) + "]"
