#!/usr/bin/env python
"""One control of five robots: our law beside cbfpy's safety filter, and what both keep.

The filter is cbfpy's CBF: of all inputs for which h' >= -h holds for the five
h_i = delta_i^2 - gap_i^2, the one nearest to a nominal one, the cost gradient without barrier,
u_i = -2 gap_i. It knows the whole state and the robots' equations; our law reads the velocities
alone, and each robot only its own and its neighbours'. Both are measured as one call from Python,
with arrays handed in and out, and inside a loop that is compiled as a whole, where nothing but the
control is evaluated, at outputs that move a little each time. cbfpy is measured with both of its
solvers: qpax, its default, in JAX, and elastiqp, in C++. Compiled and warm, in double precision and
with the settings that it recommends. Our law `cbf-filter` solves the same program, and finds the
same input as elastiqp to 1e-12, which is looked at first.

What is kept is no measurement of time: from 200 starts with gaps up to 0.999 of their bounds, and
springs stretched or pressed by up to 5 or 20 m, the robots' ODE (Runge-Kutta 4, 1 ms) is run for
2 s with inputs held over a control period. Neither the filter, whose condition holds at the control
instants only and is relaxed by a penalty, nor our mode sampled promises anything there; mode
implicit does, at the control instants (at every step, if it is guarded), and is held to it. Our
runs end when they leave, those of the filter go on.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import peer_common as common
from cbfpy import CBF, CBFConfig
from numba import njit
from turns import in_turns, row

from gne_mj.controllers import CbfFilter, FullInformation, Law
from gne_mj.controllers.propagation import no_propagator
from gne_mj.loops import monitor as watch
from gne_mj.loops.feedback import Problem, feedback
from gne_mj.loops.layout import LoopClock as Steps
from gne_mj.loops.layout import (
    Setup,
    loop_workspace_in,
    loop_workspace_length,
    ode_parameter_block,
    parts_in,
    steps_in,
    steps_of,
)
from gne_mj.loops.ode import CONTINUOUS
from gne_mj.plants.functions import EULER
from gne_mj.system import Clock

# What they are to cbfpy, and the tolerance: qpax's default, and what it advises for elastiqp
SOLVERS = {"elastiqp": ("its fastest", 1e-5), "qpax": ("its default", 1e-3)}
CALLS, EVALUATIONS = 200, 2000
NUDGE = 1e-9  # how far outputs move in between, so that no evaluation can be left out
H, END, RUNS, WIDEST = 1e-3, 2.0, 200, 0.999
STRETCHES, PERIODS = (5.0, 20.0), (0.001, 0.02, 0.1)
MODES = ("implicit", "implicit, guarded", "sampled")


class Robots(CBFConfig):
    """The robots' equations, state (5, 3) made flat, and the bounds of their velocity gaps."""

    def __init__(self, solver: str) -> None:
        super().__init__(n=3 * common.N, m=common.N, backend=solver, solver_tol=SOLVERS[solver][1])

    def f(self, z: Any) -> jax.Array:
        """Rates without inputs."""
        extension, velocity, appendage = z.reshape(common.N, 3).T
        pull = extension + jnp.arctan(extension) + velocity - appendage
        return jnp.stack([velocity - appendage, -pull, pull], axis=1).ravel()

    def g(self, z: Any) -> jax.Array:
        """What an input does to the rates: it pushes the main mass, of 1 kg."""
        return jnp.zeros((3 * common.N, common.N)).at[1::3].set(jnp.eye(common.N))

    def h_1(self, z: Any) -> jax.Array:
        """Positive inside."""
        return common.DELTA**2 - _gaps(z) ** 2


def _gaps(z: Any) -> jax.Array:
    return jnp.diff(z[1::3], prepend=common.V0)


def law(solver: str) -> Callable[[jax.Array], jax.Array]:
    """The filtered control at a state."""
    barrier = CBF.from_config(Robots(solver))
    return lambda z: barrier.safety_filter(z, -2.0 * _gaps(z))


