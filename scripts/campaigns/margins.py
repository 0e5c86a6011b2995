"""Runs under pushes, noise and delay within the bounds that a margin was made for."""

import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
from draws import progress

from gne_mj.controllers import FullInformation, PartialInformation
from gne_mj.errors import InvalidInput
from gne_mj.faults import Fault, Noise, Push, SensorDelay, sensor_delay
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.graph import ring
from gne_mj.loops import monitor as watch
from gne_mj.margins import Disturbance, with_margin
from gne_mj.plants import flexible_robot, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.scenario import load_scenario
from gne_mj.system import Clock, System
from gne_mj.theory import search_push
from gne_mj.theory.zero_order_hold import ZeroOrderHold

RUNS_A_JOB = 50
BROKEN = "left at an instant"
BROKEN_BY = (BROKEN, "ended without an action")
H = 0.002


def campaign(runs: int, seed: int, processes: int, guarded: bool = False) -> tuple[list[str], int]:
    """Lines that tell what came out, and how many runs left."""
    started, total = time.perf_counter(), Counter[str]()
    jobs = [(seed, job, guarded) for job in range(-(-runs // RUNS_A_JOB))]
    with ProcessPoolExecutor(processes) as pool:
        for counts in progress(pool.map(_job, jobs), len(jobs), "under disturbances"):
            total.update(counts)
    lines = [f"{key}: {total[key]}" for key in sorted(total)]
    lines.append(f"{time.perf_counter() - started:.0f} s")
    return lines, sum(n for key, n in total.items() if key.endswith(BROKEN_BY))


def _job(job: tuple[int, int, bool]) -> Counter[str]:
    *key, guarded = job
    rng, counts = np.random.default_rng(key), Counter[str]()
    kind = ("robots, MuJoCo", "robots, partial information", "channels")[key[1] % 3]
    plant: Any = None
    m = 10 if kind == "channels" else 5
    agents = _channels() if kind == "channels" else _robots(rng)
    while sum(n for name, n in counts.items() if "refused" not in name) < RUNS_A_JOB:
        try:
            system, clock = _draw(rng, kind, agents, m, guarded)
        except InvalidInput:
            counts[f"{kind}, refused (disturbances use up a bound)"] += 1
            continue
        if not ZeroOrderHold(system, clock).promised:
            counts[f"{kind}, refused (slope not certified)"] += 1
            continue
        late = sensor_delay(system.faults) > 0
        reuse = plant if not late else None  # another size of memory
        loop = system.closed_loop(clock, reuse)
        if system.engine == "mujoco" and not late:
            plant = loop.plant  # type: ignore[attr-defined]
        loop.advance(1, clock.steps(clock.duration))
        loop.finish()
        code, between = loop.monitor.exit, loop.monitor.exit_between > 0
        how = "inside"
        if code == watch.LEFT_SET:
            how = "left between instants only" if between and not guarded else BROKEN
        elif code != watch.INSIDE:
            how = "ended without an action"
        if how.endswith(BROKEN_BY):
            where = int(loop.monitor.exit_constraint), loop.monitor.exit_value
            print(key, sum(counts.values()), kind, how, code, loop.monitor.exit_time, where)
        counts[f"{kind}, {how}"] += 1
    return counts


def _robots(rng: np.random.Generator) -> Agents:
    table = np.exp(rng.uniform(-1.2, 1.2, (5, len(flexible_robot.PARAMETERS))))
    return Agents(flexible_robot, table, np.full(5, np.inf))


def _channels() -> Agents:
    return Agents(pi_cascade, np.tile([1.0, 0.5], (10, 1)), np.full(10, np.inf))


def _draw(
    rng: np.random.Generator, kind: str, agents: Agents, m: int, guarded: bool
) -> tuple[System, Clock]:
    channels = kind == "channels"
    push = 10.0 ** rng.uniform(-2, 0) if channels else 10.0 ** rng.uniform(-0.5, 1.3)
    noise = 10.0 ** rng.uniform(-5, -3 if channels else -1.7)
    delay, steps = int(rng.integers(0, 1 if guarded else 3)), int(rng.integers(1, 8))
    steps *= 4 if guarded else 1
    bound = Disturbance(np.full(m, push), np.full(m, noise), delay)
    game = osnr_game(**ten_channels()) if channels else velocity_game(5, 3.0, 3.0)
    game = with_margin(game, agents, bound, H, "euler", steps, guarded)
    if channels:
        room = np.min(game.margins[:10]), 2.5 - game.margins[10]
        share = rng.dirichlet(np.ones(11))[:10] * 0.98
        y = room[0] * 1.02 + (room[1] - 10.3 * room[0]) * share
        if np.any(game.constraints(y) + game.margins >= 0):
            raise InvalidInput("margin", push, "no room")
        state = agents.equilibrium(y)
    else:
        gaps = np.sqrt(9.0 - game.margins) * rng.uniform(-0.999, 0.999, 5)
        y = 3.0 + np.cumsum(gaps)
        state = agents.equilibrium(y)
        state[:, 2] += rng.uniform(-5, 5, 5)
    period = H * steps
    law = PartialInformation(ring(5), 1.0, 0.1) if "partial" in kind else FullInformation()
    return System(
        "run", game, agents, law, 10.0 ** rng.uniform(-3, 0), state, mode="implicit",
        integrator="euler", engine="mujoco" if "MuJoCo" in kind else "ode",
        memory=law.initial_memory(y), faults=tuple(_faults(rng, push, noise, delay, period, m)),
        seed=int(rng.integers(2**31)), disturbance=bound,
        between="guarded" if guarded else "watched",
    ), Clock(150 * period, H, period, 150 * period)  # fmt: skip


def _faults(
    rng: np.random.Generator, push: float, noise: float, delay: int, period: float, m: int
) -> Iterator[Fault]:
    profile = str(rng.choice(["constant", "square", "sine", "random"]))
    for i in range(m):
        yield Push(
            agents=(i,), force=push * rng.choice([-1.0, 1.0]), profile=profile,
            period=period * int(rng.integers(1, 40)),
        )  # fmt: skip
    yield Noise(amplitude=noise)
    if delay:
        yield SensorDelay(periods=int(rng.integers(0, delay + 1)))


def ratios() -> list[str]:
    """The certified push beside the smallest that an adversary finds to break the robots' run."""
    lines = []
    for period in (0.002, 0.01, 0.05):
        for push in (1.0, 2.0, 5.0, 10.0):
            scenario = load_scenario(
                "velocity-sync",
                {
                    "controller.mode": "implicit", "plant.integrator": "euler",
                    "simulation.control_period": period, "simulation.duration": 5.0,
                    "margin": {"push": push},
                },
            )  # fmt: skip
            try:
                (system,) = scenario.system_objects()
            except InvalidInput as error:
                lines.append(f"| {period:g} | {push:g} | refused: {error.expected} | |")
                continue
            clock = scenario.clock()
            certified = ZeroOrderHold(system, clock).largest_push() or 0.0
            found = search_push(replace(system, engine="ode"), clock)
            least = found.smallest_breaking_push
            shown = "none" if least is None else f"{least:.4g}"
            ratio = "" if least is None else f"{certified / least:.0%}"
            lines.append(f"| {period:g} | {certified:.4g} | {shown} | {ratio} |")
    return lines
