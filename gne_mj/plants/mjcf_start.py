"""How a fleet of users' robots starts: in a pose of its files, settled or not, at given outputs.

Where everything is comes first: the files' own pose or one of their keyframes, joints whose
positions are given, and with a look-ahead Newton's method, each step the smallest that does. Robots
may then settle under inputs of zero, which is what holds them, low-level controllers included. At
last joint velocities give the outputs: of all those that do, the ones that slide contacts the
least, and of these the smallest.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, named
from gne_mj.plants import mjcf_file
from gne_mj.plants.callbacks import quiet
from gne_mj.plants.mjcf_contacts import check_apart
from gne_mj.plants.mjcf_low_level import begin

if TYPE_CHECKING:
    from gne_mj.plants.mjcf_contacts import Part
    from gne_mj.plants.mjcf_fleet import MjcfPlant
    from gne_mj.plants.mjcf_pose import Pose
    from gne_mj.plants.mjcf_robot import MjcfRobots

Array = NDArray[np.float64]

NEWTON = 20  # steps to a start's positions
AGAIN = 5  # times to settle where positions are given, until they stay
STAYS = 1e-3  # m or rad that settled outputs may be off them
RESTS = 1e-2  # m/s or rad/s of any joint that count as rest
_KEPT = int(
    mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_ACT | mujoco.mjtState.mjSTATE_CTRL
)
# What to do where robots overlap
_BESIDE = (
    ", {:g} m beside it: give more spacing, make its file narrower, or its floor a plane, which all"
    " share"
)
_POSED = ": let their poses lie farther apart, or make its floor a plane, which all share"
_TOGETHER = ": let their positions begin farther apart, or make its floor a plane, which all share"


class Reference(NamedTuple):
    """Where a fleet is before anything is given of its start, as mjData has it."""

    qpos: Array
    qvel: Array
    act: Array
    ctrl: Array


def reference(model: mujoco.MjModel, agents: MjcfRobots, parts: list[Part]) -> Reference:
    """The pose of the robots' files, or of those of their keyframes that are named.

    Args:
        model: of the fleet.
        agents: which robots; their places turn and shift free joints.
        parts: of each robot, one behind the other.

    Raises:
        InvalidInput: a keyframe that a file does not have; names ``agents.keyframe``.
    """
    found = Reference(
        model.qpos0.copy(), np.zeros(model.nv), np.zeros(model.na), np.zeros(model.nu)
    )
    if not any(agents.keyframes):
        return found
    known: dict[Path, mujoco.MjModel] = {}
    q = v = actuator = 0
    for robot, name, place, part in zip(
        agents.files, agents.keyframes, agents.places, parts, strict=True
    ):
        if robot.path not in known:
            known[robot.path] = mjcf_file.with_keyframes(robot.path)
        alone = known[robot.path]
        if name is not None:
            key = mjcf_file.keyframe(alone, robot.path, name)
            qpos, qvel = np.array(key.qpos), np.array(key.qvel)
            for joint in np.flatnonzero(alone.jnt_type == mujoco.mjtJoint.mjJNT_FREE):
                _turn(qpos[alone.jnt_qposadr[joint] :], qvel[alone.jnt_dofadr[joint] :], place)
            found.qpos[q : q + alone.nq], found.qvel[v : v + alone.nv] = qpos, qvel
            own = slice(actuator, actuator + part.actuators)
            for to, at, numbers in (
                (found.ctrl, model.actuator_ctrladr[own], key.ctrl),
                (found.act, model.actuator_actadr[own], key.act),
            ):
                if len(numbers):
                    first = min(at[at >= 0])
                    to[first : first + len(numbers)] = numbers
        q, v, actuator = q + alone.nq, v + alone.nv, actuator + part.actuators
    return found


def _turn(qpos: Array, qvel: Array, place: Pose) -> None:
    """Bring a free joint's numbers from its file's world to the fleet's, in place."""
    quaternion = np.array(place.quaternion)
    point, turn, velocity = np.empty(3), np.empty(4), np.empty(3)
    mujoco.mju_rotVecQuat(point, qpos[:3], quaternion)
    mujoco.mju_mulQuat(turn, quaternion, qpos[3:7])
    mujoco.mju_rotVecQuat(velocity, qvel[:3], quaternion)
    qpos[:3], qpos[3:7], qvel[:3] = place.position + point, turn, velocity


