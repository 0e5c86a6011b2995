"""A certified epsilon* of the fully distributed law, from a start.

On the set S(epsilon) of :mod:`gne_mj.theory.invariant_set`, which holds the start and is kept under
all smaller epsilon too, W falls for epsilon below what :mod:`gne_mj.theory.composite` says. Where
that is above the epsilon of the set, both hold for all up to it, and it is certified.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from gne_mj.system import System
from gne_mj.theory.composite import Composite
from gne_mj.theory.fast_errors import Lags
from gne_mj.theory.invariant_set import InvariantSet, invariant_set
from gne_mj.theory.linear_loop import LinearLoop, linear_loop, why_not

# The search: by which factor it goes down, where it ends, and how closely
_DOWN, _LEAST, _MOST, _PRECISION = 4.0, 1e-12, 1e6, 1.03


class Kept(NamedTuple):
    """What is certain of all epsilon up to one.

    Attributes:
        epsilon: that one, in s.
        held: the set that is kept.
        falls_below: W falls on it for all epsilon below this, which is above ``epsilon``.
    """

    epsilon: float
    held: InvariantSet
    falls_below: float


@dataclass(frozen=True, eq=False)
class EpsilonBound:
    """The bound for a system that meets the assumptions of the fully distributed theorem.

    Args:
        system: with its start, which the set must hold.
    """

    system: System
    _tried: dict[float, Kept | None] = field(default_factory=dict, repr=False)

    @cached_property
    def why_not(self) -> str | None:
        """Why none can be computed; None if it can."""
        return why_not(self.system)

    @property
    def given(self) -> bool:
        """Whether the system's own epsilon is certified."""
        assert self.system.law.epsilon is not None
        return self.why_not is None and self.at(self.system.law.epsilon) is not None

    @cached_property
    def star(self) -> Kept | None:
        """The greatest one found; None if there is none."""
        epsilon = self.system.law.epsilon
        assert epsilon is not None
        if self.why_not is not None:
            return None
        found, high = self.at(epsilon), epsilon
        if found is None and self.at(_LEAST) is None:  # smaller ones are easier
            return None
        while found is None:
            high, epsilon = epsilon, epsilon / _DOWN
            if epsilon < _LEAST:
                return None
            found = self.at(epsilon)
        high = min(_MOST, found.falls_below) if self.given else min(high, found.falls_below)
        while high > _PRECISION * found.epsilon:
            middle = float(np.sqrt(found.epsilon * high))
            better = self.at(middle)
            if better is None:
                high = middle
            else:
                found, high = better, min(high, better.falls_below)
        return found

    def at(self, epsilon: float) -> Kept | None:
        """What is certain of all epsilon up to this one; None if nothing was found."""
        if epsilon not in self._tried:
            self._tried[epsilon] = self._examined(epsilon)
        return self._tried[epsilon]

    def report(self) -> dict[str, Any]:
        """All of it as plain data; None stands for what is not known."""
        star, game = self.star, self.system.game
        found: dict[str, Any] = {
            "star": None,
            "label": "certified, sufficient",
            "fast_weight": self.system.law.fast_weight,
            "no_star": self.why_not,
            "kept": None,
        }
        if star is None:
            found["no_star"] = self.why_not or "no invariant set about the start was found"
            return found
        held = star.held
        tightest = int(np.argmin(held.floor))
        found["star"] = star.epsilon
        found["kept"] = {
            "level": held.level,
            "floor": held.floor.tolist(),
            "constraint": game.constraint_names[tightest % game.constraints_count],
            "estimates_error": float(max(np.max(held.behind), np.max(held.ahead))),
            "falls_below": star.falls_below,
        }
        return found

    def _examined(self, epsilon: float) -> Kept | None:
        loop, weight = self._loop, self.system.law.fast_weight
        held = invariant_set(loop, self._lags, epsilon, weight)
        if held is None:
            return None
        falls_below = Composite(loop, self._lags, held, weight).largest_epsilon()
        return Kept(epsilon, held, falls_below) if falls_below > epsilon else None

    @cached_property
    def _loop(self) -> LinearLoop:
        return linear_loop(self.system)

    @cached_property
    def _lags(self) -> Lags:
        return Lags(self._loop.graph)
