"""What an actuator of a user's robot does with its control, and how it is made a force.

MuJoCo's actuator gives the force gain * a + bias, with a the control or an activation that follows
it, and gear times that to the joint. A law gives forces: where the gain is a number, there is no
bias and the activation at most a filter, dividing by gain and gear makes the control the force.
A servo has a bias that is affine in its length and velocity; the control (f - bias)/gain makes it
give the force f. MuJoCo's stages would add the bias again, so that both are left out: that holds
while nothing clamps the control. All else would turn the law's force into one of another kind.
"""

from pathlib import Path

import mujoco
import numpy as np

from gne_mj.errors import InvalidInput

_GAIN, _BIAS, _DYN, _TRN = mujoco.mjtGain, mujoco.mjtBias, mujoco.mjtDyn, mujoco.mjtTrn
_FILTERS = (_DYN.mjDYN_NONE, _DYN.mjDYN_FILTER, _DYN.mjDYN_FILTEREXACT)
_ALONG = (_TRN.mjTRN_JOINT, _TRN.mjTRN_JOINTINPARENT, _TRN.mjTRN_TENDON)  # with a gear of one entry
_GAINS = {
    _GAIN.mjGAIN_AFFINE: "its gain depends on its length or velocity, as a damper's does",
    _GAIN.mjGAIN_MUSCLE: "it is a muscle",
    _GAIN.mjGAIN_DCMOTOR: "it is a DC motor, driven by a voltage",
    _GAIN.mjGAIN_SO3: "it is a servo of an orientation",
    _GAIN.mjGAIN_PID: "it is a PID servo",
}
_OR_SERVO = ", or input = {{ controller = 'servo', actuators = ['{}'] }}"
_TRANSMISSIONS = {
    _TRN.mjTRN_SLIDERCRANK: "a slider-crank, whose lever changes",
    _TRN.mjTRN_BODY: "adhesion of a body",
}


def no_force(model: mujoco.MjModel, actuator: int) -> str:
    """What an actuator is that gives no force in proportion to its control; empty if it does."""
    gain, bias, dyn, trn = (
        kind(getattr(model, f"actuator_{name}type")[actuator])
        for kind, name in ((_GAIN, "gain"), (_BIAS, "bias"), (_DYN, "dyn"), (_TRN, "trn"))
    )
    constant, stiffness, damping = model.actuator_biasprm[actuator, :3]
    varies = gain == _GAIN.mjGAIN_AFFINE and np.any(model.actuator_gainprm[actuator, 1:3])
    if model.actuator_plugin[actuator] >= 0:
        return "it is a plug-in's"
    if trn in _TRANSMISSIONS or trn not in (*_ALONG, _TRN.mjTRN_SITE):
        return f"it acts by {_TRANSMISSIONS.get(trn, 'a transmission of its own')}"
    if varies or gain not in (_GAIN.mjGAIN_FIXED, _GAIN.mjGAIN_AFFINE):
        return _GAINS.get(gain, "its gain is user code's")
    if bias not in (_BIAS.mjBIAS_NONE, _BIAS.mjBIAS_AFFINE):
        return "its bias force is no number"
    if is_servo(model, actuator) and not _clamps(model, actuator):
        return ""
    if bias == _BIAS.mjBIAS_AFFINE and (constant or stiffness or damping):
        if is_servo(model, actuator):
            what = "position" if stiffness else "velocity" if damping else "biased"
            return f"the ctrlrange of a {what} servo would clamp by where it is and how it moves"
        if stiffness:
            integrates = dyn == _DYN.mjDYN_INTEGRATOR
            what = "an integrated-velocity servo" if integrates else "a position servo"
            return f"it is {what} of stiffness {-stiffness:g}"
        return f"it is a velocity servo of gain {-damping:g}" if damping else "it has a bias force"
    if dyn == _DYN.mjDYN_INTEGRATOR:
        return "its control is the rate of its force"
    return "" if dyn in _FILTERS else "its activation has dynamics of its own"


