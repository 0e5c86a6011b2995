#!/usr/bin/env python
"""The ODE twins beside diffrax, compiled and warm, in double precision.

Batches: 256 runs of 5 s under full information, mode continuous, of robots (gaps up to 0.9 of their
bounds, stretched springs), and of ten channels as integrators and as PI cascades. diffrax is given
the classic Runge-Kutta method as a tableau (it has none of its own), with our step, from starts
whose runs divide no step: the same numbers come out. A second row lets it choose, from any starts:
each of its methods takes the loosest step or tolerance of a grid whose greatest error in any state
of any run at the end is at most 1e-6, ours (Runge-Kutta 4 and tsit5) likewise, and the fastest of
each side counts. Both batches are shared among all cores, diffrax's being vmapped.

OSNR: the stiff twin of :mod:`twin` under the fully distributed law, one run of 30 s with 601
samples, error at most 1e-6 in all of them; diffrax has no Rosenbrock method, so that its
Kvaerno ones compete, and the explicit Tsit5. Equal tolerances, absolute and relative, and a PI
controller of steps served it best, as did interpolating the samples over making steps end there.
"""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import diffrax
import jax
import jax.numpy as jnp
import numpy as np
import peer_common as common
import twin
from turns import in_turns, row

from gne_mj.controllers import FullInformation
from gne_mj.games import osnr_game, ten_channels
from gne_mj.plants import integrator, pi_cascade
from gne_mj.plants.agents import Agents
from gne_mj.system import Clock, System

RUNS, END, STEPS = 256, 5.0, 200
ACCURACY = 1e-6
SAME = 1e-11  # how far two classic Runge-Kutta methods may be apart
MORE_STEPS = tuple(round(50 * 2 ** (k / 4)) for k in range(20))
TOLERANCES = 10.0 ** -np.arange(5.0, 9.1, 0.25)
FREELY: dict[str, Any] = {"throw": False, "adjoint": diffrax.ForwardMode()}


class Rk4(diffrax.AbstractERK):
    """The classic Runge-Kutta method of order four."""

    tableau: ClassVar[diffrax.ButcherTableau] = diffrax.ButcherTableau(
        a_lower=(np.array([0.5]), np.array([0.0, 0.5]), np.array([0.0, 0.0, 1.0])),
        b_sol=np.array([1.0, 2.0, 2.0, 1.0]) / 6.0,
        b_error=np.zeros(4),
        c=np.array([0.5, 0.5, 1.0]),
    )
    interpolation_cls: ClassVar[Callable[..., Any]] = (
        diffrax.ThirdOrderHermitePolynomialInterpolation.from_k
    )

    def order(self, terms: Any) -> int:
        """Of the method."""
        return 4


@dataclass(frozen=True)
class Batch:
    """Runs of one system, for both.

    Attributes:
        name: what they are.
        system: ours.
        rate: for diffrax, of a state that is one array (N,) for each component.
        starts: from how many runs to their states, ours, (runs, N, components or more).
        components: of a channel's state, that diffrax has.
        end: of the runs, in s.
        steps: of Runge-Kutta 4, that are short enough for many starts not to divide any.
    """

    name: str
    system: System
    rate: Callable[..., Any]
    starts: Callable[[int], np.ndarray]
    components: int
    end: float = END
    steps: int = STEPS


def robots(_time: Any, state: Any, _: Any) -> Any:
    """Rates of extensions, velocities and appendage velocities, each (N,)."""
    extension, velocity, appendage = state
    pull = extension + jnp.arctan(extension) + velocity - appendage
    gap = jnp.diff(velocity, prepend=common.V0)
    slope = 2.0 * common.RHO * gap / (common.DELTA**2 - gap**2)
    u = -2.0 * gap - slope + jnp.append(slope[1:], 0.0)
    return velocity - appendage, u - pull, pull