def filter_calls(solver: str) -> tuple[Callable[[], float], Callable[[], float]]:
    """Seconds of one control: called from Python, and in a compiled loop."""
    control = law(solver)
    called = jax.jit(control)
    state = _some_state()
    start = jnp.asarray(state)

    def turn(z: jax.Array, _: None) -> tuple[jax.Array, None]:
        return z.at[1::3].add(NUDGE * control(z)), None

    loop = jax.jit(lambda z: jax.lax.scan(turn, z, None, length=EVALUATIONS)[0])

    def from_python() -> float:
        began = time.perf_counter()
        for _ in range(CALLS):
            called(state).block_until_ready()
        return (time.perf_counter() - began) / CALLS

    def in_loop() -> float:
        began = time.perf_counter()
        loop(start).block_until_ready()
        return (time.perf_counter() - began) / EVALUATIONS

    return from_python, in_loop


def by_hand() -> np.ndarray:
    """u (5,) of our law at that state."""
    gap = np.diff(_some_state()[1::3], prepend=common.V0)
    slope = 2.0 * common.RHO * gap / (common.DELTA**2 - gap**2)
    return -2.0 * gap - slope + np.append(slope[1:], 0.0)


def our_calls(law: Law, right: np.ndarray) -> tuple[Callable[[], float], Callable[[], float]]:
    """The same of a law of ours, by the kernels that all our loops call; ``right`` is its input."""
    one = replace(common.system("ode", "rk4", "sampled"), law=law)
    n = common.N
    state = np.column_stack([_some_state().reshape(n, 3), np.zeros(n)]).ravel()
    problem = Problem(
        one.game.data, one.law.graph_data, one.law.settings(common.RHO), np.full(n, np.inf),
        one.equilibrium.action, no_propagator(), functions=one.functions,
        model=one.plant_model,
    )  # fmt: skip
    setup = Setup(problem, one.state, Steps(1.0, 1, CONTINUOUS, EULER))
    parameter_block = ode_parameter_block(setup, one.agents, 0)
    address, memory, state_address = parameter_block.address, np.zeros(0), state.ctypes.data
    room = np.zeros(loop_workspace_length(steps_of(parameter_block)))
    start, u = np.ascontiguousarray(_some_state()[1::3]), np.zeros(n)

    @njit(error_model="numpy", _nrt=False)
    def control(parameter_block, room, y, memory, u):
        parts = parts_in(parameter_block, loop_workspace_in(room, steps_in(parameter_block)))
        parts.work.now.state = state_address
        return feedback(parts.problem, 0.0, 0, y, memory, parts.work, parts.monitor, u)

    @njit(error_model="numpy", _nrt=False)
    def loop(parameter_block, room, y, memory, u, count):
        parts = parts_in(parameter_block, loop_workspace_in(room, steps_in(parameter_block)))
        parts.work.now.state = state_address
        for _ in range(count):
            feedback(parts.problem, 0.0, 0, y, memory, parts.work, parts.monitor, u)
            for r in range(len(y)):
                y[r] += NUDGE * u[r]

    control(address, room, start, memory, u)
    if not np.allclose(u, right, rtol=1e-12, atol=1e-12):
        raise ArithmeticError("our law is not what is meant to be measured")

    def from_python() -> float:
        assert parameter_block.arrays
        assert len(state)  # which the law knows by address
        began = time.perf_counter()
        for _ in range(CALLS):
            control(address, room, start, memory, u)
        return (time.perf_counter() - began) / CALLS

    def in_loop() -> float:
        assert parameter_block.arrays  # which the problem knows by address
        y, count = start.copy(), 50 * EVALUATIONS
        began = time.perf_counter()
        loop(address, room, y, memory, u, count)
        return (time.perf_counter() - began) / count

    return from_python, in_loop


def _some_state() -> np.ndarray:
    """Gaps near enough to their bounds for the filter to change the nominal input."""
    return common.starts(1)[0, :, :3].ravel()


