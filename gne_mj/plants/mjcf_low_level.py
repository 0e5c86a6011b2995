"""Low-level controllers of a fleet: where their numbers lie, and the kernel that runs them all.

What a controller reads, its input and its memory are put one behind the other, its C function is
called (:mod:`gne_mj.plants.low_level.functions`), and what it says becomes controls. In userdata,
the fleet's own part, stand for each of them

    [evaluations, for each control how often it was beyond its range, how often the controller gave
     less by limits of its own, what it keeps from the start]

and behind those of all of them the room that they share.
"""

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, named, nearest
from gne_mj.native import address_in, call_integer, kernel
from gne_mj.numbers import Numbers, names_of, numbers_in
from gne_mj.plants import mjcf_file
from gne_mj.plants.low_level.functions import address_of
from gne_mj.plants.low_level.robot import Robot
from gne_mj.plants.low_level.table import Controlled, Controller, Seen
from gne_mj.plants.mjcf_actuator import control_range, make_force
from gne_mj.plants.mjcf_output import Output
from gne_mj.plants.mjcf_reading import OBJECTS, READING, Term, names_in, terms_of, velocity_of
from gne_mj.plants.mjcf_robot import MjcfRobots
from gne_mj.plants.native_mujoco import USERDATA_HEADER, field

# Of each kind of thing its orientation in mjData, nine numbers, and other arrays by their strides
_ORIENTATION = {"body": "xmat", "site": "site_xmat", "geom": "geom_xmat"}
_STRIDES = {"orientation": 9, "xaxis": 3, "xanchor": 3, "subtree_com": 3, "site_xpos": 3}
# An actuator that the package adds for each entry of a memory, which integrates its control
_MEMORY = "gne_mj memory"
_WHOLE = 1 << 40  # length of views whose entries are known to be there


class ControllerPlace(Numbers):
    """Where a controller's numbers lie."""

    function: int  # its address
    channel: int  # the first entry of its input
    inputs: int
    reading: int  # its first in the table
    readings: int
    number: int  # its first, q and then the controls' ranges
    numbers: int  # of q
    memory: int  # its first entry of act
    moving: int  # how many
    held: int  # and of userdata, which do not move
    entry: int  # its first in the list of entries of ctrl
    controls: int
    own: int  # its first entry of userdata


PLACE = len(names_of(ControllerPlace))
_place_in = numbers_in(ControllerPlace)


class Controls(NamedTuple):
    """All that controllers are run with."""

    how_many: int
    twists: int  # words of cvel and subtree_com in mjData
    centres: int
    readings: Any  # the table of all readings
    places: Any  # of the controllers, then entries of ctrl
    numbers: Any
    room: int  # entry of userdata where the shared one begins


@kernel
def run_all(at, data, controls, u, on):
    """Make inputs u (m,) the controls of all controllers' actuators; zero if not ``on``."""
    for c in range(controls.how_many):
        place = _place_in(controls.places, c * PLACE)
        entries = controls.places[controls.how_many * PLACE + place.entry :]
        ctrl, said = field(data, at.ctrl, _WHOLE), place.controls + place.moving
        if not on:
            for k in range(said):
                ctrl[entries[k]] = 0.0
            continue
        userdata = field(data, at.userdata, _WHOLE)
        seen = userdata[controls.room :]
        read_all(data, controls, c, seen)
        _fill(at, data, place, u, seen)
        out = seen[place.readings + place.inputs + place.moving + place.held :]
        numbers = controls.numbers[place.number :]
        limited = call_integer(
            place.function,
            (
                address_in(numbers), place.numbers, address_in(seen), place.readings,
                place.inputs, place.moving, place.held, address_in(out), place.controls,
            ),
        )  # fmt: skip
        own, ranges = userdata[place.own :], numbers[place.numbers :]
        own[0] += 1.0
        for k in range(said):
            ctrl[entries[k]] = out[k]
        for k in range(place.controls):
            if out[k] < ranges[2 * k] or out[k] > ranges[2 * k + 1]:
                own[1 + k] += 1.0
        own[1 + place.controls] += limited


