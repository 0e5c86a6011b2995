"""Where a loop in MuJoCo keeps its numbers: in mjData's userdata and act, all of it MuJoCo's state.

userdata holds [mark, address of the parameter block, the fleet's own, the loop's workspace]. The
law's memory is in act in mode `continuous`, where MuJoCo's integrator moves it, else in userdata.
"""

from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.game_model import Game
from gne_mj.loops.feedback import NO_SIZES
from gne_mj.loops.feedback import Sizes as LoopSizes
from gne_mj.loops.layout import SCRATCH, Setup, Steps, Workspace, parameter_arrays
from gne_mj.loops.ode import CONTINUOUS
from gne_mj.native import kernel
from gne_mj.parameter_block import ParameterBlock
from gne_mj.plants.agents import Agents
from gne_mj.plants.mujoco import STAGES, Sizes, sizes_in
from gne_mj.plants.native_mujoco import LOOP_MARK, USERDATA_HEADER, Offsets, field
from gne_mj.records import by_name, dtype_of, in_array

if TYPE_CHECKING:
    from gne_mj.plants.fleet_plant import FleetPlant


class MujocoWorkspace(NamedTuple):
    """What changes in a run, in userdata."""

    loop: Workspace
    state: Annotated[np.ndarray, "m * states"]  # flat, at the step's start
    later: Annotated[np.ndarray, "m * states"]  # and at a later stage
    memory: Annotated[np.ndarray, "held"]  # the law's, in the held modes


_length, _workspace_in = in_array(
    MujocoWorkspace, "m p agents states held history solver separation", **SCRATCH
)


@kernel
def held_memory(s):
    """Entries of a law's memory in userdata: the others are in act."""
    return 0 if s.mode == CONTINUOUS else s.memory


@kernel
def mujoco_workspace_length(s):
    """Entries of the workspace of a loop of these sizes, as a parameter block has them."""
    return _length(
        s.actions,
        s.constraints,
        s.agents,
        s.states,
        held_memory(s),
        s.history,
        s.solver,
        s.separation,
    )


@kernel
def mujoco_workspace_in(userdata, start, s):
    """The views of a workspace that begins there."""
    return _workspace_in(
        userdata, start, s.actions, s.constraints, s.agents, s.states, held_memory(s), s.history,
        s.solver, s.separation,
    )  # fmt: skip


def workspace_of(userdata: NDArray[np.float64], start: int, s: Steps) -> Any:
    """The same as Python knows it, by name."""
    dtype = dtype_of(
        MujocoWorkspace, m=s.actions, p=s.constraints, agents=s.agents, states=s.states,
        held=held_memory(s), history=s.history, solver=s.solver,
        separation=s.separation, **SCRATCH,
    )  # fmt: skip
    return by_name(userdata[start:], dtype)


class Place(NamedTuple):
    """Where a simulation's numbers are: addresses, and what the fleet's parameter block says."""

    at: Offsets
    parameter_block: int
    model: int
    data: int
    sizes: Sizes


@kernel
def place_of(at, parameter_block, model, data):
    """The place of a simulation that is ours."""
    return Place(at, parameter_block, model, data, sizes_in(parameter_block))


@kernel
def workspace_at(place, steps):
    """A simulation's workspace."""
    userdata = field(place.data, place.at.userdata, place.sizes.nuserdata)
    return mujoco_workspace_in(userdata, place.sizes.workspace, steps)


def entries_needed(
    game: Game, agents: Agents, memory: int, mode: int, sizes: LoopSizes = NO_SIZES
) -> tuple[int, int]:
    """Entries of userdata, and of act, that a plant must leave for this game's loop.

    Args:
        game, agents: of the loop.
        memory: length of the law's memory.
        mode: CONTINUOUS, SAMPLED or IMPLICIT of :mod:`gne_mj.loops.ode`.
        sizes: of the scratch arrays that depend on the kind of loop.
    """
    held, moved = (0, memory) if mode == CONTINUOUS else (memory, 0)
    needed = _length(game.actions, game.constraints_count, game.agents, agents.states, held, *sizes)
    return int(needed), moved


def mujoco_parameter_block(
    plant: "FleetPlant", setup: Setup, agents: Agents, memory: int
) -> ParameterBlock:
    """The parameter block of a run: the plant's places and sizes, the robots' numbers, and the
    rest."""
    arrays = parameter_arrays(
        plant.arrays_for(agents), setup, agents, memory, STAGES[plant.integrator]
    )
    return ParameterBlock(arrays, setup.kept_alive)


def put_start(
    plant: "FleetPlant", parameter_block: ParameterBlock, mode: int, memory: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Make mjData the start of a run, but for what is the fleet's own; returns the memory."""
    data = plant.data
    data.userdata[plant.sizes.workspace :] = 0.0
    place = data.act if mode == CONTINUOUS and len(memory) else data.userdata
    held: NDArray[np.float64] = place[len(place) - len(memory) :]
    held[:] = memory
    data.userdata[:USERDATA_HEADER] = LOOP_MARK, parameter_block.address
    return held
