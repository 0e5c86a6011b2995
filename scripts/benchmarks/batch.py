"""Batches against bare ``mujoco.batch.Batch``, threads against one, twins, recording, a script.

Five robots, full information, mode continuous; random interior starts. A turn runs every case to
its end, from putting starts into rows to the last observation, without building the plan.
"""

import time
from collections.abc import Callable
from contextlib import nullcontext
from functools import partial

import mujoco
import numpy as np
from fleet import Script
from mujoco.batch import Batch
from turns import in_turns, row

from gne_mj.batches import make_plan
from gne_mj.batches.chunk import Runner
from gne_mj.loops.batch import Span
from gne_mj.plants.callbacks import callbacks
from gne_mj.plants.fleet import compile_model, compose

RUNS, STEPS, H = 1024, 100, 0.01
FEWER = 512  # runs, where two engines or numbers of threads are compared
INTEGRATORS = {"euler": "Euler", "rk4": "RK4"}


class Ours:
    """A batch of ours, ready to run again and again."""

    def __init__(
        self, runs: int, threads: int, engine: str = "mujoco", integrator: str = "rk4",
        mode: str = "continuous",
    ) -> None:  # fmt: skip
        changes = {
            "simulation.timestep": H, "simulation.duration": H * STEPS,
            "simulation.integrator": integrator, "recording.period": H * 10,
            "plant.engine": engine, "controller.mode": mode,
        }  # fmt: skip
        plan = make_plan("velocity-sync", changes, starts=runs, chunk=runs)
        runner = Runner(plan, threads)
        prepared, starts = next(runner._entries(0))
        self.cases = list(runner._cases(prepared, starts))
        self.loop = runner._structure(prepared).loop

    def run(self, steps: int = STEPS, every: int | None = None) -> float:
        """Seconds for all runs; a row of everything each ``every`` steps, else the last only."""
        span = Span(steps, every or steps)
        began = time.perf_counter()
        outcome = self.loop.run(self.cases, span, lambda: False)
        spent = time.perf_counter() - began
        if outcome is None or np.any(np.isnan(outcome.samples.input[:, -1])):
            raise ArithmeticError("a run left its set")
        return spent


class Bare:
    """The same model and starts, stepped by MuJoCo alone: no law, and springs without atan."""

    def __init__(
        self, ours: Ours, threads: int, integrator: str = "rk4", *, decorated: bool = True
    ) -> None:
        numbers = ours.cases[0].parameters
        model = compile_model(
            compose(numbers, decorated=decorated), timestep=H, integrator=INTEGRATORS[integrator]
        )
        self.start = np.stack([case.state for case in ours.cases])
        self.batch = Batch(model, len(self.start), threads)

    def run(self, steps: int = STEPS, *, timed: bool = True) -> float:
        """Seconds for all runs; ``timed`` with MuJoCo's own stopwatch, as anybody has it."""
        with nullcontext() if timed else callbacks():
            began = time.perf_counter()
            self.batch.reset(stage=int(mujoco.mjtStage.mjSTAGE_NONE))
            velocity = self.batch.bind("qvel")
            velocity[:, 0::2], velocity[:, 1::2] = self.start[:, :, 1], self.start[:, :, 2]
            self.batch.step(nstep=steps)
            return time.perf_counter() - began


def rows(turns: int = 20) -> list[dict[str, str]]:
    """The table's lines; times are microseconds per run and step, of all threads together."""
    return [*_bare(turns), *_threads(turns), *_twins(turns), *_script(turns)]


def _per_step(run: Callable[[], float], runs: int, steps: int = STEPS) -> Callable[[], float]:
    return lambda: 1e6 * run() / (runs * steps)


