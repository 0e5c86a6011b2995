"""Compiling ahead what first runs would compile: loops, solvers and the shipped games and laws.

Machine code is made where it is first needed and kept on disk (:mod:`gne_mj.machine_code`). Here
one short run of each kind is made in processes beside each other, so that no later run of these
kinds compiles anything, and one of a game, an agent or a law of one's own that only.
"""

import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from typing import Any

import numpy as np

from gne_mj.scenario import load_scenario, shipped

STEPS = 3  # of each run
_ODE, _RING = {"plant.engine": "ode"}, {"controller.graph": "ring"}
_PARTIAL = {"controller.information": "partial", **_RING}
_DISTRIBUTED = {"controller.information": "distributed", "controller.epsilon": 0.1, **_RING}
_SAMPLED = {"controller.mode": "sampled"}
_IMPLICIT = {"controller.mode": "implicit"}

# Besides the shipped scenarios as they are: kinds of runs that none of them is
OTHERS: tuple[dict[str, Any], ...] = (
    _IMPLICIT,
    {**_IMPLICIT, **_ODE},
    {**_PARTIAL, **_IMPLICIT, "controller.decentralised": True},
    _PARTIAL,
    {**_PARTIAL, **_ODE},
    _DISTRIBUTED,
    _SAMPLED,
)


def runs() -> list[tuple[str, dict[str, Any]]]:
    """What is run: scenarios, each with what is changed in it."""
    return [*(("velocity-sync", each) for each in OTHERS), *((name, {}) for name in shipped())]


def batches() -> list[tuple[str, dict[str, Any]]]:
    """What is run as a batch besides, since its loop takes eight runs at once: likewise."""
    long = {"simulation.timestep": 0.01, "simulation.duration": 30.0, "recording.period": 1.0}
    return [("velocity-sync", {**_ODE, **long})]


def precompile(processes: int | None = None) -> Iterator[str]:
    """Compile what :func:`runs` and :func:`batches` need; yield each one's scenario when done.

    Args:
        processes: that compile beside each other; as many as there are processors if left out.
    """
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes or os.cpu_count(), spawn) as pool:
        jobs = [
            *(pool.submit(_run_batch, *each) for each in batches()),
            *(pool.submit(_run, *each) for each in runs()),
        ]
        for done in as_completed(jobs):
            yield done.result()


def _run(scenario: str, changes: dict[str, Any]) -> str:
    simulation = load_scenario(scenario, changes).simulation_object()
    simulation.advance(STEPS)
    simulation.trajectory()
    simulation.doubts()
    for run in simulation.runs.values():  # what gne_mj.not_reached asks of runs that do not settle
        plant: Any = getattr(run.loop, "plant", None)
        if hasattr(plant, "twin"):
            plant.twin().step(np.zeros(run.system.agents.channels))
    return scenario


def _run_batch(scenario: str, changes: dict[str, Any]) -> str:
    from gne_mj.batches import make_plan
    from gne_mj.batches.chunk import Runner
    from gne_mj.loops.ode_batch import LEAST

    plan = make_plan(scenario, changes)
    steps = round(changes["simulation.duration"] / changes["simulation.timestep"])
    plan = replace(plan, starts=-(-LEAST // steps), chunk=LEAST)
    Runner(plan, 1).run(0)
    return scenario
