"""The closed loop in MuJoCo: laws as C callbacks, no Python per step.

MuJoCo evaluates control at every stage of its integrator. The callback counts these evaluations
itself: the first one of each step measures, acts and observes exactly as the ODE loop does
(:func:`gne_mj.loops.ode.look`), and writes a row if one is due; later ones, in mode `continuous`,
only act. In that mode the law's memory is in ``act``, moved by MuJoCo's integrator at the rates
that a second callback gives; in the held modes it is in ``userdata``, where nothing but the law
moves it. What else is kept from call to call is in ``userdata`` as well; both are part of MuJoCo's
state. userdata holds [mark, address of the table, the fleet's own, the loop's room], and the room
ends with [flat state at the step's start, flat state at a later stage, memory].
"""

from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import EngineError
from gne_mj.game import Game
from gne_mj.loops import division, faultless, functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Present, Samples
from gne_mj.loops.feedback import NO_SIZES, Sizes
from gne_mj.loops.layout import (
    RECORDER,
    STAGE_NOW,
    STEP_NOW,
    Setup,
    channels_in,
    clock_in,
    parts_of,
    problem_in,
    room_needed,
    steps_in,
    steps_of,
    table_arrays,
)
from gne_mj.loops.ode import CONTINUOUS, look
from gne_mj.loops.recorder import Recorder, record
from gne_mj.native import address_in, callback, compiled, copy, kernel, source_key
from gne_mj.plants.agents import Agents
from gne_mj.plants.mujoco import MEMORY, NA, NQ, NU, NUSERDATA, NV, PLACES, ROOM, SIZES, STAGES
from gne_mj.plants.native_mujoco import (
    ACTIVATION,
    CALLBACK,
    LOOP_MARK,
    MARK,
    STATE,
    USERDATA_HEADER,
    Offsets,
    address_of,
    call,
    call_state,
    callbacks,
    field,
    forces_lost,
    offsets,
    set_number,
    state_functions,
    step_address,
    table_of,
    timed_step,
)
from gne_mj.table import Table, integers

if TYPE_CHECKING:
    from gne_mj.plants.fleet_plant import FleetPlant


@kernel
def split(rest, steps):
    """What MuJoCo's loop has behind a room's other parts: flat states now and later, memory."""
    size = steps.actions * steps.states
    return rest[:size], rest[size : 2 * size], rest[2 * size :]


@kernel
def save(functions, model, data, row):
    """Keep what a step of MuJoCo starts from; functions as ``state_functions()`` has them."""
    call_state(functions[0], model, data, row.ctypes.data, functions[2])


@kernel
def restore(functions, model, data, row):
    """The way back."""
    call_state(functions[1], model, data, row.ctypes.data, functions[2])


