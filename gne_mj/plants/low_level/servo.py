"""Servos whose control is clamped: at every step the control that makes them give a force.

A servo's force is b_0 + gain c + b_1 l + b_2 v with its control c, length l and velocity v, and its
gear times that drives the joint. So c = (f / gear - b_0 - b_1 l - b_2 v) / gain. How much force its
ctrlrange lets through depends on where it is and how it moves, so that no ``input_limit`` can say
it: what is beyond is clamped, and counted.
"""

import sys
from typing import TYPE_CHECKING, Literal

import numpy as np
from pydantic import Field

from gne_mj.native import kernel
from gne_mj.plants.low_level.table import Controller, ControllerTable, Seen
from gne_mj.plants.mjcf_output import Output
from gne_mj.registry import LOW_LEVEL

if TYPE_CHECKING:
    from gne_mj.plants.low_level.robot import Robot

COUNTS_LIMITS = True
# q: of each servo its gear, gain, b_0, b_1, b_2, and the least and the greatest force
_EACH = 7


@kernel
def control(q, readings, memory, u, out):
    """Fill out (servos,); readings: length and velocity of each."""
    limited = 0
    for k in range(len(out)):
        servo = q[_EACH * k : _EACH * (k + 1)]
        force = u[k] / servo[0]
        bias = servo[2] + servo[3] * readings[2 * k] + servo[4] * readings[2 * k + 1]
        out[k] = (force - bias) / servo[1]
        if force < servo[5] or force > servo[6]:
            limited = 1
    return limited


@LOW_LEVEL.register
class ServoTable(ControllerTable):
    """Forces by position or velocity servos that have a ctrlrange."""

    controller: Literal["servo"]
    actuators: list[str] = Field(min_length=1, description="one for each entry of the input")

    def bind(self, robot: "Robot", axes: int) -> Controller:
        """See the base class."""
        if len(self.actuators) != axes:
            raise robot.refused("actuators", self.actuators, f"an action has {axes} entries")
        numbers: list[float] = []
        seen: list[Seen] = []
        for name in self.actuators:
            numbers += robot.servo("actuators", name)
            of = Output("actuator", name)
            seen += [Seen(of, "position"), Seen(of)]
        return Controller(
            sys.modules[__name__], tuple(self.actuators), tuple(seen), np.array(numbers), axes,
            raw=True,
        )  # fmt: skip
