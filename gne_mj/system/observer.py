"""What an observer of loads needs of a system."""

import numpy as np

from gne_mj.errors import InvalidInput
from gne_mj.faults import sensor_delay
from gne_mj.registry import MODES
from gne_mj.system.data import SystemData


def check_observer(system: SystemData) -> None:
    """Refuse what an observer has no meaning for.

    Raises:
        InvalidInput: names ``observer`` or ``load``.
    """
    key, gain = "observer", system.observer
    if not 0.0 <= gain <= 1.0:
        raise InvalidInput(key, gain, "a part of an innovation lies from 0 (no observer) to 1")
    if system.load is not None:
        if gain == 0.0:
            raise InvalidInput("load", system.load, "it is what controller.observer begins with")
        if system.load.shape != (system.game.actions,) or not np.all(np.isfinite(system.load)):
            raise InvalidInput(
                "load", system.load, f"it must be {system.game.actions} finite numbers"
            )
    bound = system.disturbance
    if gain == 0.0:
        if bound is not None and bound.change is not None and np.any(bound.change > 0):
            raise InvalidInput(
                "disturbance", "a bound on a push's change (push_change)",
                "it is for controller.observer > 0, which follows pushes",
            )  # fmt: skip
        return
    if not MODES[system.mode].observes:
        names = " and ".join(f"'{mode.name}'" for mode in MODES if mode.observes)
        raise InvalidInput(key, gain, f"it compares outputs with predicted ones: use mode {names}")
    late = bound is not None and bound.delay > 0
    if late or sensor_delay(system.faults) > 0:
        raise InvalidInput(
            key, gain, "late sensors tell of loads that were: leave it out, or the delay"
        )