@cache
def build(
    at: Offsets,
    fleet: ModuleType,
    faults: ModuleType,
) -> tuple[Any, ...]:
    """The callbacks for control and memory, and the native loop.

    Args:
        at: where MuJoCo keeps what.
        fleet: the module that reads and drives the robots, as :mod:`gne_mj.plants.mujoco` does.
        faults: module of kernels, as :func:`gne_mj.loops.ode.look` has it.
    """
    source = source_key(fleet)

    def control(model, data):
        _ = source
        struct = address_of(data)
        table = table_of(at, address_of(model), struct)
        if table <= 0:
            return
        sizes, steps = integers(table, SIZES), steps_in(table)
        m, stages, mode = steps.actions, steps.evaluations, steps.mode
        ctrl = field(struct, at.ctrl, sizes[NU])
        userdata = field(struct, at.userdata, sizes[NUSERDATA])
        start = sizes[ROOM]
        monitor, u, work, rest = parts_of(userdata, start, steps)
        state, later, memory = split(rest, steps)
        if mode == CONTINUOUS:
            memory = field(struct, at.act, sizes[NA])[sizes[MEMORY] :]
        step, stage = np.int64(userdata[start + STEP_NOW]), np.int64(userdata[start + STAGE_NOW])
        last = stage + 1 == stages
        userdata[start + STEP_NOW] = step + 1 if last else step
        userdata[start + STAGE_NOW] = 0 if last else stage + 1
        if stage > 0 and mode != CONTINUOUS:
            return
        problem, clock, divided = problem_in(table), clock_in(table), work.division
        time, length = division.begins(divided, step, clock.h), division.piece(divided, clock.h)
        if stage > 0:
            time += length if stage == 3 else 0.5 * length
            state = later
        if stage > 0 or divided[division.KNOWN] == division.NOTHING:
            fleet.gather(at, struct, table, state)
        channels = channels_in(table)
        storage = fleet.stored(channels, state, userdata) if stage == 0 else 0.0
        place = (address_in(userdata) + 8 * start, address_of(model), struct)
        good = monitor[watch.EXIT] == watch.INSIDE and look(
            faults, place, problem, channels, clock, time, step, stage, storage, state, memory, u,
            monitor, work,
        )  # fmt: skip
        block = np.int64(userdata[start + RECORDER])
        if good and stage == 0 and block > 0 and divided[division.POSITION] == 0.0:
            qpos = field(struct, at.qpos, sizes[NQ])
            record(block, faults, channels, problem, clock, step, state, u, memory, work, qpos)
        if good and mode == CONTINUOUS:
            division.note(stage, problem, work)
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
        sizes, steps = integers(table, SIZES), steps_in(table)
        rates = field(struct, at.act_dot, sizes[NA])[sizes[MEMORY] :]
        userdata = field(struct, at.userdata, sizes[NUSERDATA])
        work = parts_of(userdata, sizes[ROOM], steps)[2]
        memory = field(struct, at.act, sizes[NA])[sizes[MEMORY] :]
        seen = faults.choose(work.y, work.seen)
        functions.rate(problem_in(table), seen, memory, rates)
        return rates[0] if len(rates) == 1 else 0.0  # MuJoCo takes the one of a single entry

    def advance(mj_step, functions, model, data, saved, count):
        """So many steps; an exit sets what MuJoCo moves back to the start of the step it is of.

        Args:
            mj_step, model, data: addresses.
            functions: see :func:`save`.
            saved: (2, entries of such a state), at the start of a piece of a step and of the step.
            count: steps.
        """
        _ = source
        table = table_of(at, model, data)
        sizes, steps = integers(table, SIZES), steps_in(table)
        userdata = field(data, at.userdata, sizes[NUSERDATA])
        start, moving = sizes[ROOM], steps.mode == CONTINUOUS
        monitor, u, work, rest = parts_of(userdata, start, steps)
        state, channels = split(rest, steps)[0], channels_in(table)
        memory = field(data, at.act, sizes[NA])[sizes[MEMORY] :]
        problem, clock, divided = problem_in(table), clock_in(table), work.division
        step, done, h = np.int64(userdata[start + STEP_NOW]), 0, clock.h
        divided[division.KNOWN] = division.NOTHING
        while done < count:
            save(functions, model, data, saved[0])
            if not moving:
                timed_step(at, mj_step, model, data)
                lost = forces_lost(at, data, sizes[NV])
                if lost >= 0:
                    watch.leave(monitor, watch.FORCES_LOST, step * h, -1, -1, lost, 0)
                if monitor[watch.EXIT] != watch.INSIDE:
                    restore(functions, model, data, saved[0])
                    break
                step, done = step + 1, done + 1
                continue
            if divided[division.POSITION] == 0.0 and divided[division.LEVEL] > 0.0:
                copy(saved[0], saved[1])
            length = division.piece(divided, h)
            set_number(model, at.timestep, length)
            set_number(data, at.time, division.begins(divided, step, h))
            call(mj_step, model, data)
            lost = forces_lost(at, data, sizes[NV])
            if lost >= 0:
                watch.leave(monitor, watch.FORCES_LOST, step * h, -1, -1, lost, 0)
                if divided[division.POSITION] == 0.0:
                    copy(saved[0], saved[1])
                restore(functions, model, data, saved[1])
                divided[division.POSITION] = 0.0
                break
            good = monitor[watch.EXIT] == watch.INSIDE
            if not good and monitor[watch.EXIT_STAGE] == 0.0:
                restore(functions, model, data, saved[0])
                break
            if good:
                fleet.refresh(model, data, table)
                fleet.gather(at, data, table, state)
                good = look(
                    faults, (0, model, data), problem, channels, clock,
                    division.ends(divided, step, h), step, division.END, 0.0, state, memory, u,
                    monitor, work,
                )  # fmt: skip
            which = division.judge(steps.evaluations, length, problem, work) if good else 0
            if good and which < 0:
                if division.go_on(divided, h, monitor):
                    step, done = step + 1, done + 1
            else:
                restore(functions, model, data, saved[0])
                if divided[division.POSITION] == 0.0:
                    copy(saved[0], saved[1])
                if not division.halve(faults, step, h, which, problem, work, monitor):
                    restore(functions, model, data, saved[1])
                    break
            userdata[start + STEP_NOW] = step
            userdata[start + STAGE_NOW] = 0.0
        divided[division.KNOWN] = division.NOTHING
        set_number(model, at.timestep, h)
        return done

    return (
        callback(CALLBACK, control),
        callback(ACTIVATION, remember),
        compiled(advance),
    )


