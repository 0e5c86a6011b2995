"""The closed loop in MuJoCo: laws as C callbacks, no Python per step.

MuJoCo evaluates control at every stage of its integrator. The callback counts these evaluations
itself: the first one of each step measures, acts and observes exactly as the ODE loop does
(:func:`gne_mj.loops.ode.control_step`), and writes a row if one is due; later ones, in mode
`continuous`, only act. In that mode the law's memory is in ``act``, moved by MuJoCo's integrator at
the rates that a second callback gives; in the held modes it is in ``userdata``, where nothing but
the law moves it. What else is kept from call to call is there as well
(:mod:`gne_mj.loops.mujoco_workspace`).
"""

from functools import cache
from types import ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

import mujoco
import numpy as np

from gne_mj.loops import division, functions
from gne_mj.loops import monitor as watch
from gne_mj.loops.base import Present
from gne_mj.loops.layout import (
    Instant,
    parts_in,
    problem_in,
    steps_in,
)
from gne_mj.loops.mujoco_workspace import place_of, workspace_at
from gne_mj.loops.ode import AGAIN, CONTINUOUS, DONE, ENDED, UNDER_WAY, control_step
from gne_mj.loops.recorder import record
from gne_mj.native import address_in, callback, compiled, copy, kernel, source_key
from gne_mj.parameter_block import floats_at
from gne_mj.plants.native_mujoco import (
    ACTIVATION,
    CALLBACK,
    Offsets,
    address_of,
    call,
    field,
    forces_lost,
    parameter_block_of,
    set_number,
    state_parts,
    step_address,
    timed_step,
)

if TYPE_CHECKING:
    pass


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
        time, length = division.begins(divided, step, h), division.piece(divided, h)
        state = workspace.state
        if stage > 0:
            time += length if stage == 3 else 0.5 * length
            state = workspace.later
        if stage > 0 or divided.known == division.NOTHING:
            fleet.gather(at, data, parameter_block, state)
        userdata = field(data, at.userdata, place.sizes.nuserdata)
        storage = fleet.stored(parts.channels, state, userdata) if stage == 0 else 0.0
        if stage == 0 and monitor.exit == watch.INSIDE:
            functions.observe_contacts(parts.problem, monitor, data, time)
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
        applied = faults.push(parts.problem, parts.clock, step, work.u, work.applied)
        fleet.drive(at, data, parameter_block, applied, good)

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
    at = 0
    for k in range(len(machine.parts)):
        source = floats_at(machine.parts[k, 0], machine.parts[k, 1])
        for entry in range(len(source)):
            row[at + entry] = source[entry]
        at += len(source)


@kernel
def restore(machine, row):
    """The way back."""
    at = 0
    for k in range(len(machine.parts)):
        target = floats_at(machine.parts[k, 0], machine.parts[k, 1])
        for entry in range(len(target)):
            target[entry] = row[at + entry]
        at += len(target)


class Machine(NamedTuple):
    """What moves a simulation: addresses, and room for what its steps start from."""

    step: int  # of mj_step
    model: int
    data: int
    parts: np.ndarray  # (k, 2) address and length of each array that a step starts from
    saved: np.ndarray  # (2, entries of these), at a piece's start and at the step's


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
        parts, progress = parts_in(parameter_block, workspace.loop), workspace.loop.progress
        state, here = workspace.state, (address_in(progress), model, data)
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
                    good = control_step(faults, here, parts, end, 0.0, state, memory)
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


def machine_of(model: mujoco.MjModel, data: mujoco.MjData) -> Machine:
    """What moves this simulation.

    Its state is copied from and to where it lies, as mj_getState and mj_setState do, which take
    longer to find the same few arrays anew in each step.
    """
    parts = state_parts(data)
    return Machine(
        step_address(), model._address, data._address, parts, np.zeros((2, np.sum(parts[:, 1])))
    )
