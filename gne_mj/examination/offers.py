"""What an MJCF file offers as outputs and inputs."""

from dataclasses import dataclass

import mujoco

from gne_mj.plants.mjcf_actuator import no_force

_JOINTS = ("free joint", "ball joint", "slide joint", "hinge joint")
_UNITS = ("m/s, rad/s", "rad/s", "m/s", "rad/s")
_TRN = mujoco.mjtTrn
_SENSORS = {
    mujoco.mjtSensor.mjSENS_JOINTVEL: "jointvel", mujoco.mjtSensor.mjSENS_TENDONVEL: "tendonvel",
    mujoco.mjtSensor.mjSENS_ACTUATORVEL: "actuatorvel",
    mujoco.mjtSensor.mjSENS_BALLANGVEL: "ballangvel",
    mujoco.mjtSensor.mjSENS_VELOCIMETER: "velocimeter", mujoco.mjtSensor.mjSENS_GYRO: "gyro",
    mujoco.mjtSensor.mjSENS_FRAMELINVEL: "framelinvel",
    mujoco.mjtSensor.mjSENS_FRAMEANGVEL: "frameangvel",
    mujoco.mjtSensor.mjSENS_SUBTREELINVEL: "subtreelinvel",
}  # fmt: skip


@dataclass(frozen=True)
class Offer:
    """One thing of a file.

    Args:
        kind: "joint", "body", "tendon", "sensor", "actuator" or "keyframe".
        name: its own; empty where it has none, and so cannot be named.
        about: what it is, or does, in words.
        usable: whether a scenario can name it.
        on: of an actuator the kind and name of what it drives.
    """

    kind: str
    name: str
    about: str
    usable: bool
    on: tuple[str, str] = ("", "")


def offers(model: mujoco.MjModel) -> list[Offer]:
    """All of them, kind by kind."""
    return [*_joints(model), *_bodies(model), *_tendons(model), *_sensors(model),
            *_actuators(model)]  # fmt: skip


def keyframes(model: mujoco.MjModel) -> list[Offer]:
    """Those of a model that has them, as starts."""
    names = [model.key(k).name for k in range(model.nkey)]
    return [Offer("keyframe", name, "a pose to begin in", bool(name)) for name in names]


def _joints(model: mujoco.MjModel) -> list[Offer]:
    found = []
    for j in range(model.njnt):
        kind, name = int(model.jnt_type[j]), model.joint(j).name
        about = f"{_JOINTS[kind]} of '{model.body(model.jnt_bodyid[j]).name}', {_UNITS[kind]}"
        if model.jnt_limited[j]:
            low, high = model.jnt_range[j]
            about += f", from {low:.4g} to {high:.4g}"
        found.append(Offer("joint", name, about, bool(name)))
    return found


def _bodies(model: mujoco.MjModel) -> list[Offer]:
    """Those that a free joint moves: others are reached by their joints."""
    found = []
    for body in range(1, model.nbody):
        joint = int(model.body_jntadr[body])
        if joint >= 0 and model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_FREE:
            name = model.body(body).name
            about = f"floats, {model.body_subtreemass[body]:.4g} kg with all that hangs on it"
            found.append(Offer("body", name, about, bool(name)))
    return found


def _tendons(model: mujoco.MjModel) -> list[Offer]:
    names = [model.tendon(t).name for t in range(model.ntendon)]
    return [Offer("tendon", name, "rate of its length", bool(name)) for name in names]


def _sensors(model: mujoco.MjModel) -> list[Offer]:
    found = []
    for s in range(model.nsensor):
        kind, name = _SENSORS.get(mujoco.mjtSensor(model.sensor_type[s])), model.sensor(s).name
        if kind is not None:
            size = int(model.sensor_dim[s])
            found.append(Offer("sensor", name, f"{kind}, {size} number{'s' * (size > 1)}",
                               bool(name)))  # fmt: skip
    return found


def _actuators(model: mujoco.MjModel) -> list[Offer]:
    found = []
    for a in range(model.nu):
        name, on = model.actuator(a).name, _driven(model, a)
        wrong = no_force(model, a)
        about = f"{wrong or 'a force'} at {on[0]} '{on[1]}'"
        if model.actuator_ctrllimited[a]:
            low, high = model.actuator_ctrlrange[a]
            about += f", control from {low:.4g} to {high:.4g}"
        if model.actuator_forcelimited[a]:
            low, high = model.actuator_forcerange[a]
            about += f", force from {low:.4g} to {high:.4g}"
        found.append(Offer("actuator", name, about, bool(name) and not wrong, on))
    return found


def _driven(model: mujoco.MjModel, actuator: int) -> tuple[str, str]:
    kind, at = _TRN(model.actuator_trntype[actuator]), int(model.actuator_trnid[actuator, 0])
    if kind in (_TRN.mjTRN_JOINT, _TRN.mjTRN_JOINTINPARENT):
        return "joint", model.joint(at).name
    if kind == _TRN.mjTRN_TENDON:
        return "tendon", model.tendon(at).name
    if kind == _TRN.mjTRN_SITE:
        return "site", model.site(at).name
    return ("body", model.body(at).name) if kind == _TRN.mjTRN_BODY else ("", "")
