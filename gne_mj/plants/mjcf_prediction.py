"""A fleet of the user's own robots as compiled code sees it, and its map over a control period.

Nothing but MuJoCo knows how such robots move. The outputs at the end of a control period are
therefore found by stepping a second mjData from the same state. It bears no loop's mark, so that
no law acts on it; the agents' own damping and their low-level controllers do.
"""

from typing import NamedTuple

from gne_mj.native import kernel
from gne_mj.numbers import Numbers, names_of, numbers_in
from gne_mj.parameter_block import floats, integers
from gne_mj.plants.mjcf_low_level import Controls, run_all
from gne_mj.plants.mjcf_reading import READING, position_of, velocity_of
from gne_mj.plants.mujoco import PLACES, SIZES, Sizes, sizes_in
from gne_mj.plants.native_mujoco import (
    PLANT_MARK,
    USERDATA_HEADER,
    call,
    call_state,
    field,
    number,
    timed_step,
)
from gne_mj.records import in_numbers


class Prediction(NamedTuple):
    """What such fleets need besides, behind :class:`gne_mj.plants.mujoco.Sizes` in SIZES."""

    twin: int  # address of the second mjData
    known: int  # bits of mjtState that it is given
    lookahead: int  # numbers of look-ahead in NUMBERS, before the readings' factors
    twists: int  # words of cvel and subtree_com in mjData
    centres: int
    readings: int  # how many, behind these numbers
    drives: int  # behind the readings
    controllers: int  # behind the drives
    room: int  # entry of userdata where that of all controllers begins
    # addresses of MuJoCo's functions
    step: int
    copy: int
    first: int  # those that bring up to date what is read; 0 if nothing needs them
    second: int
    third: int
    look_first: int  # and what controllers read, likewise
    look_second: int
    look_third: int


class ChannelPlace(Numbers):
    """Where a channel's numbers lie: what PLACES has of each."""

    output: int  # the joint's degree of freedom, or (negative) the first of its readings less one
    position: int  # the joint's entry of qpos, or -1
    readings: int  # how many; 0 of a joint


class Drive(Numbers):
    """That a channel's input, by a factor, is a part of a control."""

    channel: int
    actuator: int  # entry of ctrl
    first: int  # whether it is that entry's first one, so that the others are added to it


PLACE, DRIVE = len(names_of(ChannelPlace)), len(names_of(Drive))
# Between the places and the sizes: tau, d and v_0 of each channel, nothing where outputs are
# velocities; then the readings' factors, the drives', and the controllers' numbers
NUMBERS = 1
READINGS = len(Sizes._fields) + len(Prediction._fields)  # where they begin in SIZES
prediction_in = in_numbers(Prediction, SIZES, len(Sizes._fields))
_place_in, _drive_in = numbers_in(ChannelPlace), numbers_in(Drive)


@kernel
def place_of(places, r):
    """Where the numbers of channel r lie."""
    return _place_in(places, r * PLACE)