def channels(kind: Any) -> Callable[..., Any]:
    """Rates of ten channels under full information, as integrators or PI cascades."""
    n, q = twin.N, osnr_game(**ten_channels()).parameters
    price, weight, gain, noise = (q[2 + n * k : 2 + n * (k + 1)] for k in range(4))
    crosstalk, limit = q[2 + 4 * n :].reshape(n, n) + np.diag(gain), q[1]

    def rate(_time: Any, state: Any, _: Any) -> Any:
        y = state[0]
        slope = price - weight * gain / (noise + jnp.sum(crosstalk * y, axis=1))
        u = -slope - common.RHO / (limit - jnp.sum(y)) + common.RHO / y
        return (u,) if kind is integrator else (u - y + 0.5 * state[1], u)

    return rate


def of_robots() -> Batch:
    """Five robots."""
    one = common.system("ode", "rk4", "continuous")
    return Batch("robots' ODE twin", one, robots, common.starts, 3)


def of_channels(kind: Any) -> Batch:
    """Ten channels, with 0.1 to 0.24 mW each, of 2.5 mW together."""

    def starts(runs: int) -> np.ndarray:
        power = np.random.default_rng(0).uniform(0.1, 0.24, (runs, twin.N))
        return np.stack([power, 2.0 * power], axis=2)[:, :, : len(kind.STATES)].copy()

    numbers = np.tile([1.0, 0.5], (twin.N, 1))[:, : len(kind.PARAMETERS)]
    one = System(
        "channels", osnr_game(**ten_channels()), Agents(kind, numbers, np.full(twin.N, np.inf)),
        FullInformation(), common.RHO, starts(1)[0], engine="ode", integrator="rk4",
        mode="continuous",
    )  # fmt: skip
    name = f"ten channels, {kind.NAME}s"
    return Batch(name, one, channels(kind), starts, len(kind.STATES), 0.5, 2500)


def fixed(solver: Any, rate: Any = robots, end: float = END) -> Callable[[float], Any]:
    """From a number of steps to the function of one run that returns its last state."""

    def solve(steps: float) -> Callable[..., Any]:
        return _to_the_end(rate, solver, diffrax.ConstantStepSize(), (end, end / steps))

    return solve


def adaptive(solver: Any, rate: Any = robots, end: float = END) -> Callable[[float], Any]:
    """The same from a tolerance."""

    def solve(tolerance: float) -> Callable[..., Any]:
        controller = diffrax.PIDController(rtol=tolerance, atol=tolerance, pcoeff=0.3, icoeff=0.4)
        return _to_the_end(rate, solver, controller, (end, None))

    return solve


def _to_the_end(
    rate: Any, solver: Any, controller: Any, span: tuple[float, float | None]
) -> Callable[..., Any]:
    end, step = span

    def one(*state: jax.Array) -> tuple[jax.Array, ...]:
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(rate), solver, 0.0, end, step, state,
            saveat=diffrax.SaveAt(t1=True), stepsize_controller=controller, max_steps=None,
            **FREELY,
        )  # fmt: skip
        return tuple(part[0] for part in found.ys)

    return one


METHODS: dict[str, tuple[Callable[..., Any], Any, Any]] = {
    "Tsit5, constant steps": (fixed, diffrax.Tsit5(), MORE_STEPS),
    "Tsit5, adaptive": (adaptive, diffrax.Tsit5(), TOLERANCES),
    "Dopri8, adaptive": (adaptive, diffrax.Dopri8(), TOLERANCES),
}


def batch(one: Callable[..., Any], states: np.ndarray) -> Callable[[], tuple[float, np.ndarray]]:
    """What moves all runs once: seconds and the last states (runs, N, components)."""
    compiled = common.over_cores(one)
    start = [jnp.asarray(states[:, :, s]) for s in range(states.shape[2])]

    def call() -> tuple[float, np.ndarray]:
        began = time.perf_counter()
        last = jax.block_until_ready(compiled(*start))
        return time.perf_counter() - began, np.stack(last, axis=2)

    return call