def reset(plant: MjcfPlant, state: Array) -> None:
    """Let a fleet start in (m, 2): outputs and positions.

    Raises:
        InvalidInput: nothing near its pose has these; robots overlap, or do not settle there.
    """
    model, data, agents = plant.model, plant.data, plant.agents
    _stand(plant, state[:, 1])
    moves = plant.reference.qvel
    if agents.settle:
        mujoco.mj_setState(model, data, settled(plant, state[:, 1]), _KEPT)
        moves = np.zeros(model.nv)
    still, slopes = plant.state[:, 0], _slopes(plant)
    data.qvel[:] = moves + _velocities(plant, slopes, state[:, 0] - still - slopes @ moves)
    with quiet():
        mujoco.mj_forward(model, data)
    _check_apart(plant)
    missed = np.abs(plant.state[:, 0] - state[:, 0])
    if np.max(missed) > 1e-9 * max(1.0, float(np.max(np.abs(state[:, 0])))):
        raise InvalidInput(
            "agents.output",
            str(agents.robots[int(np.argmax(missed))].output),
            "in the file's reference pose no joint velocities give it its initial value",
        )
    _begin(plant, bool(agents.settle))


def standing(plant: MjcfPlant) -> Array:
    """(m, 2) the state in which a keyframe or settling leaves a fleet of which nothing is given.

    Raises:
        InvalidInput: robots overlap, or do not settle.
    """
    _stand(plant, None)
    plant.data.qvel[:] = plant.reference.qvel
    if plant.agents.settle:
        mujoco.mj_setState(plant.model, plant.data, settled(plant, None), _KEPT)
        plant.data.qvel[:] = 0.0
    return plant.state


def _stand(plant: MjcfPlant, positions: Array | None) -> None:
    """Put a fleet at rest into its reference pose, at positions (m,) if there are any."""
    model, data, at = plant.model, plant.data, plant.reference
    mujoco.mj_resetData(model, data)
    data.qpos[:], data.act[: len(at.act)], data.ctrl[:] = at.qpos, at.act, at.ctrl
    if positions is not None:
        _put(plant, positions)


def _put(plant: MjcfPlant, positions: Array) -> None:
    """Move outputs to positions (m,), of velocities those of joints but free ones."""
    for dof, at, position in zip(
        plant.places.output, plant.places.position, positions, strict=True
    ):
        if at >= 0 and (plant.passive is not None or not _floats(plant.model, dof)):
            plant.data.qpos[at] = position
    if plant.passive is not None and np.any(plant.places.output < 0):
        _move_to(plant, positions)


def settled(plant: MjcfPlant, positions: Array | None) -> Array:
    """What of mjData a fleet has after it has settled, near positions (m,) if there are any.

    It is kept: settling takes as many steps as a run of that time. Inputs are zero meanwhile.

    Raises:
        InvalidInput: it moves on, or comes to rest elsewhere; names ``agents.settle``.
    """
    key = plant.timestep, None if positions is None else positions.tobytes()
    if key not in plant.settled:
        _settle_near(plant, positions)
        found = np.empty(mujoco.mj_stateSize(plant.model, _KEPT))
        mujoco.mj_getState(plant.model, plant.data, found, _KEPT)
        plant.settled[key] = found
    return plant.settled[key]


def _settle_near(plant: MjcfPlant, positions: Array | None) -> None:
    """Settle, with a look-ahead again and again until outputs stay where they are wanted."""
    _stand(plant, positions)
    if positions is None:
        _settle(plant, False)
        return
    for again in range(AGAIN):
        _settle(plant, again > 0)
        rests = plant.state[:, 1]
        _put(plant, positions)
        off = np.abs(rests - positions)
        if plant.passive is None or np.max(off) <= STAYS:
            return
    worst = int(np.argmax(off))
    raise InvalidInput(
        "agents.settle", plant.agents.settle,
        f"agent {worst // plant.agents.dimension + 1} comes to rest at {rests[worst]:.6g} and not"
        f" at {positions[worst]:.6g}: start it there, or leave initial.action and position out to"
        " start all where they rest",
    )  # fmt: skip


def _settle(plant: MjcfPlant, again: bool) -> None:
    """Let a fleet move from where it is, at rest, under inputs of zero; it must come to rest."""
    model, data, seconds = plant.model, plant.data, plant.agents.settle
    with quiet():
        mujoco.mj_forward(model, data)
    _check_apart(plant)
    _begin(plant, again)
    plant.step(np.zeros(plant.agents.channels), max(1, round(seconds / plant.timestep)))
    speed = np.where(np.isfinite(data.qvel), np.abs(data.qvel), np.inf)
    worst = int(np.argmax(speed))
    if speed[worst] > RESTS:
        body = model.body(model.dof_bodyid[worst]).name.partition("/")
        agent = body[0].removeprefix("robot_")
        raise InvalidInput(
            "agents.settle", seconds,
            f"agent {agent} must come to rest under inputs of zero, and then its body"
            f" '{body[2]}' still moves at {speed[worst]:.3g}: give it longer, another start, or a"
            " controller that holds it",
        )  # fmt: skip
    data.qvel[:], data.time = 0.0, 0.0


