"""The closed loop in MuJoCo: laws as C callbacks, no Python per step.

MuJoCo evaluates control at every stage of its integrator. The callback counts these evaluations
itself: the first one of each step measures, acts and observes exactly as the ODE loop does
(:func:`gne_mj.loops.ode.control_step`), and writes a row if one is due; later ones, in mode
`continuous`, only act. In that mode the law's memory is in ``act``, moved by MuJoCo's integrator at
the rates that a second callback gives; in the held modes it is in ``userdata``, where nothing but
the law moves it. What else is kept from call to call is in ``userdata`` as well; both are part of
MuJoCo's state. userdata holds [mark, address of the parameter block, the fleet's own, the loop's
workspace].
"""

from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import EngineError
from gne_mj.game_model import Game
from gne_mj.loops import division, faultless, functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import ClosedLoop, Present, Samples
from gne_mj.loops.feedback import NO_SIZES
from gne_mj.loops.feedback import Sizes as LoopSizes
from gne_mj.loops.layout import (
    SCRATCH,
    Instant,
    Setup,
    Steps,
    Workspace,
    parameter_arrays,
    parts_in,
    problem_in,
    steps_in,
    steps_of,
)
from gne_mj.loops.ode import AGAIN, CONTINUOUS, DONE, ENDED, UNDER_WAY, control_step
from gne_mj.loops.recorder import Recorder, record
from gne_mj.native import address_in, callback, compiled, copy, kernel, source_key
from gne_mj.parameter_block import ParameterBlock, integers
from gne_mj.plants.agents import Agents
from gne_mj.plants.mujoco import PLACES, STAGES, Sizes, sizes_in
from gne_mj.plants.native_mujoco import (
    ACTIVATION,
    CALLBACK,
    LOOP_MARK,
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
    parameter_block_of,
    set_number,
    state_functions,
    step_address,
    timed_step,
)
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
    MujocoWorkspace, "m p agents states held history solver", **SCRATCH
)


@kernel
def held_memory(s):
    """Entries of a law's memory in userdata: the others are in act."""
    return 0 if s.mode == CONTINUOUS else s.memory


@kernel
def mujoco_workspace_length(s):
    """Entries of the workspace of a loop of these sizes, as a parameter block has them."""
    return _length(
        s.actions, s.constraints, s.agents, s.states, held_memory(s), s.history, s.solver
    )


@kernel
def mujoco_workspace_in(userdata, start, s):
    """The views of a workspace that begins there."""
    return _workspace_in(
        userdata, start, s.actions, s.constraints, s.agents, s.states, held_memory(s), s.history,
        s.solver,
    )  # fmt: skip