@kernel
def _fill(at, data, place, u, seen):
    """Put behind its readings what else a controller is given."""
    end = place.readings
    for k in range(place.inputs):
        seen[end + k] = u[place.channel + k]
    end += place.inputs
    act = field(data, at.act, _WHOLE)
    for k in range(place.moving):
        seen[end + k] = act[place.memory + k]
    end += place.moving
    userdata = field(data, at.userdata, _WHOLE)
    for k in range(place.held):
        seen[end + k] = userdata[place.own + 2 + place.controls + k]


@kernel
def read_all(data, controls, which, seen):
    """Fill seen with the readings of controller ``which``."""
    place, table = _place_in(controls.places, which * PLACE), controls.readings
    for k in range(place.readings):
        entry = (place.reading + k) * READING
        seen[k] = velocity_of(data, controls.twists, controls.centres, table, entry)


def add_memory(spec: Any, controller: Controller) -> None:
    """Give a robot's ``mujoco.MjSpec`` an activation for each entry of its memory that moves."""
    joint = spec.joints[0]
    joint.name = joint.name or _MEMORY
    for k in range(controller.moving):
        holder = spec.add_actuator(name=f"{_MEMORY} {k + 1}")
        holder.trntype, holder.target = mujoco.mjtTrn.mjTRN_JOINT, joint.name
        holder.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
        holder.gear, holder.gainprm = np.zeros(6), np.zeros(10)


def controllers_of(agents: MjcfRobots) -> dict[int, Controller]:
    """The controllers of those agents that have one, by their number from 0.

    Raises:
        InvalidInput: a file does not have what its controller needs; names ``agents.input``.
    """
    found: dict[int, Controller] = {}
    known: dict[tuple[Any, Any], Controller] = {}
    for i, robot in enumerate(agents.files):
        given = robot.input
        if not isinstance(given, Controlled):
            continue
        key = robot.path, given
        if key not in known:
            model = mjcf_file.alone(robot.path)
            data = mujoco.MjData(model)
            mujoco.mj_forward(model, data)
            with named(input="agents.input"):
                known[key] = given.table.bind(Robot(model, data, robot.path), given.axes)
        found[i] = known[key]
    return found


def own_entries(controllers: dict[int, Controller]) -> int:
    """Entries of userdata that a fleet's controllers need."""
    each = [2 + len(c.actuators) + c.held for c in controllers.values()]
    return sum(each) + room_of(controllers)


def room_of(controllers: dict[int, Controller]) -> int:
    """Entries of userdata that they share."""
    return max(
        (
            len(c.seen) + c.inputs + 2 * c.moving + c.held + len(c.actuators)
            for c in controllers.values()
        ),
        default=0,
    )


@dataclass(frozen=True, eq=False)
class FleetControls:
    """A fleet's controllers, as compiled code has them.

    Attributes:
        controllers: by agent, from 0.
        terms: all readings, those of one controller behind those of another.
        places: (controllers,) of :class:`ControllerPlace`, flat, then entries of ctrl.
        numbers: of each q, then the lowest and the greatest value of each control.
        room: entry of userdata where the shared one begins.
    """

    controllers: dict[int, Controller]
    terms: list[Term]
    places: NDArray[np.int64]
    numbers: NDArray[np.float64]
    room: int

    def place(self, which: int) -> Any:
        """The place of controller ``which``, in the order of their agents."""
        return _place_in(self.places, which * PLACE)

    def behind(self, readings: int, numbers: int) -> "FleetControls":
        """The same, where other readings and numbers come first."""
        places = self.places.copy()
        for c in range(len(self.controllers)):
            place = _place_in(places, c * PLACE)
            place.reading += readings
            place.number += numbers
        return replace(self, places=places)