def is_servo(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether a bias in proportion to length or velocity stands beside a control without lag."""
    bias = np.any(model.actuator_biasprm[actuator, :3])
    at_once = model.actuator_dyntype[actuator] == _DYN.mjDYN_NONE
    late = model.actuator_delay[actuator] > 0
    affine = model.actuator_biastype[actuator] == _BIAS.mjBIAS_AFFINE
    return bool(affine and bias and at_once and not late)


def _clamps(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether its control is clamped."""
    ignored = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL
    return bool(model.actuator_ctrllimited[model.actuator_ctrladr[actuator]] and not ignored)


def control_range(model: mujoco.MjModel, actuator: int) -> tuple[float, float]:
    """The least and greatest control that pass unchanged."""
    if not _clamps(model, actuator):
        return -np.inf, np.inf
    low, high = model.actuator_ctrlrange[model.actuator_ctrladr[actuator]]
    return float(low), float(high)


def make_force(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    actuator: int,
    name: str,
    path: Path,
    *,
    own_velocity: bool,
) -> tuple[float, float]:
    """Make an actuator's control the force at what it drives; returns the range that it delivers.

    Args:
        model: of the fleet; the actuator's gain and ranges are changed.
        data: in the reference pose, positions evaluated.
        actuator: its number.
        name, path: its own and its file's, for messages.
        own_velocity: whether the output is the actuator's own velocity, gear included, so that the
            force that goes with it is the one before the gear.

    Returns:
        The least and the greatest in N (N m), infinite if nothing clamps it.

    Raises:
        InvalidInput: it gives no force in proportion to its control, or none at all.
    """
    gain = float(model.actuator_gainprm[actuator, 0])
    trn, out = _TRN(model.actuator_trntype[actuator]), model.actuator_outadr[actuator]
    geared = trn in _ALONG and model.actuator_outnum[actuator] == 1
    gear = float(model.actuator_gear[out, 0]) if geared and not own_velocity else 1.0
    what = no_force(model, actuator)
    if not what and gain * gear == 0.0:
        what = "its gain or gear is 0"
    if not what and _is_disabled(model, actuator):
        what = "the file's options disable it"
    if what:
        raise InvalidInput(
            "input",
            name,
            f"in {path.name} {what}, where a law needs a force: make it a <motor>, or name"
            f" another actuator{_OR_SERVO.format(name) if is_servo(model, actuator) else ''}",
        )
    if is_servo(model, actuator):
        model.actuator_biastype[actuator] = _BIAS.mjBIAS_NONE
        model.actuator_biasprm[actuator] = 0.0
    scale, ctrl = gain * gear, model.actuator_ctrladr[actuator]
    if scale != 1.0:
        model.actuator_gainprm[actuator, 0] = 1.0 / gear
        for ranges, row in ((model.actuator_ctrlrange, ctrl), (model.actuator_actrange, actuator)):
            ranges[row] = np.sort(scale * ranges[row])
    return _range(model, data, actuator, gear)


def _is_disabled(model: mujoco.MjModel, actuator: int) -> bool:
    group = int(model.actuator_group[actuator])
    by_group = 0 <= group <= 30 and model.opt.disableactuator >> group & 1
    by_flag = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_ACTUATION
    return bool(by_group or by_flag)


def _range(
    model: mujoco.MjModel, data: mujoco.MjData, actuator: int, gear: float
) -> tuple[float, float]:
    """The least and greatest u that pass unchanged, u = gear times the actuator's force."""
    ranges = []
    ctrl, along = model.actuator_ctrladr[actuator], model.actuator_trnid[actuator, 0]
    if _clamps(model, actuator):
        ranges.append(model.actuator_ctrlrange[ctrl])
    if model.actuator_actlimited[actuator]:
        ranges.append(model.actuator_actrange[actuator])
    if model.actuator_forcelimited[actuator]:
        ranges.append(gear * model.actuator_forcerange[actuator])
    tendon = _TRN(model.actuator_trntype[actuator]) == _TRN.mjTRN_TENDON
    if tendon and model.tendon_actfrclimited[along]:
        ranges.append(gear * model.tendon_actfrcrange[along])
    row = model.actuator_outadr[actuator]
    first, count = data.moment_rowadr[row], data.moment_rownnz[row]
    for entry in range(first, first + count):
        joint, lever = model.dof_jntid[data.moment_colind[entry]], data.actuator_moment[entry]
        if model.jnt_actfrclimited[joint] and lever:
            ranges.append(gear / lever * model.jnt_actfrcrange[joint])
    rows = np.sort(np.array([[-np.inf, np.inf], *ranges]), axis=1)
    return float(np.max(rows[:, 0])), float(np.min(rows[:, 1]))
