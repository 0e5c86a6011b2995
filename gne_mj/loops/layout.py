"""Where a native loop finds its numbers: a table of what does not change, a room of what does.

A table (:mod:`gne_mj.table`) has the plant's arrays first, then the game's, the graph's and all
else that a run is made of. A room is one flat array, as :class:`Room` says, and behind it what
the engine adds. MuJoCo has it in ``userdata``; so a run's whole memory is part of MuJoCo's state.
"""

from collections.abc import Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.propagation import scratch_length
from gne_mj.loops.feedback import Problem, Work
from gne_mj.loops.monitor import Monitor, Seen
from gne_mj.native import kernel
from gne_mj.numbers import Numbers
from gne_mj.plants.agents import Agents
from gne_mj.plants.functions import compiled_functions
from gne_mj.plants.ode import Channels
from gne_mj.records import arrays, in_array, in_numbers, in_table, place
from gne_mj.table import Table, floats

PLANT_TABLE = 3  # arrays of the plant, before all others


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
    method: int
    output: int  # which of a channel's states is its output


class Run(NamedTuple):
    """The arrays of a table behind the plant's."""

    problem: Problem
    channels: Channels
    steps: Annotated[np.ndarray, "n", int]  # those of Steps
    h: Annotated[np.ndarray, "1"]  # length of a step in s


def _place(name: str) -> int:
    return PLANT_TABLE + place(Run, name)


STEPS, H = _place("steps"), _place("h")
steps_in = in_numbers(Steps, STEPS)  # of a table, by its address
_problem = in_table(Problem, _place("problem"))
_channels = in_table(Channels, _place("channels"))


class Clock(NamedTuple):
    """How a loop steps."""

    h: float  # step in s
    period: int  # steps per control period, held modes
    mode: int
    method: int


class Setup(NamedTuple):
    """What one run is made of besides its plant, its start and its kernels."""

    problem: Problem
    rest: NDArray[np.float64]  # (m, states) equilibrium, from which V is measured
    clock: Clock
    history: int = 0  # lengths of scratch arrays that depend on the kind of loop
    solver: int = 0


def table_arrays(
    plant: Sequence[NDArray[Any]],
    setup: Setup,
    agents: Agents,
    memory: int,
    stages: int,
) -> list[NDArray[Any]]:
    """A table's arrays.

    Args:
        plant: the plant's own, PLANT_TABLE of them.
        setup: of the run.
        agents: the agents.
        memory: entries of the law's memory.
        stages: evaluations of the dynamics in one step.
    """
    problem, clock = setup.problem, setup.clock
    steps = Steps(
        agents.channels, len(problem.data.member_pointer) - 1, len(problem.data.offsets) - 1,
        setup.rest.shape[1], memory, stages, clock.period, clock.mode, setup.history, setup.solver,
        clock.method, agents.kind.OUTPUT,
    )  # fmt: skip
    channels = Channels(
        np.ascontiguousarray(agents.parameters), np.ascontiguousarray(setup.rest),
        compiled_functions(agents.kind), steps.output,
    )  # fmt: skip
    run = Run(problem, channels, np.array(steps, dtype=np.int64), np.array([clock.h]))
    return [*plant, *arrays(run)]


def ode_table(setup: Setup, agents: Agents, memory: int) -> Table:
    """The table of a run of ODE agents; ``memory`` is the length of the law's."""
    nothing = [np.zeros(0)] * PLANT_TABLE
    return Table(table_arrays(nothing, setup, agents, memory, 1))


def steps_of(table: Table) -> Steps:
    """What a loop is made of, from its table."""
    return Steps(*table.arrays[STEPS].tolist())


def problem_and_table(setup: Setup, agents: Agents, memory: int) -> tuple[Problem, Table]:
    """A run's problem as Python calls its law's functions with; keep the table meanwhile."""
    table = ode_table(setup, agents, memory)
    return setup.problem._replace(table=table.address), table


@kernel
def problem_in(table):
    """What the law reads, from a run's table."""
    return _problem(table, steps_in(table).agents)


@kernel
def clock_in(table):
    """How the loop steps, from a run's table."""
    steps = steps_in(table)
    return Clock(floats(table, H)[0], steps.period, steps.mode, steps.method)


@kernel
def channels_in(table):
    """The agents' channels, from a run's table."""
    steps = steps_in(table)
    return _channels(table, steps.actions, steps.output)


class Progress(Numbers):
    """How far a run is."""

    step: float  # the present one
    stage: float  # of it that comes next, in MuJoCo
    recorder: float  # address of the block that rows go to, 0: none


class Room(NamedTuple):
    """What changes in a run, but for what the engine adds."""

    progress: Progress
    monitor: Monitor
    u: Annotated[np.ndarray, "m"]  # input held
    work: Work


ROOM = {"propagation": scratch_length}  # what its shapes use
_length, _room_in = in_array(Room, "m p agents history solver", **ROOM)


@kernel
def loop_room_length(s):
    """Entries of a room, without what the engine adds; of sizes as a table has them."""
    return _length(s.actions, s.constraints, s.agents, s.history, s.solver)


@kernel
def loop_room_in(flat, s):
    """A room's views, without what the engine adds."""
    return _room_in(flat, 0, s.actions, s.constraints, s.agents, s.history, s.solver)


class Parts(NamedTuple):
    """What kernels of a running loop work on."""

    problem: Problem
    channels: Channels
    clock: Clock
    monitor: Seen
    figures: Monitor
    u: np.ndarray  # (m,) input held
    work: Work


class Instant(NamedTuple):
    """When something is evaluated."""

    time: float  # in s
    step: Any
    stage: Any  # of the step; of a piece of it in mode continuous


@kernel
def parts_in(table, room):
    """The parts of a run, from its table and room."""
    return Parts(
        problem_in(table), channels_in(table), clock_in(table), room.monitor.numbers, room.monitor,
        room.u, room.work,
    )  # fmt: skip
