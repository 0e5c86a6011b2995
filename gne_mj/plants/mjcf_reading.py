"""Velocities and positions that a user's robots have, as numbers in MuJoCo's arrays.

When MuJoCo asks for control it has the kinematics of that very stage: the places and orientations
of all frames, each body's velocity (``cvel``), and the rates of all tendons and actuators. An
output is a sum of such numbers, read where they lie; sensors alone are of a step's first stage.
"""

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import mujoco

from gne_mj.errors import InvalidInput, nearest
from gne_mj.native import kernel
from gne_mj.numbers import Numbers, names_of, numbers_in
from gne_mj.plants.c_layout import unknown_layout, word_of
from gne_mj.plants.mjcf_output import Output
from gne_mj.plants.native_mujoco import number, word

_SENSOR, _JOINT, _OBJECT = mujoco.mjtSensor, mujoco.mjtJoint, mujoco.mjtObj
# Of each kind of frame: its places and orientations in mjData
_FRAMES = {
    "body": ("xpos", "xmat"), "centre": ("xipos", "ximat"), "site": ("site_xpos", "site_xmat"),
    "geom": ("geom_xpos", "geom_xmat"),
}  # fmt: skip
OBJECTS = {
    "body": _OBJECT.mjOBJ_BODY, "site": _OBJECT.mjOBJ_SITE, "geom": _OBJECT.mjOBJ_GEOM,
    "joint": _OBJECT.mjOBJ_JOINT, "tendon": _OBJECT.mjOBJ_TENDON,
    "actuator": _OBJECT.mjOBJ_ACTUATOR, "sensor": _OBJECT.mjOBJ_SENSOR,
}  # fmt: skip
# Sensors that tell a velocity of a joint, tendon or actuator
_RATES = {
    _SENSOR.mjSENS_JOINTVEL: "joint", _SENSOR.mjSENS_BALLANGVEL: "joint",
    _SENSOR.mjSENS_TENDONVEL: "tendon", _SENSOR.mjSENS_ACTUATORVEL: "actuator",
}  # fmt: skip
# and of a frame: whether angular, whose axes
_FRAME_SENSORS = {
    _SENSOR.mjSENS_VELOCIMETER: (False, "own"), _SENSOR.mjSENS_GYRO: (True, "own"),
    _SENSOR.mjSENS_FRAMELINVEL: (False, "world"), _SENSOR.mjSENS_FRAMEANGVEL: (True, "world"),
}  # fmt: skip
_FRAME_KINDS = {
    _OBJECT.mjOBJ_BODY: "centre", _OBJECT.mjOBJ_XBODY: "body", _OBJECT.mjOBJ_SITE: "site",
    _OBJECT.mjOBJ_GEOM: "geom",
}  # fmt: skip


# Functions of MuJoCo's that bring up to date what is read, in their order: frames alone, or all
_FRAME_FUNCTIONS = ("mj_kinematics", "mj_comPos", "mj_comVel")
_SENSOR_FUNCTIONS = ("mj_fwdPosition", "mj_fwdVelocity", "mj_sensorVel")
_STATE_ARRAYS = ("qpos", "qvel", "act")
_OF_FRAMES = (
    "xpos", "xmat", "xipos", "ximat", "site_xpos", "site_xmat", "geom_xpos", "geom_xmat", "xaxis",
    "xanchor", "subtree_com",
)  # fmt: skip


class Reading(Numbers):
    """One number to be added to an output; places are in 8-byte words within mjData."""

    source: int  # of the array that has the velocity; of a frame, its places
    entry: int
    place: int  # of the array that has the position
    place_entry: int  # -1: it has none
    body: int  # of a frame; -1: source has the velocity itself
    root: int  # of its tree
    matrix: int  # of the orientations whose axis it is along; 0 for the world's
    axis: int
    angular: int
    last: int  # of the degrees of freedom that move a frame, the parents of which are the others


READING = len(names_of(Reading))
reading_at = numbers_in(Reading)  # (table, which)


@dataclass(frozen=True)
class Term:
    """A :class:`Reading`, by name, with its factor.

    Args:
        source, place, matrix: names of mjData's arrays, empty for none.
        entry, place_entry, body, root, axis, angular, last: as a reading has them.
        factor: by which it is multiplied.
    """

    source: str
    entry: int
    place: str = ""
    place_entry: int = -1
    body: int = -1
    root: int = 0
    matrix: str = ""
    axis: int = 0
    angular: bool = False
    last: int = -1
    factor: float = 1.0

    @property
    def fresh(self) -> bool:
        """Whether it is of the present stage, and not of the step's first one."""
        return self.source != "sensordata"

    def numbers(self, data: mujoco.MjData) -> list[int]:
        """As compiled code has it."""
        return [
            array_word(data, self.source), self.entry, array_word(data, self.place),
            self.place_entry, self.body, self.root, array_word(data, self.matrix), self.axis,
            int(self.angular), self.last,
        ]  # fmt: skip


