"""The barrier as a safety filter: a policy's input is a pull, and what acts keeps the set.

Mode implicit under the law :mod:`gne_mj.controllers.pulled`, whose barrier-free part is what the
policy asks for. docs/learning.md has the theorem.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from gne_mj.controllers.pulled import Pulled
from gne_mj.errors import part_of
from gne_mj.loops.layout import Setup
from gne_mj.loops.mujoco_workspace import mujoco_parameter_block
from gne_mj.parameter_block import ParameterBlock
from gne_mj.plants.fleet_plant import FleetPlant
from gne_mj.system import Clock, System
from gne_mj.system.modes import mode_of


@dataclass(frozen=True, eq=False)
class Barrier:
    """What keeps a fleet inside, whatever is asked of it.

    Attributes:
        system: the game and its agents, under the pull and the barrier alone.
        setup: of its loops.
    """

    system: System
    setup: Setup

    def parameter_block(self, plant: FleetPlant) -> ParameterBlock:
        """What native code finds inputs for this fleet with; to be kept as long as that is done."""
        return mujoco_parameter_block(plant, self.setup, plant.agents, self.system.game.actions)


def barrier_of(
    system: System,
    clock: Clock,
    plant: FleetPlant,
    *,
    between: Literal["watched", "guarded"] = "watched",
    decentralised: bool = False,
) -> Barrier:
    """The barrier of a system, with its penalty, margins and limits.

    Args:
        system: whose; its own law and mode do not matter.
        clock: integration step and control period.
        plant: such a fleet, on which the period is tried where nothing else tells.
        between: "guarded" cuts periods that would lead outside between two control instants.
        decentralised: each agent finds its input alone, in its share of what is left of each bound.

    Raises:
        InvalidInput: what mode implicit refuses.
    """
    with part_of("system"):
        found = replace(
            system, law=Pulled(), mode="implicit", memory=np.zeros(system.game.actions),
            schedule=None, feed_forward=False, observer=0.0, compensation=False,
            load=None, between=between, decentralised=decentralised,
        )  # fmt: skip
    setup = found.setup(clock)
    mode_of(found).try_plant(found, plant, clock)
    return Barrier(found, setup)
