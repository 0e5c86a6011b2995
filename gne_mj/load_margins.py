"""What an observer of loads leaves for a margin to cover: how far its estimates can be off.

With d the load and D the most that it changes within a control period, an estimate's error r at the
next control instant is at most q |r| + D + L kappa D + L N: the observer of gain L divides by a
slope dy+/du that is known within a factor kappa, q = max(1 - L / kappa, L kappa - 1), and N is what
errors of readings add. So |r| stays below the greater of |r(0)| and the fixed point, and what
pushes an agent beyond its prediction below that and D. The proof is in docs/held-inputs.md.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.margins import Disturbance, Influence, influence
from gne_mj.plants.agent_type import has_ode
from gne_mj.plants.agents import Agents

Array = NDArray[np.float64]


def shrinking(effect: Influence, gain: float) -> tuple[Array, Array]:
    """q and kappa of each channel (m,), of a period with this effect; q >= 1 is no bound."""
    with np.errstate(divide="ignore", invalid="ignore"):
        kappa = np.where(effect.least_slope > 0, effect.push_gain / effect.least_slope, np.inf)
        kappa = np.maximum(kappa, 1.0)
        return np.maximum(1.0 - gain / kappa, gain * kappa - 1.0), kappa


def beyond_estimates(
    agents: Agents,
    timestep: float,
    integrator: str,
    period: int,
    disturbance: Disturbance,
    gain: float,
    guarded: bool = False,
) -> Disturbance:
    """The disturbances of which predictions that know the estimated loads are off.

    Args:
        agents, timestep, integrator, period: as :func:`gne_mj.margins.influence` has them.
        disturbance: declared; its push is what is not known of the load at the start.
        gain: of the observer; 0 for none.
        guarded: whether periods may be shorter.

    Raises:
        InvalidInput: slopes that are not known well enough for this gain; of MJCF robots anything
            but noise.
    """
    if not has_ode(agents.kind):
        _noise_alone(disturbance, guarded)
    if gain == 0.0:
        return disturbance
    change = np.zeros(agents.channels) if disturbance.change is None else disturbance.change
    settled = np.zeros(agents.channels)
    for steps in range(1, period + 1) if guarded else (period,):
        effect = influence(agents, timestep, integrator, steps)
        q, kappa = shrinking(effect, gain)
        if not np.all(q < 1.0):
            raise InvalidInput(
                "observer", gain, f"over {steps * timestep:g} s dy+/du is known within a factor of"
                f" {np.max(kappa):.3g} only, with which estimates of this gain are not known to"
                " settle: a smaller gain or a shorter control period does",
            )  # fmt: skip
        read = (1.0 + effect.noise_gain) * disturbance.noise / effect.least_slope
        settled = np.maximum(settled, (change * (1.0 + gain * kappa) + gain * read) / (1.0 - q))
    return replace(disturbance, push=np.maximum(disturbance.push, settled) + change)


def _noise_alone(disturbance: Disturbance, guarded: bool) -> None:
    """Refuse what of robots that only MuJoCo knows no margin is known for."""
    pushed = np.any(disturbance.push > 0)
    changed = disturbance.change is not None and np.any(disturbance.change > 0)
    if pushed or changed or disturbance.delay > 0:
        what = "late sensors" if disturbance.delay > 0 else "pushes"
        raise InvalidInput(
            "disturbance", what, "no equation says how far pushes move MJCF robots, or where they"
            " were: a margin of theirs is for noise",
        )  # fmt: skip
    if guarded:
        raise InvalidInput(
            "guarded", "guarded", "between instants no margin is known of MJCF robots: leave one of"
            " both out",
        )  # fmt: skip
