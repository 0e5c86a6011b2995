"""What besides its inputs acts on a fleet in MuJoCo, and the inputs that hold it against that.

A force f of MuJoCo's (gravity, springs, damping, fluid, dry friction) is measured by what it does
to the outputs: they are looked at after some steps with f taken off, and without. Divided by how
far inputs move them meanwhile that is the input that balances f, what is in between included.

An agent with a low-level controller asks for a force at its output, which comes later than f: there
it is how far such a force itself moves the output. A weight that the controller holds without being
asked is no load.
"""

import mujoco
import numpy as np
from numpy.typing import NDArray

from gne_mj.plants.callbacks import quiet
from gne_mj.plants.fleet_plant import FleetPlant

Array = NDArray[np.float64]
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
_DRY = (
    int(mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF),
    int(mujoco.mjtConstraint.mjCNSTR_FRICTION_TENDON),
)
_STOP = int(mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT)
SHARE = 0.01  # of the greatest: what is less is not told
REST = "contacts and the rest"


def saved(plant: FleetPlant) -> Array:
    """All that a fleet starts from, for :func:`restore`."""
    state = np.empty(mujoco.mj_stateSize(plant.model, _STATE))
    mujoco.mj_getState(plant.model, plant.data, state, _STATE)
    return state


def restore(plant: FleetPlant, state: Array) -> None:
    """Let it be as it was when that was saved."""
    mujoco.mj_setState(plant.model, plant.data, state, _STATE)


def response(
    plant: FleetPlant, state: Array, u: Array, steps: int, force: Array | float = 0.0
) -> Array:
    """Outputs (m,) so many steps after a state, under inputs u (m,) and a force (nv,) held."""
    restore(plant, state)
    plant.data.qfrc_applied[:] += force
    plant.step(u, steps)
    return plant.output


def slopes(
    plant: FleetPlant, state: Array, u: Array, change: Array, steps: int,
    moves: Array | None = None,
) -> Array:  # fmt: skip
    """(N, d, d) how each agent's outputs have risen so many steps later with its inputs.

    By differences of ``change`` (m,) to either side of u; other agents' inputs change meanwhile, so
    that those are to be apart. With ``moves`` (m, nv), how outputs' velocities are made of joint
    velocities, it is with forces at the outputs in place of inputs.
    """
    d = plant.agents.dimension
    found = np.empty((plant.agents.count, d, d))
    for axis in range(d):
        part = np.where(np.arange(len(u)) % d == axis, change, 0.0)
        up, down = (
            response(plant, state, u + sign * part, steps)
            if moves is None
            else response(plant, state, u, steps, sign * part @ moves)
            for sign in (1.0, -1.0)
        )
        found[:, :, axis] = ((up - down).reshape(-1, d)) / (2.0 * change[axis::d, None])
    return found


def forces(plant: FleetPlant) -> dict[str, Array]:
    """(nv,) each, as MuJoCo has them at the present state, by what they are."""
    model, data = plant.model, plant.data
    with quiet():
        mujoco.mj_forward(model, data)
    weight = np.array(data.qfrc_gravcomp)
    if not model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY:
        for body in range(1, model.nbody):
            pull = model.body_mass[body] * model.opt.gravity
            mujoco.mj_applyFT(model, data, pull, np.zeros(3), data.xipos[body], body, weight)
    dry = np.zeros(model.nv)
    if data.nefc:
        rubs = np.where(np.isin(data.efc_type, _DRY), data.efc_force, 0.0)
        mujoco.mj_mulJacTVec(model, data, dry, rubs)
    return {
        "gravity": weight, "springs": np.array(data.qfrc_spring),
        "damping": np.array(data.qfrc_damper), "fluid": np.array(data.qfrc_fluid),
        "dry friction": dry,
    }  # fmt: skip


def joints_at_stops(plant: FleetPlant) -> list[str]:
    """The names of the joints that their stops push at the present state, forces evaluated."""
    model, data = plant.model, plant.data
    if not data.nefc:
        return []
    pushed = (data.efc_type == _STOP) & (data.efc_force > 0.0)
    return [model.joint(int(j)).name for j in dict.fromkeys(data.efc_id[pushed].tolist())]


def holding(plant: FleetPlant, u: Array, steps: int) -> dict[str, Array]:
    """The inputs (m,) that balance each of :func:`forces` at the present state.

    Args:
        plant: it is left elsewhere.
        u: (m,) the inputs meanwhile, about which is looked.
        steps: how many; the fewer, the less the forces change meanwhile.
    """
    state, acting = saved(plant), forces(plant)
    change = 1e-3 * np.maximum(np.abs(u), 1.0)
    rise = slopes(plant, state, u, change, steps)
    controlled = list(plant.holds_weight)
    if controlled:
        restore(plant, state)
        pushed = slopes(plant, state, u, change, steps, plant.output_moves)
        rise[controlled] = pushed[controlled]
    still, found = response(plant, state, u, steps), {}
    for name, force in acting.items():
        moved = response(plant, state, u, steps, -force) - still
        found[name] = np.linalg.pinv(rise) @ moved.reshape(len(rise), -1, 1)
    found["gravity"][[i for i, held in plant.holds_weight.items() if held]] = 0.0
    return {name: value.ravel() for name, value in found.items()}


def balance(plant: FleetPlant, u: Array, steps: int) -> dict[str, Array]:
    """The same as :func:`holding`, with what is left of u beside them."""
    found = holding(plant, u, steps)
    return {**found, REST: u - np.sum(list(found.values()), axis=0)}


def told(parts: dict[str, float], unit: str = "") -> str:
    """An input by what it balances, the greatest first, in words.

    Empty where there is nothing to say: no load, or parts that contacts balance between them.
    """
    whole = max((abs(value) for value in parts.values()), default=0.0)
    if abs(sum(parts.values())) <= SHARE * whole:
        return ""
    return ", ".join(
        f"{value:.3g}{f' {unit}' if unit else ''} {name}"
        for name, value in sorted(parts.items(), key=lambda item: -abs(item[1]))
        if abs(value) > SHARE * whole
    )
