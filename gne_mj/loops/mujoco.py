"""The closed loop in MuJoCo: laws as C callbacks, no Python per step.

MuJoCo evaluates control at every stage of its integrator. The callback counts these evaluations
itself: the first one of each step measures, acts and observes exactly as the ODE loop does
(:func:`gne_mj.loops.ode.look`); later ones, in mode `continuous`, only act. In that mode the
law's memory is in ``act``, moved by MuJoCo's integrator at the rates that a second callback gives;
in the held modes it is in ``userdata``, where nothing but the law moves it. What else is kept from
call to call is in ``userdata`` as well; both are part of MuJoCo's state. userdata holds [mark,
address of the table, the fleet's own, step, stage, monitor, input held, scratch arrays, flat state
at the step's start, flat state at a later stage, memory].
"""

from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.controllers.propagation import Propagator
from gne_mj.errors import EngineError
from gne_mj.game import Game, GameData
from gne_mj.graph import GraphData
from gne_mj.loops import explicit, faultless
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Samples
from gne_mj.loops.feedback import (
    FAULT_COLUMNS,
    NO_SIZES,
    Faults,
    Order,
    Problem,
    Sizes,
    Work,
    work_sizes,
)
from gne_mj.loops.ode import CONTINUOUS, Clock, look
from gne_mj.native import callback, compiled, copy, kernel, source_key
from gne_mj.plants.agents import Agents
from gne_mj.plants.mujoco import (
    MEMORY,
    NA,
    NU,
    NUSERDATA,
    PLACES,
    PLANT_TABLE,
    ROOM,
    SIZES,
    STAGES,
)
from gne_mj.plants.native_mujoco import (
    ACTIVATION,
    CALLBACK,
    LOOP_MARK,
    MARK,
    USERDATA_HEADER,
    Offsets,
    Table,
    address_of,
    call,
    callbacks,
    field,
    floats,
    integers,
    offsets,
    step_address,
    table_of,
)
from gne_mj.plants.ode import METHODS, Channels

if TYPE_CHECKING:
    from gne_mj.plants.mjcf_fleet import MjcfPlant
    from gne_mj.plants.mujoco import MujocoPlant

# Behind the plant's arrays: the game's (as in GameData), the graph's, the propagator's, the rest
GAME = PLANT_TABLE
GRAPH = GAME + len(GameData._fields)
PROPAGATOR = GRAPH + len(GraphData._fields)
SCHEDULE = PROPAGATOR + 3
ORDER = SCHEDULE + 1
FAULTS = ORDER + len(Order._fields)
SETTINGS, LIMIT, EQUILIBRIUM, PARAMETERS, REST, STEP, CLOCK = range(FAULTS + 3, FAULTS + 10)
# Entries of STEP: what a loop is made of
ACTIONS, CONSTRAINTS, AGENTS, EVALUATIONS, PERIOD, MODE, HISTORY, SOLVER, METHOD = range(9)

# Entries of userdata behind the fleet's own
STEP_NOW, STAGE_NOW, MONITOR = range(3)


@kernel
def room_needed(m, p, agents, states, history, solver):
    """Entries of userdata that a loop needs behind the fleet's own."""
    total = MONITOR + watch.length(m, p) + m + 2 * m * states
    for size in work_sizes(m, p, agents, history, solver):
        total += size
    return total


