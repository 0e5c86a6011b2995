#!/usr/bin/env python
"""The closed loop of many runs beside MJX, MuJoCo in JAX, on the CPU with all its cores.

Five robots, full information, mode sampled with a control period of one step of 1 ms: the law acts
at a step's start and is held, while the spring's atan term is evaluated wherever the integrator
evaluates forces. MJX has no callbacks: the law is ``ctrl``, the atan term ``qfrc_applied``, both
in jax.numpy. MJX's own RK4 would hold ``qfrc_applied`` over a step, so that for RK4 the stages are
written around ``mjx.forward``, which takes about as long as ``mjx.step`` with RK4. Runs are
vmapped, steps scanned. All final velocities must agree with our loop's before anything is timed.

What favours MJX is used, found by ``--settings``: a model without what is for the eye only, in
which contacts and constraints are disabled; a sparse inertia matrix (a dense one, which is MJX's
choice for so few robots, costs a third more, and with 1024 runs under RK4 on one device of two
cores it never returned); one device per core, with its share of the batch, of a size that fits into
the caches; only positions and velocities carried from step to step. Compiling is not counted.
Ours also watches the bounds and the Lyapunov function at every step, which MJX does not.
"""

import argparse
import copy
import io
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, redirect_stdout
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import peer_common as common
from turns import in_turns, row

from gne_mj.plants.callbacks import callbacks
from gne_mj.plants.fleet import compile_model, compose
from gne_mj.plants.mujoco import run_steps
from gne_mj.plants.native_mujoco import step_address
from gne_mj.system import Clock

with redirect_stdout(io.StringIO()):  # it says there that it finds no GPU's library
    from mujoco import mjx

H = 1e-3
RUNS = 256
STEPS = {"euler": 500, "rk4": 125}  # a turn of either side takes less than 1 s
INTEGRATORS = {"euler": "Euler", "rk4": "RK4"}
ACCURACY = {64: 1e-10, 32: 1e-4}  # m/s, by the precision in bits


def law(y: jax.Array) -> jax.Array:
    """The inputs of all robots: gradients of cost and barrier at the velocities y (N,)."""
    gap = jnp.diff(y, prepend=common.V0)
    slope = 2.0 * common.RHO * gap / (common.DELTA**2 - gap**2)
    return -2.0 * gap - slope + jnp.append(slope[1:], 0.0)


def spring(qpos: jax.Array) -> jax.Array:
    """The atan terms; main mass and appendage alternate."""
    pull = jnp.arctan(qpos[0::2] - qpos[1::2])
    return jnp.stack([-pull, pull], axis=1).ravel()


@dataclass(frozen=True)
class Batch:
    """Many runs in MJX, compiled for one number of steps.

    Args:
        integrator: "euler" or "rk4".
        steps: of each run.
        bits: of the numbers, 64 or 32.
        decorated, sparse, unroll, whole: settings; by default the fastest ones. ``whole`` carries
            all of MJX's data from step to step.
    """

    integrator: str
    steps: int
    bits: int = 64
    decorated: bool = False
    sparse: bool = True
    unroll: int = 1
    whole: bool = False

    def precision(self) -> AbstractContextManager[Any]:
        """Within which to trace and call."""
        return jax.enable_x64(self.bits == 64)

    @cached_property
    def compiled(self) -> Callable[[jax.Array, jax.Array], Any]:
        """From the starts (runs, 2N) of qpos and qvel to the last velocities (runs, N)."""
        model = compile_model(
            compose(np.ones((common.N, 5)), decorated=self.decorated),
            timestep=H,
            integrator=INTEGRATORS[self.integrator],
        )
        kind = mujoco.mjtJacobian
        model.opt.jacobian = kind.mjJAC_SPARSE if self.sparse else kind.mjJAC_DENSE
        on_device = mjx.put_model(model)
        blank = mjx.make_data(on_device)

        def euler(data: Any) -> Any:
            data = data.replace(ctrl=law(data.qvel[0::2]), qfrc_applied=spring(data.qpos))
            return mjx.step(on_device, data)

        def rk4(data: Any) -> Any:
            q, v = data.qpos, data.qvel
            data = data.replace(ctrl=law(v[0::2]))

            def stage(q: jax.Array, v: jax.Array) -> Any:
                there = data.replace(qpos=q, qvel=v, qfrc_applied=spring(q))
                return mjx.forward(on_device, there)

            first = stage(q, v)
            a1, v2 = first.qacc, v + 0.5 * H * first.qacc
            a2 = stage(q + 0.5 * H * v, v2).qacc
            v3 = v + 0.5 * H * a2
            a3 = stage(q + 0.5 * H * v2, v3).qacc
            v4 = v + H * a3
            a4 = stage(q + H * v3, v4).qacc
            return first.replace(
                qpos=q + H / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4),
                qvel=v + H / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4),
                time=data.time + H,
            )

        step = {"euler": euler, "rk4": rk4}[self.integrator]

        def whole(data: Any, _: None) -> tuple[Any, None]:
            moved = step(data)  # MJX makes some of its integers longer under 64 bits
            return jax.tree.map(lambda new, old: new.astype(old.dtype), moved, data), None

        def thin(carry: Any, _: None) -> tuple[Any, None]:
            data = step(blank.replace(qpos=carry[0], qvel=carry[1]))
            return (data.qpos, data.qvel), None

        def one(qpos: jax.Array, qvel: jax.Array) -> jax.Array:
            length, unroll = self.steps, self.unroll
            if self.whole:
                start = blank.replace(qpos=qpos, qvel=qvel)
                return jax.lax.scan(whole, start, None, length, unroll=unroll)[0].qvel[0::2]
            return jax.lax.scan(thin, (qpos, qvel), None, length, unroll=unroll)[0][1][0::2]

        return common.over_cores(one)

    def run(self, states: np.ndarray) -> Callable[[], tuple[float, np.ndarray]]:
        """What moves all runs once: seconds and last velocities."""
        position = states[:, :, 3]
        real = np.float64 if self.bits == 64 else np.float32
        q = np.stack([position, position - states[:, :, 0]], axis=2).reshape(len(states), -1)
        v = states[:, :, 1:3].reshape(len(states), -1)
        with self.precision():
            start = [jnp.asarray(part.astype(real)) for part in (q, v)]
            compiled = self.compiled

        def call() -> tuple[float, np.ndarray]:
            with self.precision():
                began = time.perf_counter()
                last = compiled(*start).block_until_ready()
                return time.perf_counter() - began, np.asarray(last)

        return call