def fleet_controls(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    agents: MjcfRobots,
    controllers: dict[int, Controller],
) -> FleetControls:
    """Find what controllers read and drive in a fleet's model; their actuators are made forces.

    Args:
        model: of the fleet; gains, biases and ranges of what is driven are changed.
        data: in the reference pose, positions evaluated.
        agents: which robots.
        controllers: see :func:`controllers_of`.

    Raises:
        InvalidInput: an actuator that is not there, is no force or is named twice; names ``input``.
    """
    terms: list[Term] = []
    rows: list[list[int]] = []
    entries: list[int] = []
    numbers: list[float] = []
    at = USERDATA_HEADER
    for i, controller in controllers.items():
        prefix, path = f"robot_{i + 1}/", agents.files[i].path
        if len(set(controller.actuators)) < len(controller.actuators):
            raise InvalidInput("input", list(controller.actuators), "name each actuator once")
        controls: list[int] = []
        ranges: list[float] = []
        for name in controller.actuators:
            index = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, prefix + name))
            if index < 0:
                known = [n for n in names_in(model, "actuator", prefix) if _MEMORY not in n]
                raise InvalidInput("input", name, nearest(name, known))
            if controller.raw:
                ranges += control_range(model, index)
            else:
                ranges += make_force(model, data, index, name, path, own_velocity=False)
            controls.append(int(model.actuator_ctrladr[index]))
        memory = [model.actuator(f"{prefix}{_MEMORY} {k + 1}") for k in range(controller.moving)]
        first = int(memory[0].actadr[0]) if memory else 0
        rows.append([
            address_of(controller.module), i * agents.dimension, agents.dimension, len(terms),
            len(controller.seen), len(numbers), len(controller.numbers), first,
            controller.moving, controller.held, len(entries), len(controls), at,
        ])  # fmt: skip
        terms += [term_of(model, prefix, seen) for seen in controller.seen]
        entries += [*controls, *(int(model.actuator_ctrladr[each.id]) for each in memory)]
        numbers += [*controller.numbers.tolist(), *ranges]
        at += 2 + len(controls) + controller.held
    places = np.array([*np.ravel(rows), *entries], dtype=np.int64)
    return FleetControls(controllers, terms, places, np.array(numbers), at)


def term_of(model: mujoco.MjModel, prefix: str, seen: Seen) -> Term:
    """Where a fleet's model has what a controller reads.

    Raises:
        InvalidInput: it is a sum, has no position, or is known at a step's start only.
    """
    if seen.value in _STRIDES and isinstance(seen.of, Output):
        kind, stride = seen.of.kind, _STRIDES[seen.value]
        array = _ORIENTATION[kind] if seen.value == "orientation" else seen.value
        index = int(mujoco.mj_name2id(model, OBJECTS[kind], prefix + seen.of.name))
        if index < 0:
            near = nearest(seen.of.name, names_in(model, kind, prefix))
            raise InvalidInput("input.readings", seen.of.name, f"no such {kind}; {near}")
        return Term(array, stride * index + seen.component)
    with named(output="input.readings"):
        terms = terms_of(model, prefix, seen.of)
    (term,) = terms[:1]
    expected = ""
    if len(terms) > 1 or term.factor != 1.0:
        expected = "a controller reads one thing: name each by itself"
    elif seen.value == "position":
        if term.place_entry < 0:
            expected = "it has no position"
        term = Term(term.place, term.place_entry)
    if not expected and not term.fresh:
        expected = "this sensor is known a step late: name what it measures"
    if expected:
        raise InvalidInput("input.readings", str(seen.of), expected)
    return term


def begin(data: mujoco.MjData, fleet: FleetControls, read: Any) -> None:
    """Let all controllers begin at what they read now: nothing counted, memories as at a start.

    Args:
        data: of the fleet, in its start.
        fleet: its controllers.
        read: fills (readings,) of a controller, by its number.
    """
    for c, controller in enumerate(fleet.controllers.values()):
        place, length = fleet.place(c), controller.moving + controller.held
        data.userdata[place.own : place.own + 2 + place.controls] = 0.0
        if not length:
            continue
        seen, memory = np.zeros(len(controller.seen)), np.zeros(length)
        read(c, seen)
        start = controller.start or getattr(controller.module, "start", None)
        if start is not None:
            start(controller.numbers, seen, memory)
        data.act[place.memory : place.memory + place.moving] = memory[: controller.moving]
        held = place.own + 2 + place.controls
        data.userdata[held : held + controller.held] = memory[controller.moving :]


def limits_met(data: mujoco.MjData, fleet: FleetControls) -> dict[int, dict[str, float]]:
    """For each agent with a controller which limits it met, and in what part of evaluations."""
    found: dict[int, dict[str, float]] = {}
    for c, (agent, controller) in enumerate(fleet.controllers.items()):
        own = data.userdata[fleet.place(c).own :]
        counts = own[1 : 2 + len(controller.actuators)] / max(own[0], 1.0)
        names = (*controller.actuators, "controller")
        found[agent] = {
            name: float(part) for name, part in zip(names, counts, strict=True) if part > 0
        }
    return found
