"""Robots whose outputs are positions against the same ones whose outputs are velocities."""

import time
from collections.abc import Callable
from functools import partial

import numpy as np
from turns import in_turns, row

from gne_mj.controllers import FullInformation
from gne_mj.games import velocity_game
from gne_mj.loops.base import ClosedLoop
from gne_mj.plants import flexible_robot, position_robot
from gne_mj.plants.agents import Agents
from gne_mj.scenario import load_scenario
from gne_mj.system import Clock, System

H, COUNT, V_0 = 2e-3, 5, 3.0
PLACES = 8
KINDS = (
    ("mujoco", "continuous", "rk4", 400),
    ("mujoco", "continuous", "euler", 1_000),
    ("mujoco", "implicit", "euler", 1_000),
    ("ode", "continuous", "rk4", 4_000),
    ("ode", "implicit", "euler", 4_000),
)


def rows(runs: int = 25) -> list[dict[str, str]]:
    """Medians over ``runs`` turns; microseconds of a processor per integration step."""
    found = []
    for engine, mode, integrator, steps in KINDS:
        made = {
            name: partial(_loop, name, engine, mode, integrator)
            for name in ("positions", "velocities")
        }
        times = _turns(made, steps, runs)
        what = f"{COUNT} robots, {engine}, {integrator}, {mode}: us per step; positions as outputs"
        found.append(row(f"{what} / velocities", times, "positions", "velocities", "<= 1.05"))
    for name in ("platoon", "formation"):
        made = {"on": partial(_shipped, name, True), "off": partial(_shipped, name, False)}
        times = _turns(made, 400, runs)
        found.append(row(f"`{name}`: us per step; contacts on / off", times, "on", "off", ""))
    return found


def _loop(outputs: str, engine: str, mode: str, integrator: str) -> ClosedLoop:
    """The same game, over positions or over velocities, from a start near its equilibrium."""
    table, y = np.ones((COUNT, 5)), V_0 + np.array([0.3, -0.2, 0.4, 0.1, -0.3])
    kind, state = flexible_robot, np.column_stack([0.0 * y, y, y, 0.0 * y])
    if outputs == "positions":
        kind, state = position_robot, np.column_stack([0.0 * y, y, 0.0 * y, y])
        more = np.tile([0.5, 0.0, 3.0], (COUNT, 1))  # tau, d, v_0
        table = np.concatenate([table, more], axis=1)
        table[:, 6] = 1.2 * position_robot.least_damping(table)
    agents = Agents(kind, table, np.full(COUNT, np.inf))
    system = System(
        "robots", velocity_game(COUNT, V_0, 3.0), agents, FullInformation(), 0.1, state,
        engine=engine, integrator=integrator, mode=mode,
    )  # fmt: skip
    return system.closed_loop(Clock(1.0, H, H, H))


def _shipped(name: str, contacts: bool) -> ClosedLoop:
    scenario = load_scenario(name, {"agents.contacts": contacts})
    (system,) = scenario.system_objects()
    return system.closed_loop(scenario.clock())


def _turns(
    made: dict[str, Callable[[], ClosedLoop]], steps: int, runs: int
) -> dict[str, list[float]]:
    """Of several loops each: where in memory one happens to lie makes up to 10% of an ODE step."""
    loops: dict[str, list[ClosedLoop]] = {name: [] for name in made}
    for _ in range(PLACES):
        for name, make in made.items():
            loops[name].append(make())

    def measure(name: str) -> float:
        started = time.process_time()
        for loop in loops[name]:
            loop.advance(1, steps)
        return 1e6 * (time.process_time() - started) / (steps * PLACES)

    return in_turns({name: partial(measure, name) for name in loops}, runs)