def filtered(
    states: np.ndarray, period: float, end: float = END, solver: str = "elastiqp"
) -> np.ndarray:
    """Least margin min_i (delta_i^2 - gap_i^2) of each run under the filter, over all steps."""
    control, robots = law(solver), Robots(solver)
    substeps = round(period / H)

    def rate(z: jax.Array, u: jax.Array) -> jax.Array:
        return robots.f(z) + robots.g(z) @ u

    def step(carry: tuple[jax.Array, ...], _: None) -> tuple[tuple[jax.Array, ...], None]:
        z, u, least = carry
        k1 = rate(z, u)
        k2 = rate(z + 0.5 * H * k1, u)
        k3 = rate(z + 0.5 * H * k2, u)
        k4 = rate(z + H * k3, u)
        z = z + H / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        return (z, u, jnp.minimum(least, jnp.min(robots.h_1(z)))), None

    def hold(carry: tuple[jax.Array, jax.Array], _: None) -> tuple[Any, None]:
        z, least = carry
        held = (z, control(z), least)
        z, _u, least = jax.lax.scan(step, held, None, length=substeps)[0]
        return (z, least), None

    @jax.jit
    def run(z: jax.Array) -> jax.Array:
        start = (z, jnp.min(robots.h_1(z)))
        return jax.lax.scan(hold, start, None, length=round(end / period))[0][1]

    return np.array([run(state[:, :3].ravel()) for state in states])


def ours(states: np.ndarray, period: float, mode: str, end: float = END) -> np.ndarray:
    """The same under our law; a run ends when it leaves, so that its margin is the first one."""
    mode, _, guarded = mode.partition(", ")
    one = replace(common.system("ode", "rk4", mode), between=guarded or "watched")
    least = []
    for state in states:
        loop = replace(one, state=state).closed_loop(Clock(end, H, period, end))
        loop.advance(1, round(end / H))
        loop.finish()
        margin = -float(np.max(loop.monitor.worst))
        if loop.monitor.exit != watch.INSIDE:
            margin = min(margin, -float(loop.monitor.exit_value))
            if guarded or (mode == "implicit" and not loop.monitor.exit_between):
                raise ArithmeticError("mode implicit left the set where it promises not to")
        least.append(margin)
    return np.array(least)


def rows(runs: int = 20) -> list[dict[str, str]]:
    """Medians over ``runs`` turns in us of one control; then the least margins in m2/s2."""
    calls: dict[str, Callable[[], float]] = {}
    calls["ours called"], calls["ours looped"] = our_calls(FullInformation(), by_hand())
    same = np.asarray(law("elastiqp")(jnp.asarray(_some_state())))
    calls["filter called"], calls["filter looped"] = our_calls(CbfFilter(), same)
    for solver in SOLVERS:
        calls[f"{solver} called"], calls[f"{solver} looped"] = filter_calls(solver)
    measured = {name: lambda call=call: 1e6 * call() for name, call in calls.items()}
    spent = in_turns(measured, runs)
    where = {"called": "called from Python", "looped": "in a compiled loop"}
    times = [
        row(
            f"one control of 5 robots, {meaning}: us; cbfpy's filter ({solver}, {name}) / our law",
            spent, f"ours {way}", f"{solver} {way}", "", upside_down=True,
        )
        for way, meaning in where.items()
        for solver, (name, _) in SOLVERS.items()
    ]  # fmt: skip
    times += [
        row(
            f"the same program, {meaning}: us; cbfpy's ({solver}, {name}) / our law `cbf-filter`",
            spent, f"filter {way}", f"{solver} {way}", "", upside_down=True,
        )
        for way, meaning in where.items()
        for solver, (name, _) in SOLVERS.items()
    ]  # fmt: skip
    return times + [_kept(stretch, period) for stretch in STRETCHES for period in PERIODS]


def _kept(stretch: float, period: float) -> dict[str, str]:
    states = common.starts(RUNS, WIDEST, stretch)
    return {
        "what": f"{RUNS} runs of {END:g} s, gaps up to {WIDEST:g} of their bounds, springs up to"
        f" {stretch:g} m, inputs held for {1e3 * period:g} ms: least margin delta^2 - gap^2 in"
        " m2/s2 (runs that left); ours, beside cbfpy's filter",
        "ours": "; ".join(f"{mode} {_margin(ours(states, period, mode))}" for mode in MODES),
        "other": _margin(filtered(states, period)),
        "ratio": "",
        "target": "",
    }


def _margin(least: np.ndarray) -> str:
    return f"{np.min(least):.3g} ({np.count_nonzero(least <= 0)})"


if __name__ == "__main__":
    for line in rows():
        print(*line.values(), sep="  ")
