"""The closed loop in MuJoCo against bare mj_step, and against a loop as one would write it."""

import time
from contextlib import nullcontext

import mujoco
import numpy as np
from turns import in_turns, row

from gne_mj.controllers import FullInformation, FullyDistributed, Law, PartialInformation
from gne_mj.games import velocity_game
from gne_mj.graph import ring
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.plants.callbacks import callbacks
from gne_mj.plants.fleet import compile_model, compose
from gne_mj.plants.mujoco import run_steps
from gne_mj.plants.native_mujoco import step_address
from gne_mj.system import Clock, System

H = 1e-3
INTEGRATORS = {"euler": "Euler", "rk4": "RK4"}


def rows(runs: int = 25) -> list[dict[str, str]]:
    """Medians over ``runs`` turns; microseconds per integration step."""
    partial, distributed = PartialInformation(ring(5)), FullyDistributed(ring(5), 0.1)
    return [
        *_closed_loop(5, "euler", 20_000, runs, "<= 1.06"),
        *_closed_loop(200, "euler", 1_000, runs, "<= 1.05"),
        *_closed_loop(5, "rk4", 5_000, runs, "<= 1.06"),
        *_closed_loop(5, "rk4", 5_000, runs, "<= 1.10", partial),
        *_closed_loop(5, "euler", 20_000, runs, "<= 1.10", partial, "sampled"),
        *_closed_loop(5, "rk4", 5_000, runs, "<= 1.12", distributed),
        *_closed_loop(5, "euler", 20_000, runs, "<= 1.12", distributed, "sampled"),
        *_closed_loop(5, "euler", 20_000, runs, "<= 1.15", None, "implicit"),
        *_closed_loop(200, "euler", 1_000, runs, "<= 1.12", None, "implicit"),
        *_closed_loop(200, "euler", 200, runs, "", PartialInformation(ring(200)), "sampled"),
        *_closed_loop(200, "rk4", 200, runs, "", PartialInformation(ring(200))),
    ]


def _closed_loop(
    count: int,
    integrator: str,
    steps: int,
    runs: int,
    target: str,
    law: Law | None = None,
    mode: str = "continuous",
) -> list[dict[str, str]]:
    law = law or FullInformation()
    table = np.ones((count, len(flexible_robot.PARAMETERS)))
    agents = Agents(flexible_robot, table, np.full(count, np.inf))
    y = 3.0 - np.linspace(0.0, 2.0, count)
    state = agents.equilibrium(y)
    system = System(
        "robots", velocity_game(count, 3.0, 3.0), agents, law, 0.1, state,
        engine="mujoco", integrator=integrator, mode=mode,
    )  # fmt: skip
    clock = Clock(H * steps, H, H, H * 100)
    # As anybody would compose them, and as loops step them: without what no step needs.
    same = compile_model(compose(table), timestep=H, integrator=INTEGRATORS[integrator])
    plain = compile_model(
        compose(table, decorated=False), timestep=H, integrator=INTEGRATORS[integrator]
    )
    kinds = {
        "ours": lambda: _ours(system, clock, steps),
        "bare": lambda: _bare(same, state, steps),
        "bare, as in the loop": lambda: _bare(plain, state, steps, timed=False),
    }
    if law.information == "full":
        script = Script(same, y)
        kinds["Python loop"] = lambda: script.run(steps // 20) * 20
    per_step = {
        name: (lambda measure=measure: 1e6 * measure() / steps) for name, measure in kinds.items()
    }
    times = in_turns(per_step, runs)
    what = f"{count} robots, {integrator}, {law.information} information, {mode}: us per step"
    pairs = {
        "bare": (target, "ours / bare mj_step of the same robots", False),
        "bare, as in the loop": (
            "",
            "ours / bare mj_step without decoration and stopwatch, as ours has it",
            False,
        ),
        "Python loop": (">= 4" if integrator == "euler" else "", "Python loop / ours", True),
    }
    return [
        row(f"{what}; {meaning}", times, "ours", name, goal, upside_down=upside_down)
        for name, (goal, meaning, upside_down) in pairs.items()
        if name in times
    ]


def _ours(system: System, clock: Clock, steps: int) -> float:
    loop = system.closed_loop(clock)
    started = time.perf_counter()
    loop.advance(steps // 100, 100)
    return time.perf_counter() - started


def _start(model: mujoco.MjModel, state: np.ndarray) -> mujoco.MjData:
    data = mujoco.MjData(model)
    data.qvel[0::2] = state[:, 1]
    data.qvel[1::2] = state[:, 2]
    return data


def _bare(model: mujoco.MjModel, state: np.ndarray, steps: int, *, timed: bool = True) -> float:
    data = _start(model, state)
    run = run_steps()
    with nullcontext() if timed else callbacks():
        started = time.perf_counter()
        run(step_address(), model._address, data._address, steps)
        return time.perf_counter() - started


class Script:
    """The loop as researchers write it: a NumPy law, the spring's atan term by Python."""

    def __init__(self, model: mujoco.MjModel, y: np.ndarray) -> None:
        self.model, self.y = model, y
        self.delta, self.rho, self.v0 = 3.0, 0.1, 3.0

    def spring(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """The springs' atan terms, as MuJoCo's passive callback."""
        pull = np.arctan(data.qpos[0::2] - data.qpos[1::2])
        data.qfrc_passive[0::2] -= pull
        data.qfrc_passive[1::2] += pull

    def law(self, data: mujoco.MjData) -> np.ndarray:
        """The full-information law."""
        gap = np.diff(data.qvel[0::2], prepend=self.v0)
        slope = 2.0 * gap * self.rho / (self.delta**2 - gap**2)
        u = -2.0 * gap - slope
        u[:-1] += slope[1:]
        return u

    def run(self, steps: int) -> float:
        """Seconds for so many steps."""
        data = mujoco.MjData(self.model)
        data.qvel[0::2] = data.qvel[1::2] = self.y
        mujoco.set_mjcb_passive(self.spring)
        try:
            started = time.perf_counter()
            for _ in range(steps):
                data.ctrl[:] = self.law(data)
                mujoco.mj_step(self.model, data)
            return time.perf_counter() - started
        finally:
            mujoco.set_mjcb_passive(None)
