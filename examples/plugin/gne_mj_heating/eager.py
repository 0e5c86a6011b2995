"""Law ``eager``: full information with a gain, u = -k (F(y) + gradient of the barrier)."""

import sys
from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import Field

from gne_mj.barrier import weighted_gradient
from gne_mj.controllers import Law
from gne_mj.controllers.settings import GAIN
from gne_mj.controllers.table import LawTable
from gne_mj.native import kernel
from gne_mj.registry import LAWS


@dataclass(frozen=True, eq=False)
class Eager(Law):
    """Gradient feedback, ``gain`` times as strong."""

    information: ClassVar[str] = "eager"
    guarded: ClassVar[bool] = True
    gain: float = 1.0

    @property
    def kernels(self):
        """This module."""
        return sys.modules[__name__]


@kernel
def action(game, problem, y, weights, memory, work, u):
    """Fill u (m,) from the profile y (m,) and the barrier's weights (p,) there."""
    data, gain = problem.data, problem.settings[GAIN]
    at = data.offsets
    for i in range(len(at) - 1):
        for a in range(at[i], at[i + 1]):
            slope = game.cost_gradient(data.parameters, i, a, y)
            u[a] = -gain * (slope + weighted_gradient(game, data, i, a, y, weights))
    return -1


@kernel
def rate(problem, y, memory, out):
    """No memory, no rate."""


@kernel
def propagate(problem, y, memory, scratch):
    """No memory to propagate."""


@kernel
def storage(problem, memory):
    """No memory, no storage."""
    return 0.0


@LAWS.register
class EagerController(LawTable):
    """Full information with a gain."""

    information: Literal["eager"]
    gain: float = Field(1.0, gt=0, description="k")

    def build(self, game):
        """The law."""
        return Eager(self.gain)
