"""Mode ``sampled``: the law is evaluated once in a control period, and its input held.

Estimates and z move exactly over the period, by the outputs at its start. Nothing is promised: a
period that is too long for the barrier's push leaves the set, unless a guard cuts it before
(:mod:`gne_mj.loops.guard`).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from gne_mj.loops import functions, guard
from gne_mj.loops.feedback import NO_ORDER, Order
from gne_mj.loops.ode import IMPLICIT, SAMPLED
from gne_mj.system.data import SystemData
from gne_mj.system.guard import acting, room_for
from gne_mj.system.modes.mode import Mode


class Sampled(Mode):
    """See the module."""

    name = "sampled"
    native = SAMPLED
    guards = True

    def native_of(self, system: SystemData) -> int:
        """With a guard it calls what looks ahead."""
        return IMPLICIT if system.guarded else SAMPLED

    def prediction(self, system: SystemData) -> Mapping[int, Any]:
        """With a guard: the law, and how long its input is held."""
        return {functions.ACT: acting(system, guard.act_sampled)} if system.guarded else {}

    def rows(self, system: SystemData) -> Order:
        """Nothing is solved; there is only room for the look ahead."""
        if not system.guarded:
            return NO_ORDER
        nothing = np.zeros(0, dtype=np.int64)
        pointer = np.zeros(system.game.constraints_count + 1, dtype=np.int64)
        return Order(
            np.arange(system.game.actions), np.zeros(2, np.int64), pointer, nothing, nothing
        )

    def solver_length(self, system: SystemData, rows: Order) -> int:
        """Of the look ahead."""
        return room_for(system, rows) if system.guarded else 0
