"""The clock that all systems of a run share."""

from dataclasses import dataclass

import numpy as np

from gne_mj.bounds import LONGEST, MOST_STEPS, SHORTEST
from gne_mj.errors import InvalidInput


@dataclass(frozen=True)
class Clock:
    """The clock that all systems of a run share; times in s.

    Args:
        duration: how long to run.
        timestep: integration step.
        control_period: how long an input is held in the held modes; a multiple of the step.
        sample_period: between recorded samples; a multiple of the step.
    """

    duration: float
    timestep: float
    control_period: float
    sample_period: float

    def __post_init__(self) -> None:
        for key in ("duration", "timestep", "control_period", "sample_period"):
            value = getattr(self, key)
            if not (np.isfinite(value) and value > 0):
                raise InvalidInput(key, value, "it must be positive and finite")
            if not SHORTEST <= value <= LONGEST:
                raise InvalidInput(key, value, f"it must lie from {SHORTEST:g} to {LONGEST:g} s")
        for key in ("control_period", "sample_period", "duration"):
            steps = getattr(self, key) / self.timestep
            if steps > MOST_STEPS:
                raise InvalidInput(
                    key,
                    getattr(self, key),
                    f"it must be at most {MOST_STEPS:.0e} timesteps of {self.timestep:g} s",
                )
            if round(steps) < 1 or abs(steps - round(steps)) > 1e-6:
                raise InvalidInput(
                    key,
                    getattr(self, key),
                    f"it must be a multiple of the timestep {self.timestep:g} s",
                )

    def steps(self, time: float) -> int:
        """Integration steps in a time."""
        return round(time / self.timestep)