def workspace_of(userdata: NDArray[np.float64], start: int, s: Steps) -> Any:
    """The same as Python knows it, by name."""
    dtype = dtype_of(
        MujocoWorkspace, m=s.actions, p=s.constraints, agents=s.agents, states=s.states,
        held=held_memory(s), history=s.history, solver=s.solver, **SCRATCH,
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


def _control_of(at: Offsets, fleet: ModuleType, faults: ModuleType) -> Any:
    """Acts at a stage of MuJoCo's integrator; at a step's start it observes and writes a row."""
    source = source_key(fleet)

    def control(model, data):
        _ = source
        model, data = address_of(model), address_of(data)
        parameter_block = parameter_block_of(at, model, data)
        if parameter_block <= 0:
            return
        place = place_of(at, parameter_block, model, data)
        steps = steps_in(parameter_block)
        workspace = workspace_at(place, steps)
        continuous, progress = steps.mode == CONTINUOUS, workspace.loop.progress
        act = field(data, at.act, place.sizes.na)
        memory = act[place.sizes.memory :] if continuous else workspace.memory
        step, stage = np.int64(progress.step), np.int64(progress.stage)
        last = stage + 1 == steps.evaluations
        progress.step = step + 1 if last else step
        progress.stage = 0 if last else stage + 1
        if stage > 0 and not continuous:
            return
        parts, work = parts_in(parameter_block, workspace.loop), workspace.loop.work
        monitor, divided, h = parts.monitor, work.division, parts.clock.h
        time, length, state = (
            division.begins(divided, step, h),
            division.piece(divided, h),
            workspace.state,
        )
        if stage > 0:
            time += length if stage == 3 else 0.5 * length
            state = workspace.later
        if stage > 0 or divided.known == division.NOTHING:
            fleet.gather(at, data, parameter_block, state)
        userdata = field(data, at.userdata, place.sizes.nuserdata)
        storage = fleet.stored(parts.channels, state, userdata) if stage == 0 else 0.0
        where = (address_in(progress), place.model, data)
        good = monitor.exit == watch.INSIDE and control_step(
            faults, where, parts, Instant(time, step, stage), storage, state, memory
        )
        block = np.int64(progress.recorder)
        if good and stage == 0 and block > 0 and divided.position == 0.0:
            qpos = field(data, at.qpos, place.sizes.nq)
            record(block, faults, parts, step, Present(state, memory, qpos))
        if good and continuous:
            division.note(stage, parts.problem, work)
        places, ctrl = integers(parameter_block, PLACES), field(data, at.ctrl, place.sizes.nu)
        applied = faults.push(parts.problem, parts.clock, step, work.u, work.applied)
        for r in range(len(applied)):
            ctrl[fleet.actuator_of(places, r)] = applied[r] if good else 0.0

    return callback(CALLBACK, control)


def _remember_of(at: Offsets, fleet: ModuleType, faults: ModuleType) -> Any:
    """Gives the rates of a law's memory that MuJoCo's integrator moves."""
    source = source_key(fleet)

    def remember(model, data, actuator):
        _ = source
        model, data = address_of(model), address_of(data)
        parameter_block = parameter_block_of(at, model, data)
        if parameter_block <= 0:
            return 0.0
        place = place_of(at, parameter_block, model, data)
        rates = field(data, at.act_dot, place.sizes.na)[place.sizes.memory :]
        work = workspace_at(place, steps_in(parameter_block)).loop.work
        memory = field(data, at.act, place.sizes.na)[place.sizes.memory :]
        functions.rate(
            problem_in(parameter_block), faults.choose(work.y, work.measurement), memory, rates
        )
        return rates[0] if len(rates) == 1 else 0.0  # MuJoCo takes the one of a single entry

    return callback(ACTIVATION, remember)


@kernel
def save(machine, row):
    """Keep what a step of MuJoCo starts from."""
    call_state(machine.get, machine.model, machine.data, row.ctypes.data, machine.parts)


@kernel
def restore(machine, row):
    """The way back."""
    call_state(machine.set, machine.model, machine.data, row.ctypes.data, machine.parts)


class Machine(NamedTuple):
    """What moves a simulation: addresses, and room for what its steps start from."""

    step: int  # of mj_step
    get: int  # of mj_getState
    set: int  # of mj_setState
    parts: int  # of the state that these move
    model: int
    data: int
    saved: np.ndarray  # (2, entries of such a state), at a piece's start and at the step's


@kernel
def forces_stand(place, monitor, time):
    """Whether MuJoCo has left out no force; else the exit is latched."""
    lost = forces_lost(place.at, place.data, place.sizes.nv)
    if lost >= 0:
        watch.leave(monitor, watch.FORCES_LOST, time, -1, -1, lost, 0)
    return lost < 0


@kernel
def whole_step(place, machine, parts, step):
    """Take a step in a held mode, or put back what it started from."""
    save(machine, machine.saved[0])
    timed_step(place.at, machine.step, machine.model, machine.data)
    forces_stand(place, parts.monitor, step * parts.clock.h)
    if parts.monitor.exit == watch.INSIDE:
        return DONE
    restore(machine, machine.saved[0])
    return ENDED


@kernel
def begin_piece(place, machine, parts, step):
    """Take a piece of a step in mode continuous; ENDED, with what it started from, if it is not."""
    divided, monitor, h, saved = parts.work.division, parts.monitor, parts.clock.h, machine.saved
    at, model, data = place.at, place.model, place.data
    save(machine, saved[0])
    if divided.position == 0.0 and divided.level > 0.0:
        copy(saved[0], saved[1])
    set_number(model, at.timestep, division.piece(divided, h))
    set_number(data, at.time, division.begins(divided, step, h))
    call(machine.step, model, data)
    if not forces_stand(place, monitor, step * h):
        if divided.position == 0.0:
            copy(saved[0], saved[1])
        restore(machine, saved[1])
        divided.position = 0.0
        return ENDED
    if monitor.exit != watch.INSIDE and monitor.exit_stage == 0.0:
        restore(machine, saved[0])
        return ENDED
    return UNDER_WAY


@kernel
def end_piece(faults, machine, parts, step, stages, good):
    """Judge a piece, if it was inside at all, and go on or put back what it started from."""
    divided, h, saved, which = parts.work.division, parts.clock.h, machine.saved, 0
    if good:
        length = division.piece(divided, h)
        which = division.judge(stages, length, parts.problem, parts.work)
        if which < 0:
            return DONE if division.go_on(divided, h, parts.monitor) else UNDER_WAY
    restore(machine, saved[0])
    if divided.position == 0.0:
        copy(saved[0], saved[1])
    if division.halve(faults, step, h, which, parts.problem, parts.work, parts.monitor):
        return AGAIN
    restore(machine, saved[1])
    return ENDED


def _advance_of(at: Offsets, fleet: ModuleType, faults: ModuleType) -> Any:
    """Takes steps; an exit sets what MuJoCo moves back to the start of the step it is of."""
    source = source_key(fleet)

    def advance(machine, count):
        _ = source
        model, data = machine.model, machine.data
        parameter_block = parameter_block_of(at, model, data)
        place, steps = place_of(at, parameter_block, model, data), steps_in(parameter_block)
        workspace = workspace_at(place, steps)
        parts, progress, state = (
            parts_in(parameter_block, workspace.loop),
            workspace.loop.progress,
            workspace.state,
        )
        memory = field(data, at.act, place.sizes.na)[place.sizes.memory :]
        divided, h, moving = parts.work.division, parts.clock.h, steps.mode == CONTINUOUS
        step, done, result = np.int64(progress.step), 0, UNDER_WAY
        divided.known = division.NOTHING
        while done < count and result != ENDED:
            if moving:
                result = begin_piece(place, machine, parts, step)
                if result == ENDED:
                    break
                good = parts.monitor.exit == watch.INSIDE
                if good:
                    fleet.refresh(model, data, parameter_block)
                    fleet.gather(at, data, parameter_block, state)
                    end = Instant(division.ends(divided, step, h), step, division.END)
                    good = control_step(faults, (0, model, data), parts, end, 0.0, state, memory)
                result = end_piece(faults, machine, parts, step, steps.evaluations, good)
            else:
                result = whole_step(place, machine, parts, step)
            if result == DONE:
                step, done = step + 1, done + 1
            if moving and result != ENDED:
                progress.step, progress.stage = step, 0.0
        divided.known = division.NOTHING
        set_number(model, at.timestep, h)
        return done

    return compiled(advance)


@cache
def build(at: Offsets, fleet: ModuleType, faults: ModuleType) -> tuple[Any, ...]:
    """The callbacks for control and memory, and the native loop.

    Args:
        at: where MuJoCo keeps what.
        fleet: the module that reads and drives the robots, as :mod:`gne_mj.plants.mujoco` does.
        faults: module of kernels, as :func:`gne_mj.loops.ode.control_step` has it.
    """
    return tuple(make(at, fleet, faults) for make in (_control_of, _remember_of, _advance_of))


def machine_of(model: mujoco.MjModel, data: mujoco.MjData, saved: NDArray[np.float64]) -> Machine:
    """What moves this simulation; ``saved`` as :func:`workspace_for_states` makes it."""
    return Machine(step_address(), *state_functions(), model._address, data._address, saved)


def workspace(
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
    return ParameterBlock(arrays)


class MujocoLoop(ClosedLoop):
    """The closed loop of a fleet in MuJoCo.

    Args:
        plant: the fleet, reset to its start, with :func:`workspace` in its userdata and for the
        memory.
        setup: what the run is made of.
        memory: the law's, at the start.
        faults: module of kernels, see :func:`gne_mj.loops.ode.control_step`.
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
        self._parameter_block = mujoco_parameter_block(plant, setup, plant.agents, len(memory))
        self._faulty = faults is not faultless
        data, sizes = plant.data, steps_of(self._parameter_block)
        workspace = workspace_of(data.userdata, plant.sizes.workspace, sizes)
        self._progress, self.monitor, self._u = (
            workspace.loop,
            workspace.loop.monitor,
            workspace.loop.u,
        )
        self._memory = put_start(data, self._parameter_block, setup.clock.mode, memory)
        moved = setup.clock.mode == CONTINUOUS and len(memory) > 0
        self._remembers = moved  # by MuJoCo's integrator
        self._machine = machine_of(plant.model, data, workspace_for_states(plant.model))

    @property
    def _step(self) -> int:
        """Steps taken; in userdata, so that a state that is set again brings its own time."""
        return int(self._progress.step)

    @property
    def time(self) -> float:
        """Time of the present state in s."""
        return self._step * self.plant.timestep

    def advance(self, samples: int, every: int) -> Samples:
        """See the base class."""
        if self.monitor.exit != watch.INSIDE:
            samples = 0
        data, first = self.plant.data, self._step
        recorder = self._recorder(samples, every)
        self._progress.stage = 0.0
        remember = self._remember if self._remembers else None
        with callbacks(control=self._control, passive=self.plant.passive, activation=remember):
            steps = self._advance(self._machine, samples * every)
        # The callback counts steps, but one that ended in an exit was not taken.
        self._progress.step = first + steps
        self._progress.recorder = 0.0
        data.time = self.time
        return recorder.samples(0)

    def finish(self) -> Samples:
        """See the base class."""
        data = self.plant.data
        state = self.plant.state
        recorder = self._recorder(1, 1)
        with callbacks(passive=self.plant.passive):
            observe(self.plant, self._control, self._progress)
        self._progress.recorder = 0.0
        if recorder.done[0]:
            return recorder.samples(0)
        none = np.full((1, len(self._u)), np.nan)
        faulty_rows = none[:, : len(self._u) * self._faulty]
        qpos = data.qpos[None, : self.plant.configuration].copy()
        return Samples(state[None], none, self._memory[None].copy(), faulty_rows, faulty_rows, qpos)

    def present(self) -> Present:
        """See the base class."""
        qpos = self.plant.data.qpos[: self.plant.configuration].copy()
        return Present(self.plant.state, self._memory.copy(), qpos)

    def _adopt(self, setup: Setup) -> None:
        self._parameter_block = mujoco_parameter_block(
            self.plant, setup, self.plant.agents, len(self._memory)
        )

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
        if userdata[0] == 0.0:
            raise EngineError(
                "the loop's MuJoCo data was reset: make a new loop to start from there"
            )
        userdata[:USERDATA_HEADER] = LOOP_MARK, self._parameter_block.address
        recorder = Recorder(
            1, rows, (agents.channels, agents.states), len(self._memory), self._faulty,
            self.plant.configuration, first=self._step, every=every,
        )  # fmt: skip
        self._progress.recorder = recorder.addresses[0]
        return recorder


def observe(plant: "FleetPlant", control: Any, progress: Any) -> None:
    """Observe the present state without moving on, by the callback of a step's start.

    Args:
        plant: with mjData of a loop.
        control: the loop's callback.
        progress: of the loop, as its workspace in userdata has it.

    The plant's callbacks must be installed.
    """
    model, data = plant.model, plant.data
    plant.refresh()
    step, progress.stage = progress.step, 0.0
    control.ctypes(model._address, data._address)
    progress.step, progress.stage = step, 0.0


def workspace_for_states(model: mujoco.MjModel) -> NDArray[np.float64]:
    """Two rows for what a step of MuJoCo starts from."""
    return np.zeros((2, mujoco.mj_stateSize(model, STATE)))


def put_start(
    data: mujoco.MjData, parameter_block: ParameterBlock, mode: int, memory: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Make mjData the start of a run; returns the memory."""
    data.userdata[:] = 0.0
    place = data.act if mode == CONTINUOUS and len(memory) else data.userdata
    held: NDArray[np.float64] = place[len(place) - len(memory) :]
    held[:] = memory
    data.userdata[:USERDATA_HEADER] = LOOP_MARK, parameter_block.address
    return held
