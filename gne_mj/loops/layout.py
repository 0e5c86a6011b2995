"""Where a native loop finds its numbers: a table of what does not change, a room of what does.

A table (:mod:`gne_mj.table`) has the plant's arrays first, then the game's, the graph's and all
else that a run is made of. A room is one flat array: [step, stage, the recorder's block, monitor,
input held, scratch arrays, what the engine adds]. MuJoCo has it in ``userdata``; so a run's whole
memory is part of MuJoCo's state.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.propagation import Propagator
from gne_mj.game import GameData
from gne_mj.graph import GraphData
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import FAULT_COLUMNS, Faults, Order, Problem, Work, work_sizes
from gne_mj.native import kernel, shaped
from gne_mj.plants.agents import Agents
from gne_mj.plants.functions import compiled_functions
from gne_mj.plants.ode import Channels
from gne_mj.table import Table, floats, integers

# Behind the plant's arrays: the game's (as in GameData), the graph's, the propagator's, the rest
PLANT_TABLE = 3
GAME = PLANT_TABLE
GRAPH = GAME + len(GameData._fields)
PROPAGATOR = GRAPH + len(GraphData._fields)
SCHEDULE = PROPAGATOR + 3
ORDER = SCHEDULE + 1
FAULTS = ORDER + len(Order._fields)
(
    SETTINGS, LIMIT, EQUILIBRIUM, SIZE, FUNCTIONS, AGENT_FUNCTIONS, PARAMETERS, REST, STEP, CLOCK,
) = range(FAULTS + 3, FAULTS + 13)  # fmt: skip
# Entries of STEP: what a loop is made of
(
    ACTIONS, CONSTRAINTS, AGENTS, STATES, MEMORY, EVALUATIONS, PERIOD, MODE, HISTORY, SOLVER,
    METHOD, OUTPUT,
) = range(12)  # fmt: skip

# A room's first entries
STEP_NOW, STAGE_NOW, RECORDER, MONITOR = range(4)


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
    p = len(problem.data.member_pointer) - 1
    steps = (
        *(agents.channels, p, len(problem.data.offsets) - 1, setup.rest.shape[1], memory, stages),
        *(clock.period, clock.mode, setup.history, setup.solver, clock.method, agents.kind.OUTPUT),
    )
    return [
        *plant,
        *problem.data,
        *problem.graph,
        *problem.propagator,
        problem.schedule,
        *problem.order,
        *problem.faults,
        problem.settings,
        problem.limit,
        problem.equilibrium,
        problem.size,
        problem.functions,
        compiled_functions(agents.kind),
        np.ascontiguousarray(agents.parameters),
        np.ascontiguousarray(setup.rest),
        np.array(steps, dtype=np.int64),
        np.array([clock.h]),
    ]


def ode_table(setup: Setup, agents: Agents, memory: int) -> Table:
    """The table of a run of ODE agents; ``memory`` is the length of the law's."""
    nothing = [np.zeros(0)] * PLANT_TABLE
    return Table(table_arrays(nothing, setup, agents, memory, 1))


def in_table(setup: Setup, agents: Agents, memory: int) -> tuple[Problem, Table]:
    """A run's problem as Python calls its law's functions with; keep the table meanwhile."""
    table = ode_table(setup, agents, memory)
    return setup.problem._replace(table=table.address), table


@kernel
def room_needed(m, p, agents, history, solver):
    """Entries of a room, without what the engine adds."""
    total = MONITOR + watch.length(m, p) + m
    for size in work_sizes(m, p, agents, history, solver):
        total += size
    return total


@kernel
def problem_in(table):
    """What the law reads, from a run's table."""
    data = GameData(
        floats(table, GAME),
        integers(table, GAME + 1),
        integers(table, GAME + 2),
        integers(table, GAME + 3),
        integers(table, GAME + 4),
        integers(table, GAME + 5),
        integers(table, GAME + 6),
        integers(table, GAME + 7),
        integers(table, GAME + 8),
        floats(table, GAME + 9),
        integers(table, GAME + 10),
        integers(table, GAME + 11),
        integers(table, GAME + 12),
    )
    graph = GraphData(integers(table, GRAPH), integers(table, GRAPH + 1))
    agents = len(data.offsets) - 1
    maps = floats(table, PROPAGATOR)
    propagator = Propagator(
        shaped(maps, (len(maps) // (agents * agents), agents, agents)),
        floats(table, PROPAGATOR + 1),
        floats(table, PROPAGATOR + 2),
    )
    return Problem(
        data,
        graph,
        floats(table, SETTINGS),
        floats(table, LIMIT),
        floats(table, EQUILIBRIUM),
        propagator,
        floats(table, SCHEDULE),
        Order(
            integers(table, ORDER),
            integers(table, ORDER + 1),
            integers(table, ORDER + 2),
            integers(table, ORDER + 3),
            integers(table, ORDER + 4),
        ),
        faults_in(table),
        floats(table, SIZE),
        integers(table, FUNCTIONS),
        table,
    )


@kernel
def faults_in(table):
    """The run's faults, from its table."""
    rows = floats(table, FAULTS)
    return Faults(
        shaped(rows, (len(rows) // FAULT_COLUMNS, FAULT_COLUMNS)),
        integers(table, FAULTS + 1),
        floats(table, FAULTS + 2),
    )


@kernel
def clock_in(table):
    """How the loop steps, from a run's table."""
    steps = integers(table, STEP)
    return Clock(floats(table, CLOCK)[0], steps[PERIOD], steps[MODE], steps[METHOD])


@kernel
def channels_in(table):
    """The agents' channels, from a run's table."""
    steps, parameters = integers(table, STEP), floats(table, PARAMETERS)
    m, states = steps[ACTIONS], steps[STATES]
    return Channels(
        shaped(parameters, (m, len(parameters) // m)),
        shaped(floats(table, REST), (m, states)),
        integers(table, AGENT_FUNCTIONS),
        steps[OUTPUT],
    )


@kernel
def parts_of(room, start, steps):
    """Views into a room that begins at ``start``: monitor, input, scratch, what is behind them."""
    m, p, agents = steps[ACTIONS], steps[CONSTRAINTS], steps[AGENTS]
    at = start + MONITOR + watch.length(m, p)
    monitor = room[start + MONITOR : at]
    u = room[at : at + m]
    at += m
    n0, n1, n2, n3, n4, n5, n6, n7, n8, n9, n10, n11, n12, n13, n14 = work_sizes(
        m, p, agents, steps[HISTORY], steps[SOLVER]
    )
    a1 = at + n0
    a2 = a1 + n1
    a3 = a2 + n2
    a4 = a3 + n3
    a5 = a4 + n4
    a6 = a5 + n5
    a7 = a6 + n6
    a8 = a7 + n7
    a9 = a8 + n8
    a10 = a9 + n9
    a11 = a10 + n10
    a12 = a11 + n11
    a13 = a12 + n12
    a14 = a13 + n13
    end = a14 + n14
    work = Work(
        room[at:a1],
        room[a1:a2],
        room[a2:a3],
        room[a3:a4],
        room[a4:a5],
        room[a5:a6],
        room[a6:a7],
        room[a7:a8],
        room[a8:a9],
        room[a9:a10],
        room[a10:a11],
        room[a11:a12],
        room[a12:a13],
        room[a13:a14],
        room[a14:end],
    )
    return monitor, u, work, room[end:]
