"""How a run that ended early did: its status with a sentence, and where it left."""

from typing import Any

import numpy as np

from gne_mj import kept_apart
from gne_mj.loops import monitor as watch
from gne_mj.loops.division import PIECES
from gne_mj.run_metrics import EXITS
from gne_mj.system import System
from gne_mj.system.data import CONTINUE


def exit_status(system: System, monitor: Any) -> tuple[str, str]:
    """The status and its sentence.

    Args:
        system: what ran.
        monitor: the loop's, whose exit is latched (:mod:`gne_mj.loops.monitor`).
    """
    game = system.game
    at = f"at {monitor.exit_time:.6g} s"
    if monitor.exit_stage > 0:
        at += f" (stage {int(monitor.exit_stage) + 1} of the integration step)"
    value = float(monitor.exit_value)
    code = int(monitor.exit)
    if code == watch.DIVERGED:
        return EXITS[code], f"an output or input is no longer a usable number ({value:g}) {at}"
    if code == watch.FORCES_LOST:
        from gne_mj.plants.native_mujoco import lost_text  # late: MuJoCo is slow to import

        return EXITS[code], f"{at} {lost_text(int(value))}"
    if (pair := kept_apart.pair_of(monitor)) is not None:
        return EXITS[code], kept_apart.exit_text(system, monitor, pair, at)
    constraint = game.constraint_names[int(monitor.exit_constraint)]
    if code == watch.FORESEEN:
        return (
            EXITS[code],
            f"held for even one integration step from {at[3:]} on, the input that there is would"
            f" violate constraint '{constraint}' (predicted g = {value:.6g}), and it was not given:"
            f" {_instead(system)} can go on there",
        )
    if code == watch.STEP_TOO_SMALL:
        return (
            EXITS[code],
            f"1/{PIECES} of the timestep is still too long next to constraint '{constraint}' {at}"
            f" (g = {value:.6g}): {_instead(system)} can go on there",
        )
    if code == watch.MOVED_PAST:
        return (
            EXITS[code],
            f"constraint '{constraint}' moves past the present outputs within the control period"
            f" that begins {at}: g = {value:.6g} at its end, not negative",
        )
    if monitor.exit_between > 0:
        at += ", between two control instants"
    if code == watch.LEFT_SET:
        return (
            EXITS[code],
            f"constraint '{constraint}' was violated {at}: g = {value:.6g}, not negative",
        )
    return EXITS[code], _without_action(system, int(monitor.exit_agent), constraint, at, value)


def _without_action(system: System, agent: int, constraint: str, at: str, value: float) -> str:
    """That the law has no action at the measured profile (agent -1) or at an agent's estimates."""
    if agent < 0:
        tightened = np.any(system.game.margins)
        return (
            f"the measured profile violated constraint '{constraint}'"
            f"{', tightened,' if tightened else ''} {at}: g{' + t' if tightened else ''} ="
            f" {value:.6g}, not negative, so the law has no action there"
        )
    return (
        f"agent {agent + 1}'s estimates violated constraint '{constraint}' {at}: g = {value:.6g},"
        " not negative, so its law has no action there (a smaller epsilon or gain keeps estimates"
        " closer to the actions)"
    )


def certified_until(system: System, monitor: Any) -> str:
    """What is added where a run was to go on, but its law has no action outside."""
    if system.on_exit != CONTINUE or system.goes_on:
        return ""
    return (
        f"; what is certified is certified until then, {monitor.exit_time:.6g} s: the law has no"
        " action outside, with which the run could go on"
    )


def exit_report(system: System, monitor: Any) -> dict[str, Any] | None:
    """When and where a run left, the last input (m,) that was held and under which law; None where
    it did not leave. Arguments as of :func:`exit_status`; times in s, numbers for JSON."""
    if monitor.exit == watch.INSIDE:
        return None
    constraint = int(monitor.exit_constraint)
    pair = kept_apart.pair_of(monitor)
    known = monitor.exit != watch.DIVERGED and pair is None
    agent = int(monitor.exit_agent) + 1 if pair is None else 0
    return {
        "time": float(monitor.exit_time),
        "stage": int(monitor.exit_stage) + 1,
        "at_control_instant": not monitor.exit_between > 0,
        "constraint": system.game.constraint_names[constraint] if known else None,
        "value": float(monitor.exit_value),
        "estimates_of_agent": agent or None,
        "agents": concerned(system, monitor),
        "information": system.law.information,
        "mode": system.mode,
        "last_input": monitor.last_u.tolist(),
    }


def concerned(system: System, monitor: Any) -> list[int]:
    """The agents, from 1, that an exit is of: in the constraint, or the one with the estimates."""
    if monitor.exit == watch.DIVERGED:
        return []
    if (pair := kept_apart.pair_of(monitor)) is not None:
        return sorted({i + 1 for i in pair})
    agent = int(monitor.exit_agent)
    members = system.game.in_constraint[int(monitor.exit_constraint)]
    return [agent + 1] if agent >= 0 else sorted(i + 1 for i in members)


def _instead(system: System) -> str:
    """What does where steps are too long next to a bound."""
    ways = ["a larger rho", "a smaller timestep"]
    if system.mode != "implicit":
        ways.insert(0, "mode 'implicit'")
    if system.law.rosenbrock and system.engine == "ode":
        ways.insert(0, "integrator 'rosenbrock'")
    return f"{', '.join(ways[:-1])} or {ways[-1]}"
