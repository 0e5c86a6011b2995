"""A robot that is known by its MJCF alone: one measured velocity, one input.

Such agents run in MuJoCo only. Nothing is known of their storage function, so nothing is claimed
of it; :mod:`gne_mj.passivity` examines them by experiment. Channel parameters: none.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from gne_mj.native import kernel
from gne_mj.plants.agents import Agents

NAME = "MJCF robot"
PARAMETERS: tuple[str, ...] = ()
STATES = (("output", ""), ("position", "m or rad"))
OUTPUT = 0
INPUT_UNIT = "N or N m"
KNOWS_STORAGE = False


@dataclass(frozen=True)
class RobotFile:
    """One robot of a fleet.

    Args:
        path: its MJCF file.
        output: name of the joint (slide or hinge) or of the velocity sensor (jointvel, tendonvel
            or actuatorvel) that is the output y_i.
        input: name of the actuator whose force u_i is, at the joint or tendon that it drives; at
            an ``actuatorvel`` sensor of its own the force before the gear.
    """

    path: Path
    output: str
    input: str


@dataclass(frozen=True, eq=False)
class MjcfRobots(Agents):
    """A fleet of a user's own robots, which may differ from each other.

    Args:
        robots: one an agent.
    """

    robots: tuple[RobotFile, ...] = ()

    def repeated(self, copies: int) -> Self:
        """See the base class."""
        return replace(super().repeated(copies), robots=self.robots * copies)


def mjcf_robots(robots: tuple[RobotFile, ...], input_limit: np.ndarray) -> MjcfRobots:
    """The fleet, with the greatest |u| (N,) that the actuators deliver, infinite for no limit."""
    module = sys.modules[__name__]
    return MjcfRobots(module, np.zeros((len(robots), 0)), input_limit, robots=robots)


def is_passive(parameters):
    """Not known."""
    return False


@kernel
def equilibrium(q, y, out):
    """The output y; the position is free."""
    out[0] = y
    out[1] = 0.0


@kernel
def storage(q, x, rest):
    """Not known: nothing is measured."""
    return 0.0