def ours(
    of: Batch, steps: int, states: np.ndarray, **adaptive: Any
) -> Callable[[], tuple[float, np.ndarray]]:
    """The same of our batch; with other fields of its system, if given."""
    step = of.end / steps
    one = replace(of.system, **adaptive)
    call = common.ours(one, Clock(of.end, step, step, of.end), states)

    def known_to_diffrax() -> tuple[float, np.ndarray]:
        spent, last = call()
        return spent, last[:, :, : of.components]

    return known_to_diffrax


def _loosest(
    tries: Callable[[Any], Callable[[], tuple[float, np.ndarray]]], grid: Any, reference: np.ndarray
) -> Any:
    """The first entry of a grid that is accurate enough; None if none is."""
    for entry in grid:
        if np.max(np.abs(tries(entry)()[1] - reference)) <= ACCURACY:
            return entry
    return None


def _same(of: Batch, turns: int) -> dict[str, str]:
    """The same method with the same steps."""
    step = of.end / of.steps
    clock = Clock(of.end, step, step, of.end)
    states = common.undivided(of.system, clock, of.starts(50 * RUNS), RUNS)
    theirs = batch(fixed(Rk4(), of.rate, of.end)(of.steps), states[:, :, : of.components])
    mine = ours(of, of.steps, states)
    apart = float(np.max(np.abs(theirs()[1] - mine()[1])))
    if not apart <= SAME:
        raise ArithmeticError(f"diffrax's classic Runge-Kutta method differs by {apart:.1e}")
    times = in_turns({"ours": lambda: 1e3 * mine()[0], "diffrax": lambda: 1e3 * theirs()[0]}, turns)
    return row(
        f"{_what(of)}, {of.steps} steps of RK4 (equal within {apart:.0e}): ms; diffrax / our batch",
        times, "ours", "diffrax", ">= 4", upside_down=True,
    )  # fmt: skip


def _what(of: Batch) -> str:
    return f"{of.name}, {RUNS} runs of {of.end:g} s, continuous, {len(jax.devices())} cores"


def _accurate(of: Batch, turns: int) -> dict[str, str]:
    """Each with what is fastest at the same error."""
    states = of.starts(RUNS)
    known = states[:, :, : of.components]
    reference = ours(of, 10 * of.steps, states)()[1]
    found = {}
    for name, (tries, grid) in _our_methods(of, states).items():
        entry = _loosest(tries, grid, reference)
        if entry is not None:
            found[name] = tries(entry)
    if not found:
        raise ArithmeticError(f"none of our steps reaches {ACCURACY:g}")
    mine = set(found)
    for name, (kind, solver, grid) in METHODS.items():
        method = kind(solver, of.rate, of.end)
        entry = _loosest(lambda one, method=method: batch(method(one), known), grid, reference)
        if entry is not None:
            found[name] = batch(method(entry), known)
    times = in_turns(
        {name: lambda call=call: 1e3 * call()[0] for name, call in found.items()}, turns
    )
    best, fastest = (
        min(side, key=lambda name: statistics.median(times[name]))
        for side in (found.keys() - mine, mine)
    )
    return row(
        f"{_what(of)}, error {ACCURACY:g}: ms; diffrax {best} / our batch, {fastest}",
        times, fastest, best, ">= 2", upside_down=True,
    )  # fmt: skip


def _our_methods(of: Batch, states: np.ndarray) -> dict[str, tuple[Callable[[Any], Any], Any]]:
    """What moves all runs by each of our methods, from an entry of its grid; and the grid."""

    def adaptive(rtol: float) -> Callable[[], tuple[float, np.ndarray]]:
        return ours(of, MORE_STEPS[0], states, integrator="tsit5", rtol=float(rtol))

    return {
        "RK4": (lambda steps: ours(of, steps, states), MORE_STEPS),
        "tsit5": (adaptive, TOLERANCES),
    }