def _check_apart(plant: MjcfPlant) -> None:
    agents, advice = plant.agents, _BESIDE.format(plant.agents.spacing)
    if agents.together or agents.poses:
        advice = _TOGETHER if agents.together else _POSED
    with named(robots="agents.path"):
        check_apart(plant.model, plant.data, plant.owners, agents.files, advice)


def _begin(plant: MjcfPlant, moving: bool) -> None:
    """Let low-level controllers begin here, but for ``moving`` memories that have settled."""
    memory = plant.data.act.copy()
    begin(plant.data, plant.low_level, plant.read)
    if moving:
        plant.data.act[:] = memory


def _velocities(plant: MjcfPlant, slopes: Array, wanted: Array) -> Array:
    """(nv,) joint velocities that change outputs by ``wanted`` (m,) and slide contacts least."""
    found = np.asarray(np.linalg.lstsq(slopes, wanted, rcond=None)[0], dtype=np.float64)
    held = _held(plant) if np.any(wanted) else np.empty((0, len(found)))
    if not len(held):
        return found
    _, sizes, rows = np.linalg.svd(slopes)
    free = rows[np.count_nonzero(sizes > 1e-12 * np.max(sizes, initial=0.0)) :].T
    slides = np.linalg.lstsq(held @ free, -held @ found, rcond=1e-9)[0]
    return np.asarray(found + free @ slides)


def _held(plant: MjcfPlant) -> Array:
    """(rows, nv) how contact points and equalities move with joint velocities."""
    model, data = plant.model, plant.data
    with quiet():
        mujoco.mj_fwdPosition(model, data)
    rows = []
    for contact in data.contact[: data.ncon]:
        if contact.efc_address < 0 or min(contact.geom) < 0:
            continue
        first, second = np.empty((3, model.nv)), np.empty((3, model.nv))
        for jacobian, geom in zip((first, second), contact.geom, strict=True):
            body = model.geom_bodyid[geom]
            mujoco.mj_jac(model, data, jacobian, None, contact.pos, body)
        directions = 3 if contact.dim > 1 else 1
        rows.append((contact.frame.reshape(3, 3) @ (second - first))[:directions])
    if data.ne:
        whole = np.eye(data.nefc)[data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY]
        for each in whole:
            row = np.empty(model.nv)
            mujoco.mj_mulJacTVec(model, data, row, each)
            rows.append(row[None])
    return np.concatenate(rows) if rows else np.empty((0, model.nv))


def _slopes(plant: MjcfPlant) -> Array:
    """(m, nv) how outputs change with joint velocities, all of which are zero at the end."""
    model, data = plant.model, plant.data
    slopes, still = np.empty((plant.agents.channels, model.nv)), plant.state[:, 0]
    for column in range(model.nv):
        data.qvel[:] = 0.0
        data.qvel[column] = 1.0
        slopes[:, column] = plant.state[:, 0] - still
    data.qvel[:] = 0.0
    return slopes


def output_moves(plant: MjcfPlant) -> Array:
    """(m, nv) how the velocities that outputs are made of change with joint velocities.

    Joint velocities are zero at the end.
    """
    plant.data.qvel[:] = 0.0
    found = _slopes(plant)
    if plant.passive is not None:  # y = q + tau (v - v_0)
        found /= plant.agents.parameters[:, :1]
    return found


def _move_to(plant: MjcfPlant, positions: Array) -> None:
    """Move to these positions (m,) by Newton's method, each step the smallest that does.

    Raises:
        InvalidInput: it does not find them.
    """
    agents, size = plant.agents, max(1.0, float(np.max(np.abs(positions))))
    missed = positions - plant.state[:, 1]
    for _ in range(NEWTON):
        if np.max(np.abs(missed)) <= 1e-12 * size:
            return
        move = np.linalg.lstsq(output_moves(plant), missed, rcond=None)[0]
        mujoco.mj_integratePos(plant.model, plant.data.qpos, move, 1.0)
        missed = positions - plant.state[:, 1]
    if np.max(np.abs(missed)) > 1e-9 * size:
        raise InvalidInput(
            "agents.output",
            str(agents.robots[int(np.argmax(np.abs(missed)))].output),
            "near the file's reference pose no joint positions give it its initial position",
        )


def _floats(model: mujoco.MjModel, dof: int) -> bool:
    """Whether a degree of freedom is of a free joint, which stays where its file put it."""
    return bool(model.jnt_type[model.dof_jntid[dof]] == mujoco.mjtJoint.mjJNT_FREE)