def ours(integrator: str, steps: int, states: np.ndarray) -> Callable[[], tuple[float, np.ndarray]]:
    """The same of our batch: seconds and last velocities (runs, N)."""
    one = common.system("mujoco", integrator, "sampled")
    call = common.ours(one, Clock(H * steps, H, H, H * steps), states)

    def velocities() -> tuple[float, np.ndarray]:
        spent, last = call()
        return spent, last[:, :, 1]

    return velocities


def alone(integrator: str, steps: int, states: np.ndarray) -> Callable[[], float]:
    """Seconds of nothing but mj_step for all runs, on threads: no law, no springs' atan terms.

    Models are as our batches have them, and MuJoCo's stopwatch stands still.
    """
    lane = compose(np.ones((common.N, 5)), decorated=False)
    model = compile_model(lane, timestep=H, integrator=INTEGRATORS[integrator])
    move, mj_step, places = run_steps(), step_address(), iter(())

    def work(_thread: int) -> None:
        own = copy.copy(model)
        data = mujoco.MjData(own)
        for state in places:
            mujoco.mj_resetData(own, data)
            data.qpos[0::2], data.qpos[1::2] = state[:, 3], state[:, 3] - state[:, 0]
            data.qvel[0::2], data.qvel[1::2] = state[:, 1], state[:, 2]
            move(mj_step, own._address, data._address, steps)

    def call() -> float:
        nonlocal places
        places, began = iter(states), time.perf_counter()
        with callbacks(), ThreadPoolExecutor(common.CORES) as pool:
            list(pool.map(work, range(common.CORES)))
        return time.perf_counter() - began

    return call


def rows(runs: int = 20) -> list[dict[str, str]]:
    """Medians over ``runs`` turns; microseconds per step of one run."""
    return [line for integrator in STEPS for line in _rows(integrator, runs)]


def _rows(integrator: str, turns: int) -> list[dict[str, str]]:
    steps, states = STEPS[integrator], common.starts(RUNS)
    mine, scale = ours(integrator, steps, states), 1e6 / (RUNS * steps)
    _, expected = mine()
    calls: dict[str, Callable[[], float]] = {"ours": lambda: scale * mine()[0]}
    errors = {}
    for bits, bound in ACCURACY.items():
        run = Batch(integrator, steps, bits).run(states)
        errors[bits] = float(np.max(np.abs(run()[1] - expected)))
        if not errors[bits] <= bound:
            raise ArithmeticError(f"MJX, {bits} bits: velocities differ by {errors[bits]:.1e} m/s")
        calls[f"{bits}"] = lambda run=run: scale * run()[0]
    bare = alone(integrator, steps, states)
    calls["mj_step"] = lambda: scale * bare()
    times = in_turns(calls, turns)
    what = (
        f"5 robots, {integrator}, full information, sampled, {RUNS} runs of {steps} steps: us per"
        f" step and run, on {len(jax.devices())} cores; MJX float"
    )
    return [
        row(
            f"{what}{bits} (equal within {errors[bits]:.0e} m/s) / {meaning}",
            times, ours, f"{bits}", goal, upside_down=True,
        )
        for bits in ACCURACY
        for meaning, ours, goal in (
            ("our batch", "ours", ">= 1.05"), ("mj_step alone, without any law", "mj_step", ""),
        )
    ]  # fmt: skip


def settings() -> None:
    """Print what MJX takes under other settings than those of the rows.

    In time of the processors divided by their number, which other work on the machine hardly
    disturbs; those that wait for each other take longer than that.
    """
    for integrator, steps in (("euler", 100), ("rk4", 25)):
        cases: list[tuple[str, int, dict[str, Any]]] = [
            ("as in the rows", RUNS, {}),
            *((f"{runs} runs", runs, {}) for runs in (2, 64, 128, 512, 1024, 4096)),
            ("steps unrolled by 2", RUNS, {"unroll": 2}),
            ("steps unrolled by 4", RUNS, {"unroll": 4}),
            ("all data carried", RUNS, {"whole": True}),
            ("decorated", RUNS, {"decorated": True}),
            ("dense inertia", RUNS, {"sparse": False}),
            ("dense, decorated, all carried", RUNS,
             {"sparse": False, "decorated": True, "whole": True}),
            ("float32", RUNS, {"bits": 32}),
        ]  # fmt: skip
        for name, count, options in cases:
            run = Batch(integrator, steps, **options).run(common.starts(count))
            run()
            began = time.process_time()
            for _ in range(10):
                run()
            spent = (time.process_time() - began) / (10 * len(jax.devices()))
            print(f"{integrator}, {name}: {1e6 * spent / (count * steps):.2f} us", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--settings", action="store_true", help="compare MJX's settings")
    if parser.parse_args().settings:
        settings()
    else:
        for line in rows():
            print(*line.values(), sep="  ")
