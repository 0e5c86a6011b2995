"""Runs with observers of loads: slow pushes of any size, noise, springs that swing.

What a margin was made for is what the theorem says that an observer leaves. Estimates are held to
its bound at every recorded step, and outputs to the set at every control instant.
"""

import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from draws import progress

from gne_mj.controllers import FullInformation
from gne_mj.errors import InvalidInput
from gne_mj.faults import Noise, Push
from gne_mj.games import velocity_game
from gne_mj.load_margins import beyond_estimates
from gne_mj.loops import monitor as watch
from gne_mj.margins import Disturbance, with_margin
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.system import Clock, System

RUNS_A_JOB, COUNT, H, END = 25, 5, 0.002, 4.0
BROKEN = ("left at an instant", "estimates beyond the bound")


def campaign(runs: int, seed: int, processes: int) -> tuple[list[str], int]:
    """Lines that tell what came out, and how many promises were broken."""
    started, total, shares = time.perf_counter(), Counter[str](), list[float]()
    jobs = [(seed, job) for job in range(-(-runs // RUNS_A_JOB))]
    with ProcessPoolExecutor(processes) as pool:
        for counts, used in progress(pool.map(_job, jobs), len(jobs), "with loads"):
            total.update(counts)
            shares += used
    lines = [f"{key}: {total[key]}" for key in sorted(total)]
    if shares:
        most, middle = max(shares), float(np.median(shares))
        lines.append(f"estimates off by {middle:.0%} of the bound (median), {most:.0%} at most")
    lines.append(f"{time.perf_counter() - started:.0f} s")
    return lines, sum(total[key] for key in BROKEN)


def _job(job: tuple[int, int]) -> tuple[Counter[str], list[float]]:
    rng, counts, shares = np.random.default_rng(job), Counter[str](), list[float]()
    for _ in range(RUNS_A_JOB):
        try:
            system, clock, bound = _draw(rng)
        except InvalidInput:
            counts["refused"] += 1
            continue
        loop = system.closed_loop(clock)
        rows = loop.advance(clock.steps(clock.duration), 1)
        loop.finish()
        how = "inside"
        if loop.monitor.exit != watch.INSIDE:
            how = "left between instants only" if loop.monitor.exit_between > 0 else BROKEN[0]
        counts[how] += 1
        off = np.abs(rows.applied - rows.input - rows.memory[:, -COUNT:])
        shares.append(float(np.max(off / bound)))
        counts[BROKEN[1]] += shares[-1] > 1.0 + 1e-9
    return counts, shares


def _draw(rng: np.random.Generator) -> tuple[System, Clock, np.ndarray]:
    table = np.exp(rng.uniform(-1.2, 1.2, (COUNT, len(flexible_robot.PARAMETERS))))
    agents = Agents(flexible_robot, table, np.full(COUNT, np.inf))
    gain, steps = float(rng.choice([1.0, 0.5, 0.2])), int(rng.integers(1, 12))
    size, noise = float(np.exp(rng.uniform(0.0, 3.0))), 10.0 ** rng.uniform(-6, -4)
    periods = rng.uniform(2.0, 20.0, COUNT)
    faults = (
        *(
            Push(agents=(i,), force=size * rng.choice([-1, 1]), profile="sine", period=periods[i])
            for i in range(COUNT)
        ),
        Noise(amplitude=noise),
    )
    change = 2.0 * np.pi * size / periods * H * steps
    declared = Disturbance(np.zeros(COUNT), np.full(COUNT, noise), 0, change)
    bound = beyond_estimates(agents, H, "euler", steps, declared, gain)
    game = with_margin(velocity_game(COUNT, 3.0, 3.0), agents, bound, H, "euler", steps)
    y = 3.0 + np.cumsum(np.sqrt(9.0 - game.margins) * rng.uniform(-0.999, 0.999, COUNT))
    state = agents.equilibrium(y)
    state[:, 0] = rng.normal(size=COUNT)
    state[:, 2] += 3.0 * rng.normal(size=COUNT)
    span = H * steps
    system = System(
        "loads", game, agents, FullInformation(), 0.1, state, mode="implicit", integrator="euler",
        observer=gain, faults=faults, disturbance=declared, seed=int(rng.integers(2**31)),
    )  # fmt: skip
    return system, Clock(span * int(END / span), H, span, span), bound.push