def room(
    game: Game, agents: Agents, memory: int, mode: int, sizes: Sizes = NO_SIZES
) -> tuple[int, int]:
    """Entries of userdata, and of act, that a plant must leave for this game's loop.

    Args:
        game, agents: of the loop.
        memory: length of the law's memory.
        mode: CONTINUOUS, SAMPLED or IMPLICIT of :mod:`gne_mj.loops.ode`.
        sizes: of the scratch arrays that depend on the kind of loop.
    """
    needed = room_needed(game.actions, game.constraints_count, game.agents, *sizes)
    needed = int(needed) + 2 * game.actions * agents.states
    return (needed, memory) if mode == CONTINUOUS else (needed + memory, 0)


def mujoco_table(plant: "FleetPlant", setup: Setup, agents: Agents, memory: int) -> Table:
    """The table of a run: the plant's places and sizes, the robots' numbers, and the rest."""
    arrays = table_arrays(plant.arrays_for(agents), setup, agents, memory, STAGES[plant.integrator])
    return Table(arrays)


class MujocoLoop(ClosedLoop):
    """The closed loop of a fleet in MuJoCo.

    Args:
        plant: the fleet, reset to its start, with :func:`room` in its userdata and for the memory.
        setup: what the run is made of.
        memory: the law's, at the start.
        faults: module of kernels, see :func:`gne_mj.loops.ode.look`.
    """

    def __init__(
        self,
        plant: "FleetPlant",
        setup: Setup,
        memory: NDArray[np.float64],
        faults: ModuleType = faultless,
    ) -> None:
        self.plant = plant
        self._control, self._remember, self._advance = build(offsets(), plant.kernels, faults)
        self._table = mujoco_table(plant, setup, plant.agents, len(memory))
        self._faulty = faults is not faultless
        data, sizes = plant.data, steps_of(self._table)
        self._start = int(plant.table_arrays[SIZES][ROOM])
        self._memory = put_start(data, self._start, self._table, setup.clock.mode, memory)
        moved = setup.clock.mode == CONTINUOUS and len(memory) > 0
        self._remembers = moved  # by MuJoCo's integrator
        self._saved = room_for_states(plant.model)
        self.monitor, self._u, *_ = parts_of(data.userdata, self._start, sizes)

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
        data, first = self.plant.data, self._step
        recorder = self._recorder(samples, every)
        data.userdata[self._start + STAGE_NOW] = 0.0
        remember = self._remember if self._remembers else None
        with callbacks(control=self._control, passive=self.plant.passive, activation=remember):
            steps = self._advance(
                step_address(), state_functions(), self.plant.model._address, data._address,
                self._saved, samples * every,
            )  # fmt: skip
        # The callback counts steps, but one that ended in an exit was not taken.
        data.userdata[self._start + STEP_NOW] = first + steps
        data.userdata[self._start + RECORDER] = 0.0
        data.time = self.time
        return recorder.samples(0)

    def finish(self) -> Samples:
        """See the base class."""
        data = self.plant.data
        state = self.plant.state
        recorder = self._recorder(1, 1)
        with callbacks(passive=self.plant.passive):
            observe(self.plant, self._control, self._start)
        data.userdata[self._start + RECORDER] = 0.0
        if recorder.done[0]:
            return recorder.samples(0)
        none = np.full((1, len(self._u)), np.nan)
        struck = none[:, : len(self._u) * self._faulty]
        qpos = data.qpos[None, : self.plant.configuration].copy()
        return Samples(state[None], none, self._memory[None].copy(), struck, struck, qpos)

    def present(self) -> Present:
        """See the base class."""
        qpos = self.plant.data.qpos[: self.plant.configuration].copy()
        return Present(self.plant.state, self._memory.copy(), qpos)

    def _adopt(self, setup: Setup) -> None:
        self._table = mujoco_table(self.plant, setup, self.plant.agents, len(self._memory))

    def push(self, force: NDArray[np.float64]) -> None:
        """See the base class; forces are MuJoCo's qfrc_applied at the outputs' joints."""
        at = self.plant.output_joints
        if np.any(force[at < 0]):
            raise EngineError(
                "this robot's output is a sensor's, not a joint's: nothing to push at"
            )
        self.plant.data.qfrc_applied[at[at >= 0]] = force[at >= 0]

    def _recorder(self, rows: int, every: int) -> Recorder:
        """Room for rows from now on, made known to the callbacks."""
        agents, userdata = self.plant.agents, self.plant.data.userdata
        # Marked as this loop's again: the plant's own step may have come between.
        if userdata[MARK] == 0.0:
            raise EngineError(
                "the loop's MuJoCo data was reset: make a new loop to start from there"
            )
        userdata[:USERDATA_HEADER] = LOOP_MARK, self._table.address
        recorder = Recorder(
            1, rows, (agents.channels, agents.states), len(self._memory), self._faulty,
            self.plant.configuration, first=self._step, every=every,
        )  # fmt: skip
        userdata[self._start + RECORDER] = recorder.addresses[0]
        return recorder