def fresh_by(terms: Sequence[Term]) -> tuple[str, ...]:
    """The functions of MuJoCo's that bring these up to date after a step; none of the state's."""
    if all(term.body < 0 and term.source in _STATE_ARRAYS for term in terms):
        return ()
    if all(term.body >= 0 or term.source in (*_STATE_ARRAYS, *_OF_FRAMES) for term in terms):
        return _FRAME_FUNCTIONS
    return _SENSOR_FUNCTIONS


def array_word(data: mujoco.MjData, name: str) -> int:
    """Where mjData has the pointer to an array, checked there; 0 for no name.

    Raises:
        EngineError: it is elsewhere.
    """
    if not name:
        return 0
    at, array = word_of("mjData", name), getattr(data, name)
    if (
        array.size
        and ctypes.c_int64.from_address(data._address + 8 * at).value != array.ctypes.data
    ):
        raise unknown_layout(f"mjData.{name}")
    return at


@kernel
def velocity_of(data, twists, centres, readings, which):
    """The velocity that reading ``which`` of a table is, given mjData's address.

    The velocity of a frame's origin p is that of its body's tree's centre of mass c, at which
    MuJoCo keeps velocities, and w x (p - c). ``twists`` and ``centres`` are cvel's and
    subtree_com's words.
    """
    reading = reading_at(readings, which)
    if reading.body < 0:
        return number(word(data, reading.source), reading.entry)
    twist, centre = word(data, twists) + 48 * reading.body, word(data, centres) + 24 * reading.root
    return along_twist(data, reading, twist, centre)


@kernel
def along_twist(data, reading, twist, centre):
    """The velocity that the reading of a frame is under a twist about its tree's centre of mass.

    Both are addresses: the twist has the angular velocity first, as cvel's rows and cdof's do.
    """
    points, found = word(data, reading.source), 0.0
    for j in range(3):
        if reading.angular == 0:
            k, last = (j + 1) % 3, (j + 2) % 3
            arm_k = number(points, reading.entry + k) - number(centre, k)
            arm_last = number(points, reading.entry + last) - number(centre, last)
            part = number(twist, 3 + j) + number(twist, k) * arm_last - number(twist, last) * arm_k
        else:
            part = number(twist, j)
        if reading.matrix != 0:
            found += part * number(
                word(data, reading.matrix), 3 * reading.entry + 3 * j + reading.axis
            )
        elif j == reading.axis:
            found += part
    return found


@kernel
def position_of(data, readings, which):
    """The position whose rate that is; 0 where none is known."""
    reading = reading_at(readings, which)
    if reading.place_entry < 0:
        return 0.0
    return number(word(data, reading.place), reading.place_entry)


def terms_of(model: mujoco.MjModel, prefix: str, output: str | Output) -> list[Term]:
    """What an output is the sum of, in a fleet's model.

    Args:
        model: of the fleet.
        prefix: of the robot's names in it.
        output: a joint's or sensor's name, or a declared one.

    Raises:
        InvalidInput: the file has no such thing, or it has no such velocity; names ``output``.
    """
    if isinstance(output, str):
        kind = "joint" if _find(model, "joint", prefix + output) >= 0 else "sensor"
        if kind == "sensor" and _find(model, "sensor", prefix + output) < 0:
            names = [*names_in(model, "joint", prefix), *names_in(model, "sensor", prefix)]
            raise InvalidInput("output", output, nearest(output, names))
        return terms_of(model, prefix, Output(kind, output))
    if output.kind == "sum":
        terms = [term for each in output.terms for term in terms_of(model, prefix, each)]
        return [replace(term, factor=output.factor * term.factor) for term in terms]
    index = _find(model, output.kind, prefix + output.name)
    if index < 0:
        near = nearest(output.name, names_in(model, output.kind, prefix))
        raise InvalidInput("output", output.name, f"the file has no such {output.kind}; {near}")
    found = _OF_KIND[output.kind](model, index, output)
    return [replace(found, factor=output.factor)]


def _frame(model: mujoco.MjModel, index: int, output: Output) -> Term:
    """Of a body, site or geom; of one with a free joint that joint's, which needs no kinematics."""
    own, kind = output.frame == "own", output.kind
    if output.axis < 0:
        raise _refused(output, "it has three velocities: say which by axes")
    of_body = kind in ("body", "centre")
    body = index if of_body else int(getattr(model, f"{kind}_bodyid")[index])
    joint = int(model.body_jntadr[body])
    floats = joint >= 0 and model.jnt_type[joint] == _JOINT.mjJNT_FREE
    if floats and kind == "body" and own == output.angular:
        return _dof(model, joint, output.axis + 3 * output.angular)
    place, matrix = _FRAMES[kind]
    at = 3 * index + output.axis if not own and not output.angular else -1
    return Term(
        place, 3 * index, place, at, body, int(model.body_rootid[body]), matrix if own else "",
        output.axis, output.angular, _last_dof(model, body),
    )  # fmt: skip


