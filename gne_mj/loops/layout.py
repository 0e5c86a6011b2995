"""Where a native loop finds its numbers: a parameter block of what does not change, a workspace of
what does.

A parameter block (:mod:`gne_mj.parameter_block`) has the plant's arrays first, then the game's, the
graph's and all else that a run is made of. A workspace is one flat array, as :class:`Workspace`
says, and behind it what the engine adds. MuJoCo has it in ``userdata``; so a run's whole memory is
part of MuJoCo's state.
"""

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.propagation import scratch_length
from gne_mj.loops.feedback import Problem, StepScratch
from gne_mj.loops.monitor import Monitor, MonitorNumbers
from gne_mj.native import kernel
from gne_mj.numbers import Numbers
from gne_mj.parameter_block import ParameterBlock, floats
from gne_mj.plants.agent_type import followed_position
from gne_mj.plants.agents import Agents
from gne_mj.plants.functions import compiled_functions
from gne_mj.plants.ode import Channels
from gne_mj.records import arrays, in_array, in_numbers, in_parameter_block, place

PLANT_BLOCK = 3  # arrays of the plant, before all others


class Steps(NamedTuple):
    """What a loop is made of, in numbers."""

    actions: int  # m
    constraints: int  # p
    agents: int  # N
    states: int  # of a channel
    memory: int  # entries of the law's
    evaluations: int  # of the dynamics in one step
    period: int  # steps per control period, held modes
    mode: int
    history: int  # lengths of scratch arrays that depend on the kind of loop
    solver: int
    separation: int
    method: int
    output: int  # which of a channel's states is its output
    position: int  # and which a position that follows it; -1 without


class Run(NamedTuple):
    """The arrays of a parameter block behind the plant's."""

    problem: Problem
    channels: Channels
    steps: Annotated[np.ndarray, "n", int]  # those of Steps
    h: Annotated[np.ndarray, "1"]  # length of a step in s
    rtol: Annotated[np.ndarray, "1"]  # error allowed in a step, integrator tsit5


def place_in_block(name: str) -> int:
    """The index in a parameter block of a field's first array."""
    return PLANT_BLOCK + place(Run, name)


STEPS, H, RTOL = place_in_block("steps"), place_in_block("h"), place_in_block("rtol")
steps_in = in_numbers(Steps, STEPS)  # of a parameter block, by its address
_problem = in_parameter_block(Problem, place_in_block("problem"))
_channels = in_parameter_block(Channels, place_in_block("channels"))


class LoopClock(NamedTuple):
    """How a loop steps."""

    h: float  # step in s
    period: int  # steps per control period, held modes
    mode: int
    method: int


class Setup(NamedTuple):
    """What one run is made of besides its plant, its start and its kernels."""

    problem: Problem
    equilibrium_state: NDArray[np.float64]  # (m, states) equilibrium, from which V is measured
    clock: LoopClock
    history: int = 0  # lengths of scratch arrays that depend on the kind of loop
    solver: int = 0
    separation: int = 0
    rtol: float = 0.0  # integrator tsit5
    kept_alive: Any = None  # what native code knows by address


def parameter_arrays(
    plant: Sequence[NDArray[Any]],
    setup: Setup,
    agents: Agents,
    memory: int,
    stages: int,
) -> list[NDArray[Any]]:
    """A parameter block's arrays.

    Args:
        plant: the plant's own, PLANT_TABLE of them.
        setup: of the run.
        agents: the agents.
        memory: entries of the law's memory.
        stages: evaluations of the dynamics in one step.
    """
    problem, clock = setup.problem, setup.clock
    steps = Steps(
        agents.channels,
        len(problem.data.member_pointer) - 1,
        len(problem.data.offsets) - 1,
        setup.equilibrium_state.shape[1],
        memory,
        stages,
        clock.period,
        clock.mode,
        setup.history,
        setup.solver,
        setup.separation,
        clock.method,
        agents.kind.OUTPUT,
        followed_position(agents.kind),
    )
    channels = Channels(
        np.ascontiguousarray(agents.parameters), np.ascontiguousarray(setup.equilibrium_state),
        compiled_functions(agents.kind), steps.output, steps.position,
    )  # fmt: skip
    run = Run(
        problem, channels, np.array(steps, dtype=np.int64), np.array([clock.h]),
        np.array([setup.rtol]),
    )  # fmt: skip
    return [*plant, *arrays(run)]


def ode_parameter_block(setup: Setup, agents: Agents, memory: int) -> ParameterBlock:
    """The parameter block of a run of ODE agents; ``memory`` is the length of the law's."""
    nothing = [np.zeros(0)] * PLANT_BLOCK
    return ParameterBlock(parameter_arrays(nothing, setup, agents, memory, 1), setup.kept_alive)


def steps_of(parameter_block: ParameterBlock) -> Steps:
    """What a loop is made of, from its parameter block."""
    return Steps(*parameter_block.arrays[STEPS].tolist())


def problem_and_parameter_block(
    setup: Setup, agents: Agents, memory: int
) -> tuple[Problem, ParameterBlock]:
    """A run's problem as Python calls its law's functions with; keep the parameter block
    meanwhile."""
    parameter_block = ode_parameter_block(setup, agents, memory)
    return setup.problem._replace(parameter_block=parameter_block.address), parameter_block


@kernel
def problem_in(parameter_block):
    """What the law reads, from a run's parameter block."""
    return _problem(parameter_block, steps_in(parameter_block).agents)


@kernel
def clock_in(parameter_block):
    """How the loop steps, from a run's parameter block."""
    steps = steps_in(parameter_block)
    return LoopClock(floats(parameter_block, H)[0], steps.period, steps.mode, steps.method)


@kernel
def channels_in(parameter_block):
    """The agents' channels, from a run's parameter block."""
    steps = steps_in(parameter_block)
    return _channels(parameter_block, steps.actions, steps.output, steps.position)


class Progress(Numbers):
    """How far a run is."""

    step: float  # the present one
    stage: float  # of it that comes next, in MuJoCo
    recorder: float  # address of the block that rows go to, 0: none


class Workspace(NamedTuple):
    """What changes in a run, but for what the engine adds."""

    progress: Progress
    monitor: Monitor
    u: Annotated[np.ndarray, "m"]  # input held
    work: StepScratch


SCRATCH = {"propagation": scratch_length}  # what its shapes use
_length, _workspace_in = in_array(Workspace, "m p agents history solver separation", **SCRATCH)


@kernel
def loop_workspace_length(s):
    """Entries of a workspace, without what the engine adds; of sizes as a parameter block has
    them."""
    return _length(s.actions, s.constraints, s.agents, s.history, s.solver, s.separation)


@kernel
def loop_workspace_in(flat, s):
    """A workspace's views, without what the engine adds."""
    return _workspace_in(
        flat, 0, s.actions, s.constraints, s.agents, s.history, s.solver, s.separation
    )


class Parts(NamedTuple):
    """What kernels of a running loop work on."""

    problem: Problem
    channels: Channels
    clock: LoopClock
    monitor: MonitorNumbers
    figures: Monitor
    u: np.ndarray  # (m,) input held
    work: StepScratch


class Instant(NamedTuple):
    """When something is evaluated."""

    time: float  # in s
    step: Any
    stage: Any  # of the step; of a piece of it in mode continuous


@kernel
def parts_in(parameter_block, workspace):
    """The parts of a run, from its parameter block and workspace."""
    return Parts(
        problem_in(parameter_block), channels_in(parameter_block), clock_in(parameter_block),
        workspace.monitor.numbers, workspace.monitor, workspace.u, workspace.work,
    )  # fmt: skip