def osnr(case: twin.Twin) -> Callable[..., jax.Array]:
    """The rate of the OSNR twin, on SciPy's state of :class:`twin.Twin`."""
    n, size = twin.N, twin.N * case.states
    q, laplacian = case.game.parameters, jnp.asarray(case.graph.laplacian)
    price, weight, gain, noise = (q[2 + n * k : 2 + n * (k + 1)] for k in range(4))
    crosstalk, limit = q[2 + 4 * n :].reshape(n, n) + np.diag(gain), q[1]
    others = ~np.eye(n, dtype=bool)
    held = np.diag(np.arange(n) * case.states)  # where agent i keeps its estimate of j, or itself
    held[others] = size + np.arange(n * (n - 1))
    cascade = case.kind is pi_cascade

    def rate(_time: Any, v: jax.Array, _: Any) -> jax.Array:
        x, z, estimate = v[:size].reshape(n, case.states), v[size + n * (n - 1) :], v[held]
        y = x[:, 0]
        room = limit - (jnp.sum(estimate, axis=1) - y + z)
        slope = price - weight * gain / (noise + jnp.sum(crosstalk * estimate, axis=1))
        u = -case.gain * (slope + twin.RHO / room - twin.RHO / z)
        agents = jnp.stack([u - y + 0.5 * x[:, 1], u], axis=1).ravel() if cascade else u
        flow = (laplacian @ estimate)[others]
        return jnp.concatenate([agents, -flow / case.epsilon, (y - z) / case.epsilon])

    return rate


STIFF = {
    "Kvaerno3": diffrax.Kvaerno3(),
    "Kvaerno5": diffrax.Kvaerno5(),
    "Tsit5": diffrax.Tsit5(),
}


def stiff(case: twin.Twin, solver: Any) -> Callable[[float], tuple[float, np.ndarray]]:
    """From a tolerance to seconds and all samples, (601, states)."""
    rate, start, times = osnr(case), jnp.asarray(case.first), jnp.asarray(twin.TIMES)

    @jax.jit
    def solve(tolerance: jax.Array) -> Any:
        return diffrax.diffeqsolve(
            diffrax.ODETerm(rate), solver, 0.0, twin.END, None, start,
            saveat=diffrax.SaveAt(ts=times), max_steps=20_000,
            stepsize_controller=diffrax.PIDController(
                rtol=tolerance, atol=tolerance, pcoeff=0.3, icoeff=0.4
            ),
            **FREELY,
        ).ys  # fmt: skip

    def call(tolerance: float) -> tuple[float, np.ndarray]:
        began = time.perf_counter()
        samples = solve(tolerance).block_until_ready()
        return time.perf_counter() - began, np.asarray(samples)

    return call


def _osnr(gain: float, epsilon: float, turns: int) -> dict[str, str]:
    case = twin.Twin(pi_cascade, gain, epsilon)
    reference = case.scipy("DOP853", 1e-12, 1e-13, case.rate)[1]
    calls = {"ours": case.ours} | {name: stiff(case, solver) for name, solver in STIFF.items()}
    found = {name: twin.loosest(call, reference) for name, call in calls.items()}
    accurate = {name: entry for name, entry in found.items() if entry is not None}
    if len(accurate) < 2 or "ours" not in accurate:
        raise ArithmeticError(f"no tolerance of the grid reaches {twin.ACCURACY:g}")
    best = min(accurate.keys() - {"ours"}, key=lambda name: accurate[name][0])
    times = in_turns(
        {
            name: lambda call=calls[name], rtol=accurate[name][1]: 1e3 * call(rtol)[0]
            for name in ("ours", best)
        },
        turns,
    )
    return row(
        f"OSNR twin, {pi_cascade.NAME}, k = {gain:g}, epsilon = {epsilon:g}, T = 30 s, error 1e-6:"
        f" ms; diffrax {best} / ours",
        times, "ours", best, "", upside_down=True,
    )  # fmt: skip


def rows(runs: int = 20) -> list[dict[str, str]]:
    """Medians over ``runs`` turns, in ms for all runs together."""
    batches = (of_robots(), of_channels(integrator), of_channels(pi_cascade))
    return [
        *(compare(of, runs) for of in batches for compare in (_same, _accurate)),
        *(_osnr(gain, epsilon, runs) for gain, epsilon in twin.CASES),
    ]


if __name__ == "__main__":
    for line in rows():
        print(*line.values(), sep="  ")