@kernel
def gather(at, data, parameter_block, state):
    """Fill the flat state (m channels of mjcf_robot.STATES) from mjData."""
    sizes = sizes_in(parameter_block)
    qpos, qvel = field(data, at.qpos, sizes.nq), field(data, at.qvel, sizes.nv)
    places, numbers = integers(parameter_block, PLACES), floats(parameter_block, NUMBERS)
    ahead = prediction_in(parameter_block).lookahead > 0
    for r in range(len(places) // PLACE):
        place = place_of(places, r)
        source, position = place.output, place.position
        if source >= 0:
            state[2 * r] = qvel[source]
            state[2 * r + 1] = qpos[position] if position >= 0 else 0.0
        else:
            state[2 * r], state[2 * r + 1] = read(data, parameter_block, place)
        if ahead:
            tau, reference = numbers[3 * r], numbers[3 * r + 2]
            state[2 * r + 1] -= reference * number(data, at.time)
            state[2 * r] = state[2 * r + 1] + tau * (state[2 * r] - reference)


@kernel
def read(data, parameter_block, place):
    """Velocity and position of a channel that is no joint's: the sums of its readings."""
    prediction, numbers = prediction_in(parameter_block), floats(parameter_block, NUMBERS)
    table = integers(parameter_block, SIZES)[READINGS:]
    velocity, position, first = 0.0, 0.0, -1 - place.output
    for k in range(first, first + place.readings):
        factor, entry = numbers[prediction.lookahead + k], k * READING
        velocity += factor * velocity_of(data, prediction.twists, prediction.centres, table, entry)
        position += factor * position_of(data, table, entry)
    return velocity, position


@kernel
def mark_twin(at, parameter_block, twin):
    """Let the agents' own damping act where a prediction is made."""
    userdata = field(twin, at.userdata, USERDATA_HEADER)
    userdata[0], userdata[1] = PLANT_MARK, float(parameter_block)


@kernel
def add_forces(at, data, parameter_block):
    """Add every agent's own damping to mjData's passive forces."""
    sizes, places = sizes_in(parameter_block), integers(parameter_block, PLACES)
    qvel = field(data, at.qvel, sizes.nv)
    force = field(data, at.qfrc_passive, sizes.nv)
    numbers = floats(parameter_block, NUMBERS)
    for r in range(prediction_in(parameter_block).lookahead // 3):
        joint = place_of(places, r).output
        if joint >= 0:
            force[joint] -= numbers[3 * r + 1] * (qvel[joint] - numbers[3 * r + 2])


@kernel
def refresh(model, data, parameter_block):
    """Bring up to date what is read besides joints, which is of the last step's start."""
    prediction = prediction_in(parameter_block)
    if prediction.first != 0:
        call(prediction.first, model, data)
        call(prediction.second, model, data)
        call(prediction.third, model, data)


@kernel
def drive(at, data, parameter_block, u, on):
    """Make inputs u (m,) mjData's controls; zero if not ``on``."""
    prediction, numbers = prediction_in(parameter_block), floats(parameter_block, NUMBERS)
    table = integers(parameter_block, SIZES)[READINGS + READING * prediction.readings :]
    factors = numbers[prediction.lookahead + prediction.readings :]
    ctrl = field(data, at.ctrl, sizes_in(parameter_block).nu)
    for k in range(prediction.drives):
        each = _drive_in(table, k * DRIVE)
        part = factors[k] * u[each.channel] if on else 0.0
        ctrl[each.actuator] = part if each.first != 0 else ctrl[each.actuator] + part
    if prediction.controllers > 0:
        run_all(at, data, controls_of(parameter_block), u, on)


@kernel
def controls_of(parameter_block):
    """All that controllers are run with."""
    prediction, numbers = prediction_in(parameter_block), floats(parameter_block, NUMBERS)
    table = integers(parameter_block, SIZES)[READINGS:]
    return Controls(
        prediction.controllers, prediction.twists, prediction.centres, table,
        table[READING * prediction.readings + DRIVE * prediction.drives :], numbers,
        prediction.room,
    )  # fmt: skip


@kernel
def drive_again(at, model, data, parameter_block, u):
    """Let low-level controllers act where another step begins under inputs u, out of callbacks."""
    prediction = prediction_in(parameter_block)
    if prediction.controllers > 0:
        if prediction.look_first != 0:
            call(prediction.look_first, model, data)
            call(prediction.look_second, model, data)
            call(prediction.look_third, model, data)
        run_all(at, data, controls_of(parameter_block), u, True)


@kernel
def roll(channels, clock, state, u, scratch):
    """Not known without MuJoCo: late sensors of such robots are refused in mode implicit."""


@kernel
def set_out(context, channels, state, u, trial):
    """Make the second mjData what the simulation is now, under u (m,)."""
    at, model, data, parameter_block = context
    prediction = prediction_in(parameter_block)
    twin = prediction.twin
    call_state(prediction.copy, model, data, twin, prediction.known)
    mark_twin(at, parameter_block, twin)
    if prediction.controllers > 0:
        kept = field(data, at.userdata, prediction.room)
        given = field(twin, at.userdata, prediction.room)
        for k in range(USERDATA_HEADER, prediction.room):
            given[k] = kept[k]
    drive(at, twin, parameter_block, u, True)


@kernel
def step_on(context, channels, clock, u, out, trial, scratch):
    """Fill out (m,) with the outputs one integration step after where the second mjData is."""
    at, model, _data, parameter_block = context
    prediction = prediction_in(parameter_block)
    drive_again(at, model, prediction.twin, parameter_block, u)
    timed_step(at, prediction.step, model, prediction.twin)
    # a whole mj_forward would leave another warm start
    refresh(model, prediction.twin, parameter_block)
    gather(at, prediction.twin, parameter_block, trial)
    for r in range(len(u)):
        out[r] = trial[2 * r]


@kernel
def predict(context, channels, clock, state, u, out, trial, scratch):
    """Fill out (m,) with the outputs after a control period under u (m,), by a second mjData.

    The arguments are as :func:`gne_mj.plants.zero_order_hold.predict` has them, but that it starts
    from the simulation itself. Where outputs of ``state`` are read wrong, what they change by over
    the period is added to what is read.
    """
    at, model, data, parameter_block = context
    prediction = prediction_in(parameter_block)
    twin = prediction.twin
    gather(at, data, parameter_block, trial)
    for r in range(len(u)):
        out[r] = state[2 * r] - trial[2 * r]
    set_out(context, channels, state, u, trial)
    for _ in range(clock.period):
        drive_again(at, model, twin, parameter_block, u)
        timed_step(at, prediction.step, model, twin)
    refresh(model, twin, parameter_block)
    gather(at, twin, parameter_block, trial)
    for r in range(len(u)):
        out[r] += trial[2 * r]


@kernel
def is_coupled():
    """Whether an input moves the outputs of other channels: axes of a body, robots that touch."""
    return True


@kernel
def is_affine(clock):
    """Never taken for granted: actuators have dynamics, joints limits, bodies contacts."""
    return False
