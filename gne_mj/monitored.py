"""What a run's monitor has seen at every integration step, section by section of its report.

Each function is given the system that ran and its loop's monitor (:mod:`gne_mj.loops.monitor`).
What it returns are plain numbers for JSON, as :class:`gne_mj.certificate.Certificate` describes
them; times in s.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj import run_metrics
from gne_mj.changing_graph import ChangingGraph
from gne_mj.faults import triggered
from gne_mj.loops import monitor as watch
from gne_mj.motion import motion_of
from gne_mj.plants.agent_type import followed_position
from gne_mj.system import Clock, System, mode_of
from gne_mj.system.first_input import limits_at


def _worst(system: System, monitor: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Each constraint's greatest value and when in s, (p,) each, that at an exit included."""
    worst, when = run_metrics.worst_constraints(np.array([monitor]))
    return worst[0], when[0]


def worst_constraint(system: System, monitor: Any) -> dict[str, Any] | None:
    """The least margin -g, whose and when, and each constraint's; None if nothing was observed."""
    worst, when = _worst(system, monitor)
    index = int(np.argmax(worst))
    if not np.isfinite(worst[index]):
        return None
    return {
        "name": system.game.constraint_names[index],
        "index": index + 1,
        "margin": float(-worst[index]),
        "each": [float(-value) if np.isfinite(value) else None for value in worst],
        "time": float(when[index]),
    }


def worst_gap(system: System, monitor: Any) -> dict[str, Any] | None:
    """The gap that used most of its bound, in the action's unit; None without bounds of gaps, or
    where these move."""
    worst, when = _worst(system, monitor)
    bounds = system.game.gap_bounds
    if bounds is None or not np.any(np.isfinite(worst)):
        return None
    motion = motion_of(system.game)
    others = () if motion is None else [each.gap_bounds for each in motion.others]
    if not all(each is not None and np.array_equal(each, bounds) for each in others):
        return None  # bounds that move
    gaps = np.sqrt(np.maximum(worst + bounds**2, 0.0))
    index = int(np.argmax(gaps / bounds))
    return {
        "name": system.game.constraint_names[index],
        "index": index + 1,
        "gap": float(gaps[index]),
        "bound": float(bounds[index]),
        "unit": system.game.action_unit,
        "time": float(when[index]),
        "each": gaps.tolist(),
    }


def positions(system: System, monitor: Any) -> dict[str, Any] | None:
    """Where positions stood that follow outputs, at every integration step."""
    if followed_position(system.agents.kind) < 0 or not monitor.positions:
        return None
    return {
        "observed": int(monitor.positions),
        "outside": int(monitor.positions_outside),
        "least_margin": -float(monitor.positions_worst),
        "constraint": system.game.constraint_names[int(monitor.positions_constraint)],
        "time": float(monitor.positions_worst_time),
    }


def contacts(system: System, monitor: Any) -> dict[str, Any] | None:
    """What was seen of contacts between agents, at every integration step."""
    if not system.agents.contacts:
        return None
    any_at_all = monitor.contacts > 0
    agents = [1 + int(monitor.contact_agent), 1 + int(monitor.contact_other)]
    return {
        "count": int(monitor.contacts),
        "steps": int(monitor.touching),
        "first": float(monitor.contact_time) if any_at_all else None,
        "agents": agents if any_at_all else None,
        "depth": float(monitor.contact_depth),
    }


def messages(system: System, monitor: Any, clock: Clock | None) -> dict[str, Any] | None:
    """What agents sent, and would have sent once a control period."""
    graph = system.law.graph
    if graph is None or isinstance(graph, ChangingGraph) or not mode_of(system).held:
        return None
    links = 2 * len(graph.edges)
    if triggered(system.faults):
        periodic = links * int(monitor.message_instants)
        return {"sent": int(monitor.messages), "periodic": periodic}
    if clock is None:
        return None
    periods = math.ceil(clock.steps(float(monitor.time)) / clock.steps(clock.control_period))
    return {"sent": links * periods, "periodic": links * periods}


def between(system: System, monitor: Any) -> dict[str, Any] | None:
    """What a guard did between control instants."""
    if not system.guarded:
        return None
    any_at_all = monitor.cut > 0
    return {
        "periods_cut": int(monitor.cut),
        "first_cut": float(monitor.cut_time) if any_at_all else None,
        "shortest_period": float(monitor.shortest_period) if any_at_all else None,
    }


def actuators(system: System, monitor: Any) -> dict[str, Any]:
    """Peak, RMS and energy of the inputs (m,), in their unit, and where a limit was met first."""
    peak, when, rms, energy = (each[0] for each in run_metrics.inputs(watch.together([monitor])))
    agent = system.game.agent_of_action
    largest = int(np.argmax(peak))
    limits = system.agents.input_limit
    result: dict[str, Any] = {
        "peak": float(peak[largest]),
        "peak_agent": int(agent[largest]) + 1,
        "peak_time": float(when[largest]),
        "peaks": peak.tolist(),
        "rms": rms.tolist(),
        "energy": energy.tolist(),
        "limits": None if np.all(np.isinf(limits)) else limits.tolist(),
        "saturated": None,
    }
    if monitor.saturated > 0:
        index = int(monitor.saturated_action)
        result["saturated"] = {
            "agent": int(agent[index]) + 1,
            "time": float(monitor.saturated_time),
            "demand": float(monitor.saturated_command),
            "limit": float(limits_at(system, float(monitor.saturated_time))[index]),
        }
    return result