def _last_dof(model: mujoco.MjModel, body: int) -> int:
    """The last of the degrees of freedom that move a body; -1 if none does."""
    while body and not model.body_dofnum[body]:
        body = int(model.body_parentid[body])
    return int(model.body_dofadr[body] + model.body_dofnum[body]) - 1 if body else -1


def _dof(model: mujoco.MjModel, joint: int, axis: int) -> Term:
    kind = model.jnt_type[joint]
    turns = kind == _JOINT.mjJNT_BALL or (kind == _JOINT.mjJNT_FREE and axis >= 3)
    at = -1 if turns else int(model.jnt_qposadr[joint]) + axis
    return Term("qvel", int(model.jnt_dofadr[joint]) + axis, "qpos", at)


def _joint(model: mujoco.MjModel, index: int, output: Output) -> Term:
    kind = _JOINT(model.jnt_type[index])
    if kind in (_JOINT.mjJNT_SLIDE, _JOINT.mjJNT_HINGE):
        if output.axis >= 0 or output.frame:
            raise _refused(output, "a slide or hinge joint has one velocity: leave its axes out")
        return _dof(model, index, 0)
    if output.axis < 0:
        words = "it is a ball joint" if kind == _JOINT.mjJNT_BALL else "it is a free joint"
        raise _refused(output, f"{words}, with several velocities: say which by axes")
    if kind == _JOINT.mjJNT_BALL:
        if output.frame == "world":
            raise _refused(output, "a ball joint's axes are its own: name the body for others")
        return _dof(model, index, output.axis)
    frame = output.frame or ("own" if output.angular else "world")
    body = int(model.jnt_bodyid[index])
    return _frame(model, body, replace(output, kind="body", frame=frame))


def _rate(model: mujoco.MjModel, index: int, output: Output) -> Term:
    if output.kind == "tendon":
        return Term("ten_velocity", index, "ten_length", index)
    row = int(model.actuator_outadr[index])
    return Term("actuator_velocity", row, "actuator_length", row)


def _sensor(model: mujoco.MjModel, index: int, output: Output) -> Term:
    """What a sensor tells, where it is told of; else the sensor's own number.

    But for joints a sensor tells no position.
    """
    kind, size = _SENSOR(model.sensor_type[index]), int(model.sensor_dim[index])
    velocity = kind in _RATES or kind in _FRAME_SENSORS or kind == _SENSOR.mjSENS_SUBTREELINVEL
    expected = ""
    if not velocity:
        expected = (
            "a sensor must be of a velocity: jointvel, tendonvel or actuatorvel, or ballangvel,"
            " velocimeter, gyro, framelinvel, frameangvel or subtreelinvel"
        )
    elif model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_SENSOR:
        expected = "the file's flags switch sensors off: name a joint, or leave the flag out"
    elif model.sensor_cutoff[index] or model.sensor_delay[index] or model.sensor_interval[index, 0]:
        expected = (
            "the sensor must tell the velocity as it is: leave out its cutoff, delay and interval,"
            " and declare late sensors as a fault instead"
        )
    elif size > 1 and output.axis < 0:
        expected = f"the sensor tells {size} numbers: {{sensor = '{output.name}', axes = ['x']}}"
    elif size == 1 and output.axis >= 0:
        expected = "the sensor tells one number: leave its axes out"
    if expected:
        raise _refused(output, expected)
    object_id = int(model.sensor_objid[index])
    if kind == _SENSOR.mjSENS_BALLANGVEL:
        return _dof(model, object_id, output.axis)
    if kind in _RATES:
        of = _RATES[kind]
        term = _OF_KIND[of](model, object_id, replace(output, kind=of))
        return term if of == "joint" else replace(term, place_entry=-1)
    if kind in _FRAME_SENSORS and model.sensor_refid[index] < 0:
        angular, frame = _FRAME_SENSORS[kind]
        on = _FRAME_KINDS.get(_OBJECT(model.sensor_objtype[index]))
        if on is not None:
            return _frame(model, object_id, replace(output, kind=on, angular=angular, frame=frame))
    return Term("sensordata", int(model.sensor_adr[index]) + max(output.axis, 0))


_OF_KIND: dict[str, Callable[[mujoco.MjModel, int, Output], Term]] = {
    "body": _frame, "site": _frame, "geom": _frame, "joint": _joint, "tendon": _rate,
    "actuator": _rate, "sensor": _sensor,
}  # fmt: skip


def _refused(output: Output, expected: str) -> InvalidInput:
    return InvalidInput("output", output.name, expected)


def _find(model: mujoco.MjModel, kind: str, name: str) -> int:
    return int(mujoco.mj_name2id(model, OBJECTS[kind], name))


def names_in(model: mujoco.MjModel, kind: str, prefix: str) -> list[str]:
    """The names of a robot's elements of one kind, without its prefix."""
    counts = {"body": "nbody", "joint": "njnt", "actuator": "nu"}
    count = getattr(model, counts.get(kind, f"n{kind}"))
    element: Any = getattr(model, kind)
    names = [element(index).name for index in range(count)]
    return [name.removeprefix(prefix) for name in names if name.startswith(prefix)]