def _bare(turns: int) -> list[dict[str, str]]:
    found = []
    for integrator in INTEGRATORS:
        ours = Ours(RUNS, 2, integrator=integrator)
        bare = Bare(ours, 2, integrator)
        plain = Bare(ours, 2, integrator, decorated=False)
        kinds = {
            "ours": _per_step(ours.run, RUNS),
            "bare": _per_step(bare.run, RUNS),
            "plain": _per_step(partial(plain.run, timed=False), RUNS),
            "recorded": _per_step(lambda ours=ours: ours.run(every=10), RUNS),
        }
        times = in_turns(kinds, turns)
        what = f"batch of {RUNS} runs x 5 robots, {integrator}, 2 threads: us per run and step"
        for meaning, one, other, target in (
            ("ours / Batch.step of the same robots", "ours", "bare", "<= 1.10"),
            (
                "ours / Batch.step without decoration and stopwatch, as ours has it",
                "ours",
                "plain",
                "",
            ),
            ("every 10th step recorded / summaries only", "recorded", "ours", "<= 1.15"),
        ):
            found.append(row(f"{what}; {meaning}", times, one, other, target))
    return found


def _threads(turns: int) -> list[dict[str, str]]:
    runs = FEWER
    found = []
    for engine, name in (("mujoco", "MuJoCo"), ("ode", "ODE twin")):
        one, two = Ours(runs, 1, engine), Ours(runs, 2, engine)
        kinds = {"one": _per_step(one.run, runs), "two": _per_step(two.run, runs)}
        bare = (
            {threads: Bare(one, threads, decorated=False) for threads in (1, 2)}
            if engine == "mujoco"
            else {}
        )
        for threads, batch in bare.items():
            kinds[f"bare {threads}"] = _per_step(batch.run, runs)
        times = in_turns(kinds, turns)
        what = f"batch of {runs} runs, {name}, rk4: us per run and step; 1 thread / 2 threads"
        found.append(row(what, times, "two", "one", ">= 1.8", upside_down=True))
        if bare:
            what = "the same of Batch.step alone"
            found.append(row(what, times, "bare 2", "bare 1", "", upside_down=True))
    return found


def _twins(turns: int) -> list[dict[str, str]]:
    runs = FEWER
    mujoco_, ode = Ours(runs, 2), Ours(runs, 2, "ode")
    last = [each.loop.run(each.cases, Span(STEPS, STEPS), lambda: False) for each in (mujoco_, ode)]
    apart = np.max(np.abs(last[0].samples.state - last[1].samples.state))
    if apart > 1e-11:
        raise ArithmeticError(f"the engines are {apart:g} apart")
    kinds = {"mujoco": _per_step(mujoco_.run, runs), "ode": _per_step(ode.run, runs)}
    times = in_turns(kinds, turns)
    what = "ODE twin of five robots, rk4, 2 threads, the same states to 1e-11: us per run and step"
    return [row(f"{what}; MuJoCo / ODE", times, "ode", "mujoco", ">= 10", upside_down=True)]


def _script(turns: int) -> list[dict[str, str]]:
    """A loop over runs as one would write it: the law by NumPy, the atan spring by Python."""
    found = []
    for integrator, target in (("euler", ">= 8"), ("rk4", "")):
        runs, steps = 512, 100
        ours = Ours(runs, 2, integrator=integrator, mode="sampled")
        model = compile_model(
            compose(ours.cases[0].parameters), timestep=H, integrator=INTEGRATORS[integrator]
        )
        scripts = [Script(model, case.state[:, 1]) for case in ours.cases[:4]]
        kinds = {
            "ours": _per_step(lambda ours=ours: ours.run(100), runs, steps),
            "script": _per_step(
                lambda scripts=scripts: sum(script.run(100) for script in scripts), 4, steps
            ),
        }
        times = in_turns(kinds, turns)
        what = f"batch on 2 threads, {integrator}, law once a step: us per run and step"
        found.append(row(f"{what}; Python loop over runs / ours", times, "ours", "script", target,
                         upside_down=True))  # fmt: skip
    return found


if __name__ == "__main__":
    for line in rows():
        print(*line.values(), sep="  ")
