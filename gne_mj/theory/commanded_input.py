"""What the law asks of the actuators at the start, and whether they can deliver it."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.faults import Saturation
from gne_mj.system import System
from gne_mj.system.first_input import limits_at

Array = NDArray[np.float64]


def limited(system: System) -> bool:
    """Whether actuators have limits at any time."""
    return bool(np.any(np.isfinite(system.agents.input_limit))) or any(
        isinstance(fault, Saturation) for fault in system.faults
    )


@dataclass(frozen=True, eq=False)
class CommandedInput:
    """Inputs at the start.

    Args:
        system: whose.
        asked: (m,) |u| that is asked for, not a number where that is not known.
        of: what it is the input of, in words.
    """

    system: System
    asked: Array
    of: str

    @property
    def exceeded(self) -> str | None:
        """By whom a limit is exceeded most at the start, in words; None if by nobody for sure."""
        limit = limits_at(self.system, 0.0)
        if not np.any(self.asked > limit):
            return None
        with np.errstate(divide="ignore", invalid="ignore"):
            worst = int(np.argmax(np.where(self.asked > limit, self.asked / limit, 0.0)))
        asked, most = float(self.asked[worst]), float(limit[worst])
        times = f"{asked / most:.3g} times its limit {most:g}" if most else "its limit being 0"
        return f"{self.of} asks agent {self._agent(worst)} for {asked:.4g}, {times}"

    def report(self) -> dict[str, Any]:
        """As plain data."""
        limit = limits_at(self.system, 0.0)
        largest = int(np.argmax(np.where(np.isnan(self.asked), np.inf, self.asked)))
        with np.errstate(divide="ignore", invalid="ignore"):
            factors = self.asked / limit
        return {
            "of": self.of,
            "largest": float(self.asked[largest]),
            "agent": self._agent(largest),
            "each": self.asked.tolist(),
            "limits": limit.tolist() if limited(self.system) else None,
            "largest_factor": float(np.max(factors)) if limited(self.system) else None,
            "exceeded": self.exceeded,
        }

    def _agent(self, channel: int) -> int:
        return int(self.system.game.agent_of_action[channel]) + 1
