"""Steps of environments a second: our vector of fleets against loops over MuJoCo in Python.

Five flexible robots, Runge-Kutta 4 at 2 ms, a step of 20 ms; forces that stay inside, so that no
episode ends. The Python loops are what a user would write with PettingZoo: `Same` has the same
physics (the springs' atan terms by a callback) and looks at the constraints after every integration
step, once with the fleet's model as it is drawn, once without all that no step needs, as ours;
`Least` leaves out the atan terms and looks too, so that nothing of Python's is in between but the
interface.
"""

import time
from typing import Any

import mujoco
import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv
from turns import in_turns, row

from gne_mj.environment import FleetVectorEnv, guarded, load_pettingzoo, load_vector
from gne_mj.plants.fleet import compile_model, compose

COUNT, V0, BOUND = 256, 3.0, 3.0
H, PERIOD = 0.002, 0.02
STEPS, FEWER = 4, 100  # of a turn: of all of ours, and of one fleet in Python
CHANGES = {
    "simulation.timestep": H, "simulation.control_period": PERIOD, "simulation.duration": 1e4,
    "agents.input_limit": 40.0,
}  # fmt: skip
ENDLESS = 10**9  # periods


class Same(ParallelEnv[str, Any, Any]):
    """The fleet by hand, each agent seeing its own state, its neighbours' outputs and its g."""

    metadata = {"name": "by_hand"}  # noqa: RUF012
    inner = True  # whether springs are the same, and every integration step is looked at

    def __init__(self, numbers: np.ndarray, start: np.ndarray, decorated: bool = False) -> None:
        fleet = compose(numbers, decorated=decorated)
        self.model = compile_model(fleet, timestep=H, integrator="RK4")
        self.data, self.start = mujoco.MjData(self.model), start
        self.atan, n = numbers[:, 3], len(start)
        self.possible_agents = [f"agent_{i + 1}" for i in range(n)]
        box = spaces.Box(-1e3, 1e3, (8,))
        self.observation_space = lambda agent: box  # type: ignore[method-assign]
        self.action_space = lambda agent: spaces.Box(-40.0, 40.0, (1,))  # type: ignore[method-assign]

    def reset(self, seed: int | None = None, options: Any = None) -> Any:
        """Begin again."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qvel[0::2] = self.data.qvel[1::2] = self.start
        self.agents = list(self.possible_agents)
        return self.seen(), {agent: {} for agent in self.agents}

    def springs(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Add the springs' atan terms."""
        force = self.atan * np.arctan(data.qpos[0::2] - data.qpos[1::2])
        data.qfrc_passive[0::2] -= force
        data.qfrc_passive[1::2] += force

    def slacks(self) -> np.ndarray:
        """The constraints' values."""
        self.gaps = np.diff(self.data.qvel[0::2], prepend=V0)
        return self.gaps**2 - BOUND**2

    def seen(self) -> dict[str, np.ndarray]:
        """What each agent sees."""
        qpos, v, w, g = self.data.qpos, self.data.qvel[0::2], self.data.qvel[1::2], self.slacks()
        last = len(v) - 1
        return {
            agent: np.array([
                qpos[2 * i] - qpos[2 * i + 1], v[i], w[i], qpos[2 * i], v[max(i - 1, 0)],
                v[min(i + 1, last)], g[i], g[min(i + 1, last)],
            ])
            for i, agent in enumerate(self.agents)
        }  # fmt: skip

    def step(self, actions: dict[str, np.ndarray]) -> Any:
        """Hold these forces for a control period."""
        self.data.ctrl[:] = [actions[agent][0] for agent in self.agents]
        left = False
        if self.inner:
            for _ in range(round(PERIOD / H)):
                mujoco.mj_step(self.model, self.data)
                left = bool(np.any(self.slacks() >= 0.0))
                if left:
                    break
        else:
            mujoco.mj_step(self.model, self.data, round(PERIOD / H))
        seen, costs = self.seen(), self.gaps**2
        rewards = dict(zip(self.agents, -costs, strict=True))
        ended = dict.fromkeys(self.agents, left)
        infos: dict[str, Any] = {agent: {} for agent in self.agents}
        return seen, rewards, ended, dict.fromkeys(self.agents, False), infos


class Least(Same):
    """The same with linear springs, looked at once a control period."""

    inner = False


def rows(runs: int) -> list[dict[str, str]]:
    """The lines of the table."""
    fleets = {threads: load_vector("velocity-sync", CHANGES, num_envs=COUNT, threads=threads)
              for threads in (1, 2)}  # fmt: skip
    kept = guarded(fleets[2], pull=10.0)
    agents = fleets[1].setting.system.agents
    numbers, start = agents.parameters[:, :5], fleets[1].setting.system.start
    loops: dict[str, Any] = {
        "drawn": Same(numbers, start, True), "same": Same(numbers, start),
        "least": Least(numbers, start),
        "single": load_pettingzoo("velocity-sync", CHANGES),
    }  # fmt: skip
    for each in (*fleets.values(), kept, *loops.values()):
        each.reset(seed=0)
    actions = {name: np.zeros(1) for name in loops["same"].agents}

    def vector(environment: FleetVectorEnv) -> float:
        action = np.zeros((COUNT, len(start)))
        began = time.perf_counter()
        for _ in range(STEPS):
            _, _, left, _, _ = environment.step(action)
        if np.any(left):
            raise ArithmeticError("an episode left its set")
        return 1e6 * (time.perf_counter() - began) / (STEPS * COUNT)

    def loop(name: str) -> float:
        environment = loops[name]
        if name in ("drawn", "same"):
            mujoco.set_mjcb_passive(environment.springs)
        began = time.perf_counter()
        for _ in range(FEWER):
            _, _, left, _, _ = environment.step(actions)
        spent = time.perf_counter() - began
        mujoco.set_mjcb_passive(None)
        if any(left.values()):
            raise ArithmeticError("an episode left its set")
        return 1e6 * spent / FEWER

    times = in_turns(
        {
            "ours": lambda: vector(fleets[2]), "one": lambda: vector(fleets[1]),
            "kept": lambda: vector(kept), **{name: (lambda n=name: loop(n)) for name in loops},
        },
        runs,
    )  # fmt: skip
    what = f"a step of an environment of 5 robots (10 integration steps), {COUNT} at once, us: "
    return [
        row(what + "2 threads / a PettingZoo loop over Python MuJoCo", times, "ours", "drawn",
            ">= 10", upside_down=True),
        row(what + "2 threads / the same loop with a model without shapes", times, "ours", "same",
            ">= 8", upside_down=True),
        row(what + "2 threads / that loop, linear springs, looked at once a period", times,
            "ours", "least", ">= 2", upside_down=True),
        row(what + "1 thread / 2 threads", times, "one", "ours", ">= 1.6"),
        row("the same of one fleet by PettingZoo, us: ours / a loop over Python MuJoCo, no shapes",
            times, "single", "same", "<= 0.5"),
        row(what + "2 threads, under the barrier / without", times, "kept", "ours", "<= 1.3"),
    ]  # fmt: skip
