"""Mode ``continuous``: the law is evaluated at every stage of the integrator.

With fixed steps these are divided near the boundary (:mod:`gne_mj.loops.division`), which the
report tells. The theorems speak of this mode, up to the integrator's error.
"""

from typing import Any

import numpy as np

from gne_mj.errors import InvalidInput
from gne_mj.loops.ode import CONTINUOUS
from gne_mj.system.data import ADAPTIVE, SystemData
from gne_mj.system.modes.mode import Array, Figure, Mode, entry


def _smallest(monitors: Any) -> Array:
    shortest = monitors.smallest_step
    return np.where(shortest > 0, shortest, np.nan)


class Continuous(Mode):
    """See the module."""

    name = "continuous"
    native = CONTINUOUS
    held = False
    keeps_apart = True
    section = "division"
    figures = (
        Figure(
            "divided_steps", entry("divided"),
            long_name="integration steps divided near the boundary",
        ),
        Figure("smallest_step", _smallest, "s", "shortest piece of a divided step"),
    )  # fmt: skip

    def check_law(self, system: SystemData) -> None:
        """The law's memory must have a rate."""
        super().check_law(system)
        if not hasattr(system.law.kernels, "rate"):
            words = f"the {system.law.information} law acts once a control period: use 'sampled'"
            raise InvalidInput("mode", self.name, words)

    def measures_stages(self, system: SystemData) -> bool:
        """Of methods that have some."""
        return system.integrator != "euler"

    def departure(self, system: SystemData) -> str:
        """Euler's method keeps an input for a step."""
        return "Euler's method" if system.integrator == "euler" else ""

    def explicit_period(self, control_period: float, timestep: float) -> float | None:
        """A step."""
        return timestep

    def divides(self, system: SystemData) -> bool:
        """With fixed steps."""
        return system.integrator not in ADAPTIVE

    def reports(self, system: SystemData) -> bool:
        """With fixed steps."""
        return self.divides(system)

    def report(self, system: SystemData, monitor: Any) -> dict[str, Any]:
        """How many steps were divided, and the shortest piece in s, None if none was."""
        return {
            "divided_steps": int(monitor.divided),
            "smallest_step": float(monitor.smallest_step) or None,
        }