@kernel
def problem_in(table):
    """What the law reads, from a simulation's table."""
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
    )
    graph = GraphData(integers(table, GRAPH), integers(table, GRAPH + 1))
    agents = len(data.offsets) - 1
    maps = floats(table, PROPAGATOR)
    propagator = Propagator(
        maps.reshape((len(maps) // (agents * agents), agents, agents)),
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
    )


@kernel
def faults_in(table):
    """The run's faults, from a simulation's table."""
    rows = floats(table, FAULTS)
    return Faults(
        rows.reshape((len(rows) // FAULT_COLUMNS, FAULT_COLUMNS)),
        integers(table, FAULTS + 1),
        floats(table, FAULTS + 2),
    )


@kernel
def clock_in(table):
    """How the loop steps, from a simulation's table."""
    steps = integers(table, STEP)
    return Clock(floats(table, CLOCK)[0], steps[PERIOD], steps[MODE], steps[METHOD])


@kernel
def channels_in(table, m, states):
    """The agents' channels, from a simulation's table."""
    parameters = floats(table, PARAMETERS)
    rest = floats(table, REST)
    return Channels(parameters.reshape((m, len(parameters) // m)), rest.reshape((m, states)))


@kernel
def parts_of(userdata, start, steps, states):
    """Views into userdata: monitor, input, scratch, flat states at the start and later, memory."""
    m, p, agents = steps[ACTIONS], steps[CONSTRAINTS], steps[AGENTS]
    at = start + MONITOR + watch.length(m, p)
    monitor = userdata[start + MONITOR : at]
    u = userdata[at : at + m]
    at += m
    n0, n1, n2, n3, n4, n5, n6, n7, n8, n9, n10, n11, n12, n13 = work_sizes(
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
    end = a13 + n13
    work = Work(
        userdata[at:a1],
        userdata[a1:a2],
        userdata[a2:a3],
        userdata[a3:a4],
        userdata[a4:a5],
        userdata[a5:a6],
        userdata[a6:a7],
        userdata[a7:a8],
        userdata[a8:a9],
        userdata[a9:a10],
        userdata[a10:a11],
        userdata[a11:a12],
        userdata[a12:a13],
        userdata[a13:end],
    )
    size = m * states
    memory = userdata[end + 2 * size :]
    state, later = userdata[end : end + size], userdata[end + size : end + 2 * size]
    return monitor, u, work, state, later, memory


@cache
def build(
    at: Offsets,
    fleet: ModuleType,
    law: ModuleType,
    game: ModuleType,
    acting: ModuleType,
    faults: ModuleType,
) -> tuple[Any, ...]:
    """The callbacks for control and memory, the native loop and its last observation.

    Args:
        at: where MuJoCo keeps what.
        fleet: the module that reads and drives the robots, as :mod:`gne_mj.plants.mujoco` does.
        law, game, acting, faults: modules of kernels, as :func:`gne_mj.loops.ode.look` has them.
    """
    agent, plant = fleet.AGENT, fleet.AHEAD
    states = len(agent.STATES)
    source = source_key(fleet, agent, law, game)

    def control(model, data):
        _ = source
        struct = address_of(data)
        table = table_of(at, address_of(model), struct)
        if table <= 0:
            return
        sizes, steps = integers(table, SIZES), integers(table, STEP)
        m, stages, mode = steps[ACTIONS], steps[EVALUATIONS], steps[MODE]
        ctrl = field(struct, at.ctrl, sizes[NU])
        userdata = field(struct, at.userdata, sizes[NUSERDATA])
        start = sizes[ROOM]
        monitor, u, work, state, later, memory = parts_of(userdata, start, steps, states)
        if mode == CONTINUOUS:
            memory = field(struct, at.act, sizes[NA])[sizes[MEMORY] :]
        step, stage = np.int64(userdata[start + STEP_NOW]), np.int64(userdata[start + STAGE_NOW])
        last = stage + 1 == stages
        userdata[start + STEP_NOW] = step + 1 if last else step
        userdata[start + STAGE_NOW] = 0 if last else stage + 1
        if stage > 0 and mode != CONTINUOUS:
            return
        problem, clock = problem_in(table), clock_in(table)
        h = clock.h
        time = step * h
        if stage > 0:
            time += h if stage == 3 else 0.5 * h
            state = later
        fleet.gather(at, struct, table, state)
        channels = channels_in(table, m, states)
        storage = fleet.stored(channels, state, userdata) if stage == 0 else 0.0
        context = (at, address_of(model), struct, table)
        good = monitor[watch.EXIT] == watch.INSIDE and look(
            acting, faults, plant, context, agent, law, game, problem, channels, clock, time, step,
            stage, storage, state, memory, u, monitor, work,
        )  # fmt: skip
        places = integers(table, PLACES)
        acts = faults.push(problem, clock, step, work.u, work.acts)
        for r in range(m):
            ctrl[fleet.actuator_of(places, r)] = acts[r] if good else 0.0

    def remember(model, data, actuator):
        _ = source
        struct = address_of(data)
        table = table_of(at, address_of(model), struct)
        if table <= 0:
            return 0.0
        sizes, steps = integers(table, SIZES), integers(table, STEP)
        rates = field(struct, at.act_dot, sizes[NA])[sizes[MEMORY] :]
        userdata = field(struct, at.userdata, sizes[NUSERDATA])
        parts = parts_of(userdata, sizes[ROOM], steps, states)
        memory = field(struct, at.act, sizes[NA])[sizes[MEMORY] :]
        seen = faults.choose(parts[2].y, parts[2].seen)
        law.rate(problem_in(table), seen, memory, rates)
        return rates[0] if len(rates) == 1 else 0.0  # MuJoCo takes the one of a single entry

    def advance(
        mj_step, model, data, qpos, qvel, act, userdata, start, restores, every,
        before, samples_state, samples_u, samples_memory, samples_seen, samples_acts,
    ):  # fmt: skip
        _ = source
        table = table_of(at, model, data)
        steps, problem, clock = integers(table, STEP), problem_in(table), clock_in(table)
        monitor, u, work, state, _later, memory = parts_of(userdata, start, steps, states)
        nq, nv = len(qpos), len(qvel)
        done = 0
        for sample in range(len(samples_u)):
            for substep in range(every):
                copy(qpos, before[:nq])
                copy(qvel, before[nq : nq + nv])
                if restores:
                    copy(act, before[nq + nv :])
                call(mj_step, model, data)
                left = monitor[watch.EXIT] != watch.INSIDE
                if left:
                    copy(before[:nq], qpos)
                    copy(before[nq : nq + nv], qvel)
                    if restores:
                        copy(before[nq + nv :], act)
                    if substep > 0:
                        return sample + 1, done
                    # a step that began inside has its row, even if a later stage left
                    if monitor[watch.EXIT_STAGE] == 0:
                        return sample, done
                if substep == 0:
                    copy(u, samples_u[sample])
                    copy(state, samples_state[sample])
                    step = np.int64(userdata[start + STEP_NOW]) - 1
                    faults.record(
                        agent, states, problem, clock, step, state, u, work,
                        samples_seen[sample], samples_acts[sample],
                    )  # fmt: skip
                    copy(before[nq + nv :] if restores else memory, samples_memory[sample])
                if left:
                    return sample + 1, done
                done += 1
        return len(samples_u), done

    def finish(model, data, step):
        _ = source
        table = table_of(at, model, data)
        sizes, steps = integers(table, SIZES), integers(table, STEP)
        m = steps[ACTIONS]
        userdata = field(data, at.userdata, sizes[NUSERDATA])
        monitor, u, work, state, _later, memory = parts_of(userdata, sizes[ROOM], steps, states)
        if steps[MODE] == CONTINUOUS:
            memory = field(data, at.act, sizes[NA])[sizes[MEMORY] :]
        fleet.gather(at, data, table, state)
        channels = channels_in(table, m, states)
        # the agents' storage as the ODE loop has it: the fleet's own figures are of the last step
        storage = 0.0
        for r in range(m):
            x = state[r * states : (r + 1) * states]
            storage += agent.storage(channels.parameters[r], x, channels.rest[r])
        clock, context = clock_in(table), (at, model, data, table)
        return look(
            acting, faults, plant, context, agent, law, game, problem_in(table), channels, clock,
            step * clock.h, step, 0, storage, state, memory, u, monitor, work,
        )  # fmt: skip

    return (
        callback(CALLBACK, control),
        callback(ACTIVATION, remember),
        compiled(advance),
        compiled(finish),
    )


def room(
    game: Game, agents: Agents, memory: int, mode: int, sizes: Sizes = NO_SIZES
) -> tuple[int, int]:
    """Entries of userdata, and of act, that a plant must leave for this game's loop.

    Args:
        game, agents: of the loop.
        memory: length of the law's memory.
        mode: CONTINUOUS or HELD of :mod:`gne_mj.loops.ode`.
        sizes: of the scratch arrays that depend on the kind of loop.
    """
    needed = room_needed(game.actions, game.constraints_count, game.agents, agents.states, *sizes)
    return (int(needed), memory) if mode == CONTINUOUS else (int(needed) + memory, 0)


class MujocoLoop(ClosedLoop):
    """The closed loop of a fleet in MuJoCo.

    Args:
        plant: the fleet, reset to its start, with :func:`room` in its userdata and for the memory.
        law, game: modules of kernels.
        problem: what the law reads.
        rest: (m, states) equilibrium, from which V is measured.
        mode: CONTINUOUS or HELD of :mod:`gne_mj.loops.ode`.
        period: steps per control period, held modes.
        memory: the law's, at the start.
        acting, faults: modules of kernels, see :func:`gne_mj.loops.ode.look`.
        sizes: of the scratch arrays that they need.
    """

    def __init__(
        self,
        plant: "MujocoPlant | MjcfPlant",
        law: ModuleType,
        game: ModuleType,
        problem: Problem,
        rest: NDArray[np.float64],
        mode: int,
        period: int,
        memory: NDArray[np.float64],
        acting: ModuleType = explicit,
        faults: ModuleType = faultless,
        sizes: Sizes = NO_SIZES,
    ) -> None:
        self.plant = plant
        m = plant.agents.channels
        p, agents = len(problem.data.member_pointer) - 1, len(problem.data.offsets) - 1
        at = offsets()
        self._control, self._remember, self._advance, self._finish = build(
            at, plant.kernels, law, game, acting, faults
        )
        method = METHODS[plant.integrator]
        steps = [m, p, agents, STAGES[plant.integrator], period, mode, *sizes, method]
        self._table = Table(
            [
                *plant.table_arrays,
                *problem.data,
                *problem.graph,
                *problem.propagator,
                problem.schedule,
                *problem.order,
                *problem.faults,
                problem.settings,
                problem.limit,
                problem.equilibrium,
                np.ascontiguousarray(plant.agents.parameters),
                np.ascontiguousarray(rest),
                np.array(steps, dtype=np.int64),
                np.array([plant.timestep]),
            ]
        )
        data = plant.data
        self._faulty = int(faults is not faultless)
        data.userdata[:] = 0.0
        self._start = int(plant.table_arrays[SIZES][ROOM])
        moved = mode == CONTINUOUS and len(memory) > 0  # by the integrator
        place = data.act if moved else data.userdata
        self._memory = place[len(place) - len(memory) :]
        self._memory[:] = memory
        kept = plant.model.nq + plant.model.nv + (len(memory) if moved else 0)
        self._before = (moved, np.zeros(kept))
        first = self._start + MONITOR
        length = int(watch.length(m, p))
        self.monitor = data.userdata[first : first + length]
        self._u = data.userdata[first + length : first + length + m]
        self._mark()

    @property
    def _step(self) -> int:
        """Steps taken; in userdata, so that a state that is set again brings its own time."""
        return int(self.plant.data.userdata[self._start + STEP_NOW])

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return self._step * self.plant.timestep

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        if self.monitor[watch.EXIT] != watch.INSIDE:
            samples = 0
        data, agents = self.plant.data, self.plant.agents
        m = agents.channels
        restores, before = self._before
        recorded = (
            np.empty((samples, m * agents.states)),
            np.empty((samples, m)),
            np.empty((samples, len(self._memory))),
            np.empty((samples, m * self._faulty)),
            np.empty((samples, m * self._faulty)),
        )
        self._check_mark()
        first = self._step
        data.userdata[self._start + STAGE_NOW] = 0.0
        remember = self._remember if restores else None
        with callbacks(control=self._control, passive=self.plant.passive, activation=remember):
            done, steps = self._advance(
                step_address(), self.plant.model._address, data._address, data.qpos, data.qvel,
                self._memory, data.userdata, self._start, restores, every, before, *recorded,
            )  # fmt: skip
        # The callback counts steps, but one that ended in an exit was not taken.
        data.userdata[self._start + STEP_NOW] = first + steps
        data.time = self.time
        states, *others = (rows[:done] for rows in recorded)
        return Samples(states.reshape(-1, m, agents.states), *others)

    def finish(self) -> Samples:
        """See the base class."""
        data = self.plant.data
        state = self.plant.state  # first, since it brings a plant's sensors up to date
        self._check_mark()
        inside = self._finish(self.plant.model._address, data._address, self._step)
        u = self._u if inside else np.full_like(self._u, np.nan)
        struck = np.full((1, len(u) * self._faulty), np.nan)
        return Samples(state[None], u[None].copy(), self._memory[None].copy(), struck, struck)

    def _mark(self) -> None:
        self.plant.data.userdata[:USERDATA_HEADER] = LOOP_MARK, self._table.address

    def _check_mark(self) -> None:
        """Mark the data as this loop's again: the plant's own step may have come between."""
        if self.plant.data.userdata[MARK] == 0.0:
            raise EngineError(
                "the loop's MuJoCo data was reset: make a new loop to start from there"
            )
        self._mark()