def observe(plant: "FleetPlant", control: Any, start: int) -> None:
    """Observe the present state without moving on, by the callback of a step's start.

    Args:
        plant: with mjData of a loop.
        control: the loop's callback.
        start: of its room in userdata.

    The plant's callbacks must be installed.
    """
    model, data = plant.model, plant.data
    plant.refresh()
    step = data.userdata[start + STEP_NOW]
    data.userdata[start + STAGE_NOW] = 0.0
    control.ctypes(model._address, data._address)
    data.userdata[start + STEP_NOW], data.userdata[start + STAGE_NOW] = step, 0.0


def room_for_states(model: mujoco.MjModel) -> NDArray[np.float64]:
    """Two rows for what a step of MuJoCo starts from."""
    return np.zeros((2, mujoco.mj_stateSize(model, STATE)))


def put_start(
    data: mujoco.MjData, start: int, table: Table, mode: int, memory: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Make mjData the start of a run, its room at ``start`` of userdata; returns the memory."""
    data.userdata[:] = 0.0
    place = data.act if mode == CONTINUOUS and len(memory) else data.userdata
    held: NDArray[np.float64] = place[len(place) - len(memory) :]
    held[:] = memory
    data.userdata[:USERDATA_HEADER] = LOOP_MARK, table.address
    return held
