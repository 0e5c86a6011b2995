"""The paper's full-information law as a policy."""

from collections.abc import Callable

import dm_env
import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.motion import motion_of
from gne_mj.system import System

Policy = Callable[[dm_env.TimeStep], NDArray[np.float64]]


def law_policy(system: System) -> Policy:
    """u = -F(y) - dphi/dy(y) [eq:nonlinFIfeedback] within the inputs' limits, from time steps.

    It is the law in plain NumPy, and reads ``all/output``; held for a control period it is what
    mode ``sampled`` does. After an episode's end, where no law need have an action, it gives zeros.

    Raises:
        InvalidInput: a penalty that falls in time, which no observation tells; and from the policy,
            observations that are not of full information.
    """
    if system.schedule is not None:
        raise InvalidInput(
            "system.schedule",
            system.schedule.kind,
            "the policy does not know the time: leave the schedule out",
        )
    if motion_of(system.game) is not None:
        raise InvalidInput(
            "system.game", "numbers that move", "the policy does not know the time: let them stand"
        )
    game, barrier, limit = system.game, system.barrier, system.agents.input_limit

    def policy(timestep: dm_env.TimeStep) -> NDArray[np.float64]:
        if timestep.last():
            return np.zeros(game.actions)
        if "all/output" not in timestep.observation:
            raise InvalidInput(
                "timestep.observation",
                list(timestep.observation),
                "this law needs the observations of information 'full'",
            )
        y = timestep.observation["all/output"]
        force = -game.pseudo_gradient(y) - barrier.gradient(y)
        return np.clip(force, -limit, limit)

    return policy
