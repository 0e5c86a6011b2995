"""What is looked at before each run of a user's robots: some dozen steps, for what would go wrong.

Whether a small difference grows from step to step, as it does beyond the longest stable step;
whether outputs rise with their inputs over a control period; and what it takes to stay at the
start, beside the limits. `gne-mj examine` looks closer.
"""

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import EngineError
from gne_mj.plants import acting_forces
from gne_mj.plants.fleet_plant import FleetPlant

Array = NDArray[np.float64]
SETTLING, LOOKED = 20, 40  # steps that a difference is left to turn, and over which it is measured
GROWS = 1.1  # times in a step: what falls over by itself grows by less
NUDGE = 1e-7
CHANGE = 1e-3  # of an input, of its limit or of 1


def doubts(plant: FleetPlant, limits: Array, steps: int) -> list[str]:
    """What is wrong, a sentence each; mostly none.

    Args:
        plant: the fleet at its start; it stays there.
        limits: (m,) of inputs.
        steps: of a control period.
    """
    fleet = plant.twin()
    state = acting_forces.saved(plant)
    try:
        acting_forces.restore(fleet, state)
        # beyond a stable step nothing else that is seen means anything
        return _step(fleet, state) or _inputs(fleet, state, limits, steps)
    except EngineError:
        return []  # the run itself will tell


def _step(fleet: FleetPlant, state: Array) -> list[str]:
    grown = growth(fleet, state)
    if grown <= GROWS:
        return []
    return [
        f"a small difference grows {grown:.3g} times in a step of {1e3 * fleet.timestep:g} ms with"
        f" {fleet.integrator}: that is beyond the longest stable step"
    ]


def growth(fleet: FleetPlant, state: Array) -> float:
    """By how much a small difference in velocities grows in a step, on the mean of some."""
    still, data = np.zeros(fleet.agents.channels), fleet.data
    rng = np.random.default_rng(0)
    nudge = np.concatenate([np.zeros(len(data.qpos)), rng.normal(size=len(data.qvel))])
    here, logs = state, []
    for _ in range(SETTLING + LOOKED):
        nudge *= NUDGE / np.linalg.norm(nudge)
        ends = []
        for sign in (0.0, 1.0):
            acting_forces.restore(fleet, here)
            data.qpos += sign * nudge[: len(data.qpos)]
            data.qvel += sign * nudge[len(data.qpos) :]
            fleet.step(still)
            ends.append(np.concatenate([data.qpos, data.qvel]))
            if not sign:
                ahead = acting_forces.saved(fleet)
        nudge, here = ends[1] - ends[0], ahead
        size = float(np.linalg.norm(nudge))
        if not 0.0 < size < np.inf:
            return np.inf if size else 0.0
        logs.append(np.log(size / NUDGE))
    return float(np.exp(np.mean(logs[SETTLING:])))


def _inputs(fleet: FleetPlant, state: Array, limits: Array, steps: int) -> list[str]:
    """Of each agent's axes what is seen first."""
    acting_forces.restore(fleet, state)
    begin, d = fleet.output, fleet.agents.dimension
    change = CHANGE * np.where(np.isfinite(limits), limits, 1.0)
    still = np.zeros(len(change))
    free = acting_forces.response(fleet, state, still, steps)
    rise = acting_forces.slopes(fleet, state, still, change, steps)
    least = np.linalg.eigvalsh(0.5 * (rise + np.swapaxes(rise, 1, 2)))[:, 0]
    said = []
    for agent in np.flatnonzero(~(least > 0.0))[:1]:
        said.append(
            f"over a control period the output of agent {agent + 1} does not rise with its input"
            f" (dy+/du = {least[agent]:.3g})"
        )
    asked = (np.linalg.pinv(rise) @ (begin - free).reshape(-1, d, 1)).ravel()
    beyond = np.flatnonzero(np.abs(asked) > limits)
    for channel in beyond[:1]:
        said.append(
            f"to stay at its start agent {channel // d + 1} would need an input of about"
            f" {asked[channel]:.3g}, beyond its limit {limits[channel]:g}"
        )
    return said
