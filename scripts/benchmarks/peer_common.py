"""What the comparisons with peers written in JAX share: JAX's settings, five robots, turns.

Import it before anything that makes JAX choose its devices, as importing cbfpy and MJX does. JAX
gets as many CPU devices as there are cores, since XLA spreads a batch of so small steps over cores
only when it is told to (:func:`over_cores`); double precision; and one
thread per operation, as cbfpy recommends and as none of these operations is large enough for more.
"""

import os
import time
from collections.abc import Callable
from typing import Any

import jax
import numpy as np

from gne_mj.batches.structure import Structure
from gne_mj.controllers import FullInformation
from gne_mj.games import velocity_game
from gne_mj.loops import monitor as watch
from gne_mj.loops.batch import Case, Span
from gne_mj.plants import flexible_robot
from gne_mj.plants.agents import Agents
from gne_mj.system import Clock, System

N, V0, DELTA, RHO = 5, 3.0, 3.0, 0.1
CORES = len(os.sched_getaffinity(0))


def _set_up() -> None:
    flag = "--xla_cpu_multi_thread_eigen=false"
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_cpu_multi_thread_eigen" not in flags:
        os.environ["XLA_FLAGS"] = f"{flags} {flag}".strip()
    os.environ.setdefault("JAX_ENABLE_X64", "1")  # cbfpy looks there
    jax.config.update("jax_enable_x64", True)
    try:
        jax.config.update("jax_num_cpu_devices", CORES)
    except RuntimeError:  # the devices are there already: one, in a test process
        return


_set_up()


def system(engine: str, integrator: str, mode: str) -> System:
    """The paper's five robots (all their numbers 1) under full information."""
    agents = Agents(
        flexible_robot, np.ones((N, len(flexible_robot.PARAMETERS))), np.full(N, np.inf)
    )
    return System(
        "robots", velocity_game(N, V0, DELTA), agents, FullInformation(), RHO,
        agents.equilibrium(V0 - np.linspace(0.0, 2.0, N)),
        engine=engine, integrator=integrator, mode=mode,
    )  # fmt: skip


def starts(runs: int, widest: float = 0.9, stretch: float = 1.0) -> np.ndarray:
    """(runs, 5, 4) states: gaps up to ``widest`` of their bounds, springs stretched or pressed.

    By up to ``stretch`` in m, at rates up to so many m/s.
    """
    rng = np.random.default_rng(0)
    velocity = V0 + np.cumsum(rng.uniform(-widest * DELTA, widest * DELTA, (runs, N)), axis=1)
    extension, slip = stretch * rng.uniform(-1.0, 1.0, (2, runs, N))
    return np.stack([extension, velocity, velocity + slip, np.zeros((runs, N))], axis=2)


def _call(one: System, clock: Clock, states: np.ndarray) -> Callable[[], Any]:
    """What moves all runs to the clock's end by our native batch on all cores."""
    structure = Structure(one, clock, CORES)
    table = structure.parameter_block(one, one.setup(clock))
    cases = [
        Case(state, one.loop_memory, one.agents.parameters, table, one.closed_loop)
        for state in states
    ]
    span = Span(clock.steps(clock.duration), clock.steps(clock.duration))
    return lambda: structure.loop.run(cases, span, lambda: False)


def ours(one: System, clock: Clock, states: np.ndarray) -> Callable[[], tuple[float, np.ndarray]]:
    """What moves all runs to the clock's end by our native batch on all cores, as often as called.

    It returns the seconds, from putting the starts into their rows to the last observation, and the
    last states (runs, N, 4).
    """
    run = _call(one, clock, states)

    def call() -> tuple[float, np.ndarray]:
        began = time.perf_counter()
        outcome = run()
        spent = time.perf_counter() - began
        if outcome is None or np.any(outcome.monitors.exit != watch.INSIDE):
            raise ArithmeticError("a run left the set, where the law has no value to compare")
        return spent, outcome.samples.state[:, -1]

    return call


def undivided(one: System, clock: Clock, states: np.ndarray, runs: int) -> np.ndarray:
    """The first of these starts whose runs divide no step, so that others take the same ones."""
    monitors = _call(one, clock, states)().monitors
    found = states[(monitors.divided == 0) & (monitors.exit == watch.INSIDE)][:runs]
    if len(found) < runs:
        raise ArithmeticError(f"only {len(found)} of {len(states)} runs divide no step")
    return found


def over_cores(one: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of one run for a batch of them, each device taking its share of the rows.

    How many rows there are must be a multiple of the devices.
    """
    mesh = jax.make_mesh((len(jax.devices()),), ("runs",), (jax.sharding.AxisType.Auto,))
    rows = jax.sharding.PartitionSpec("runs")
    batch = jax.shard_map(jax.vmap(one), mesh=mesh, in_specs=rows, out_specs=rows, check_vma=False)
    return jax.jit(batch)


def seconds(call: Callable[[], Any]) -> float:
    """Of one call, until its result is there."""
    began = time.perf_counter()
    jax.block_until_ready(call())
    return time.perf_counter() - began
