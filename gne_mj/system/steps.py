"""Which integration steps and control periods a system allows."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gne_mj.bounds import MOST_HELD, check_count
from gne_mj.errors import InvalidInput
from gne_mj.margins import influence
from gne_mj.plants.base import Plant
from gne_mj.plants.mjcf_robot import MjcfRobots
from gne_mj.plants.ode import OdePlant
from gne_mj.system.clock import Clock

if TYPE_CHECKING:
    from gne_mj.system.system import System

# Largest step times rate of decay that a method is stable for, on the negative real axis
STABLE = {"rk4": 2.785, "euler": 2.0}


def largest_step(system: "System") -> float:
    """Largest step in s that the estimates allow under the integrator, mode continuous.

    Explicit methods are stable for c lambda_max / tau (or lambda_max / epsilon) times the step
    up to a constant of the method; lambda_max bounds the grounded Laplacians' eigenvalues.
    Under partial information the action pulls an agent of mass M as an estimate of mass tau is
    pulled, so that the lesser of both counts.
    """
    law = system.law
    if law.graph is None or law.estimate_rate == 0.0 or system.mode != "continuous":
        return np.inf
    if system.integrator == "rosenbrock":
        return np.inf
    # z has the rate of an eigenvalue 1, which a graph with an edge exceeds
    fastest = max(1.0, law.graph.largest_eigenvalue)
    rate = law.estimate_rate
    if system.agents.mobility is not None:
        rate = max(rate, law.coupling * float(np.max(system.agents.mobility)))
    return STABLE[system.integrator] / (fastest * rate)


def check_step(system: "System", clock: Clock) -> None:
    """Refuse steps that the estimates' dynamics do not allow."""
    largest = largest_step(system)
    if clock.timestep > largest:
        others = "in mode 'sampled' estimates have no such limit"
        if system.law.rosenbrock and system.engine == "ode":
            others = "integrator 'rosenbrock' and mode 'sampled' have no such limit"
        raise InvalidInput(
            "clock.timestep",
            clock.timestep,
            f"the estimates of '{system.name}' follow each other at up to"
            f" {STABLE[system.integrator] / largest:.4g} /s, which '{system.integrator}' can follow"
            f" with steps of at most {_rounded_down(largest):.3g} s; {others}",
        )


def check_slopes(system: "System", clock: Clock) -> None:
    """Refuse periods over which dy+/du is not positive: exactly, or else from this start."""
    if system.mode != "implicit":
        return
    steps = clock.steps(clock.control_period)
    check_count("clock.control_period", steps, MOST_HELD, "its timesteps")
    if isinstance(system.agents, MjcfRobots):
        return
    effect = influence(system.agents, clock.timestep, system.integrator, steps)
    if effect.exact:
        _refuse_slopes(system, effect.least_slope, clock)
    elif not np.all(effect.least_slope > 0):
        try_slopes(system, OdePlant(system.agents, clock.timestep, system.integrator), clock)


def try_slopes(system: "System", plant: Plant, clock: Clock) -> None:
    """The same by moving a plant under two inputs from the start; it is reset afterwards."""
    reached = []
    for u in (0.0, 1.0):
        plant.reset(system.state)
        plant.step(np.full(system.game.actions, u), clock.steps(clock.control_period))
        reached.append(plant.output)
    plant.reset(system.state)
    _refuse_slopes(system, reached[1] - reached[0], clock)


def _refuse_slopes(system: "System", slope: NDArray[np.float64], clock: Clock) -> None:
    worst = int(np.argmin(slope))
    if not slope[worst] > 0:
        agent = int(system.game.agent_of_action[worst]) + 1
        raise InvalidInput(
            "clock.control_period",
            clock.control_period,
            f"over it the output of agent {agent} of '{system.name}' does not rise with its input"
            f" (dy+/du = {slope[worst]:.4g}), which mode 'implicit' needs",
        )


def _rounded_down(value: float) -> float:
    """To three digits: what a message names as the largest must itself be accepted."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 2)
    return float(np.floor(value / unit) * unit)
