"""What a guard between control instants needs of a system, and what of it is built in."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.faults import Bias, Noise, sensor_delay
from gne_mj.load_margins import beyond_estimates
from gne_mj.loops import link
from gne_mj.loops.feedback import Order
from gne_mj.loops.newton import solver_length
from gne_mj.margins import errors_ahead, tightening
from gne_mj.motion import motion_of
from gne_mj.plants import zero_order_hold
from gne_mj.plants.agent_type import has_ode
from gne_mj.registry import MODES
from gne_mj.system.clock import Clock
from gne_mj.system.data import GUARDED, WATCHED, SystemData


def check_guard(system: SystemData) -> None:
    """Refuse what a guard has no meaning for.

    Raises:
        InvalidInput: names ``between``.
    """
    key, value = "between", system.between
    if value not in (WATCHED, GUARDED):
        raise InvalidInput(key, value, f"it must be '{WATCHED}' or '{GUARDED}'")
    if not system.guarded:
        return
    if not MODES[system.mode].guards:
        names = " and ".join(f"'{mode.name}'" for mode in MODES if mode.guards)
        raise InvalidInput(key, value, f"it cuts control periods, and is for modes {names}")
    if system.law.acts_outside:
        raise InvalidInput(
            key, value, "it looks ahead for what a barrier keeps inside, and this law acts outside"
            " too: leave it out",
        )  # fmt: skip
    if system.law.alone:
        raise InvalidInput(
            key, value, "under this law agents do not know each other's outputs, which looking"
            " ahead begins with: it is for full and partial information",
        )  # fmt: skip
    if system.separation is not None:
        raise InvalidInput(
            key, value, "agents that keep apart look at each other at the clock's own control"
            " instants: leave it out, or [separation]",
        )  # fmt: skip
    if motion_of(system.game) is not None or system.feed_forward:
        raise InvalidInput(key, value, "it looks at games that stand still, under the law alone")
    late = system.disturbance is not None and system.disturbance.delay > 0
    if late or sensor_delay(system.faults) > 0:
        raise InvalidInput(
            key, value, "late sensors are late by whole control periods, under one input each:"
            " leave it out, or the delay",
        )  # fmt: skip
    wrong = any(isinstance(fault, Noise | Bias) for fault in system.faults)
    if wrong and not has_ode(system.agents.kind):
        raise InvalidInput(
            key, value, "looking ahead it steps MJCF robots on from where they truly are, which"
            " sensors with noise or bias do not tell: leave it out, or these faults",
        )  # fmt: skip


def acting(system: SystemData, find: Callable[..., Any]) -> Any:
    """The C function of a control instant, ``find`` being the kernel that finds inputs."""
    plant: ModuleType = zero_order_hold
    at: Any = ()
    if not has_ode(system.agents.kind):
        from gne_mj.plants import mjcf_prediction, native_mujoco  # late: MuJoCo is slow to import

        plant, at = mjcf_prediction, native_mujoco.offsets()
    return link.act(plant, system.fault_kernels, system.game_kernels, at, find)


def room_for(system: SystemData, rows: Order) -> int:
    """Numbers in a loop's workspace to predict, and to solve for, inputs in."""
    game = system.game
    return int(
        solver_length(
            game.actions, game.constraints_count, len(rows.column), system.agents.states,
            int(rows.band[0]),
        )
    )  # fmt: skip


def room_ahead(system: SystemData, clock: Clock) -> NDArray[np.float64]:
    """How far disturbances can carry each constraint at each step, (steps * p,); () without any."""
    if not system.guarded or system.disturbance is None:
        return np.zeros(0)
    how = (system.agents, clock.timestep, system.integrator, clock.steps(clock.control_period))
    unforeseen = beyond_estimates(*how, system.disturbance, system.observer, guarded=True)
    errors = errors_ahead(*how, unforeseen)
    return np.concatenate([tightening(system.game, error) for error in errors])
