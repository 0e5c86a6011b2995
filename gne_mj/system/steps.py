"""Which integration steps a system allows."""

import numpy as np

from gne_mj.changing_graph import ChangingGraph
from gne_mj.errors import InvalidInput
from gne_mj.loops.division import PIECES
from gne_mj.system.clock import Clock
from gne_mj.system.data import SystemData
from gne_mj.system.modes import mode_of

# Largest step times rate of decay that a method is stable for, on the negative real axis
STABLE = {"rk4": 2.785, "euler": 2.0, "tsit5": 3.506}


def largest_step(system: SystemData) -> float:
    """Largest timestep in s that the estimates allow under the integrator, mode continuous.

    Explicit methods are stable for c lambda_max / tau (or lambda_max / epsilon) times the step
    up to a constant of the method; lambda_max bounds the grounded Laplacians' eigenvalues.
    Under partial information the action pulls an agent of mass M as an estimate of mass tau is
    pulled, so that the lesser of both counts. Of "tsit5" it is the shortest piece of a timestep
    that must be stable.
    """
    rate = estimates_rate(system)
    if rate == 0.0 or system.integrator not in STABLE:
        return np.inf
    return STABLE[system.integrator] * (PIECES if system.integrator == "tsit5" else 1) / rate


def estimates_rate(system: SystemData) -> float:
    """The greatest rate in 1/s at which estimates follow each other; 0 where it sets no limit."""
    law = system.law
    if law.graph is None or law.estimate_rate == 0.0 or mode_of(system).held:
        return 0.0
    # z has the rate of an eigenvalue 1, which a graph with an edge exceeds
    fastest = max(1.0, law.graph.largest_eigenvalue)
    rate = law.estimate_rate
    if system.agents.mobility is not None:
        rate = max(rate, law.coupling * float(np.max(system.agents.mobility)))
    return fastest * rate


def check_step(system: SystemData, clock: Clock) -> None:
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
            f" {estimates_rate(system):.4g} /s, which '{system.integrator}' can follow"
            f" with timesteps of at most {_rounded_down(largest):.3g} s; {others}",
        )


def check_network(system: SystemData, clock: Clock) -> None:
    """Refuse a graph that changes between steps, or between control instants."""
    graph = system.law.graph
    if not isinstance(graph, ChangingGraph):
        return
    held = mode_of(system).held
    unit = clock.control_period if held else clock.timestep
    for time in graph.times:
        count = time / unit
        if round(count) < 1 or abs(count - round(count)) > 1e-6:
            what = "control period" if held else "timestep"
            raise InvalidInput(
                "law.graph",
                f"{time:g} s",
                f"it must change after a multiple of the {what} {unit:g} s",
            )


def _rounded_down(value: float) -> float:
    """To three digits: what a message names as the largest must itself be accepted."""
    if not value > 0:
        return 0.0
    unit = 10.0 ** (np.floor(np.log10(value)) - 2)
    return float(np.floor(value / unit) * unit)
