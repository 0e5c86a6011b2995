"""What runs of one structure share: a native batch that holds them, and their parameter blocks.

Two systems have one structure if they have the same kernels, shapes, mode, integrator and step. All
else may differ, and is in a run's table.
"""

from collections.abc import Hashable
from typing import TYPE_CHECKING

from gne_mj.loops.batch import BatchLoop, EachLoop
from gne_mj.loops.lane_batch import modules_for
from gne_mj.loops.layout import Setup, ode_parameter_block
from gne_mj.loops.ode_batch import OdeBatch
from gne_mj.parameter_block import ParameterBlock
from gne_mj.plants.agent_type import has_ode
from gne_mj.plants.mjcf_robot import MjcfRobots
from gne_mj.system import Clock, System

if TYPE_CHECKING:
    from gne_mj.plants.fleet_plant import FleetPlant


class Structure:
    """A native batch for systems like this one.

    Args:
        system, clock: of any of the runs.
        threads: how many native threads.

    Attributes:
        loop: runs them.
    """

    def __init__(self, system: System, clock: Clock, threads: int) -> None:
        self._plant: FleetPlant | None = None
        self._native = system.integrator != "rosenbrock" and not _network_changes(system)
        self.loop: BatchLoop
        faulty = bool(system.faults)
        if not self._native:
            self.loop = EachLoop(threads)
        elif system.engine == "ode":
            self.loop = OdeBatch(system.ode_loop.native, system.fault_kernels, faulty, threads)
        else:
            # Late: MuJoCo is slow to import, and the twins do not need it.
            from gne_mj.loops.mujoco_batch import MujocoBatch

            self._plant = system.mujoco_plant(clock)
            # Mode implicit looks ahead in a second mjData, of which a plant has one.
            alone = not has_ode(system.agents.kind) and system.equation is not None
            self.loop = MujocoBatch(
                self._plant, system.fault_kernels, faulty, 1 if alone else threads
            )

    def parameter_block(self, system: System, setup: Setup) -> ParameterBlock | None:
        """The table of a run; None where each run has a loop of its own."""
        if not self._native:
            return None
        memory = len(system.loop_memory)
        if self._plant is None:
            block = ode_parameter_block(setup, system.agents, memory)
            block.modules = modules_for(
                system.agents.kind, system.law.kernels, system.game.kernels, setup, memory
            )
            return block
        from gne_mj.loops.mujoco_workspace import mujoco_parameter_block

        return mujoco_parameter_block(self._plant, setup, system.agents, memory)


def _network_changes(system: System) -> bool:
    return system.law.graph is not None and system.law.graph.changes


def key_of(system: System, clock: Clock, setup: Setup) -> Hashable:
    """The same for systems of one structure, and for no others."""
    agents, game = system.agents, system.game
    return (
        system.engine, system.integrator, clock.timestep, agents.kind, agents.dimension,
        agents.world if isinstance(agents, MjcfRobots) else None,
        system.equation, system.fault_kernels, _network_changes(system),
        game.actions, game.constraints_count, game.agents, agents.states,
        len(system.loop_memory), setup.clock.mode, setup.history, setup.solver,
    )  # fmt: skip
