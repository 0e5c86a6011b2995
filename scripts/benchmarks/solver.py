#!/usr/bin/env python
"""How long equilibria take, and how much longer NashOpt takes for the same ones.

Needs the extra `peers`. All is compiled and warm, and every solver starts from the same profile
without multipliers. NashOpt compiles anew at each call of GNEP.solve; here its residual and
Jacobian are compiled once and handed to the solver that it would call with them (SciPy's `root` by
Levenberg and Marquardt, the faster one of its two), so that only the iterations are counted. For
the desired-velocity game its methods for linear-quadratic games are measured too: the fastest of
those that reach the accuracy, and set up beforehand. Results must agree within 1e-8.
"""

import statistics
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from nashopt import GNEP, GNEP_LQ
from scipy.optimize import root

from gne_mj.equilibrium import measured_epsilon, penalised_equilibrium, variational_equilibrium
from gne_mj.game_model import Game
from gne_mj.games import osnr_game, ten_channels, velocity_game
from gne_mj.scenario import load_scenario

ACCURACY = 1e-8
LINEAR_QUADRATIC = ("dr_daqp", "lemke_dual", "qp_gnep", "op_extrap")
Run = Callable[[], Any]


def rows(runs: int = 25) -> list[dict[str, str]]:
    """Medians over ``runs`` turns; of a call that takes less than 1 ms each turn makes 20."""
    osnr, channels = osnr_game(**ten_channels()), np.full(10, 0.2)
    robots = load_scenario("desired-velocity").simulation_object().systems[0]
    return [
        *_times(osnr, channels, runs),
        *_many_robots(runs),
        *_against(
            "OSNR N = 10, vGNE, NashOpt GNEP", osnr, channels, {"": _nashopt_osnr(channels)}, runs
        ),
        *_against(
            "desired velocities N = 5, vGNE, NashOpt GNEP", robots.game, robots.start,
            {"": _nashopt_velocity(robots.game, robots.start)}, runs,
        ),
        *_against(
            "desired velocities N = 5, vGNE, NashOpt GNEP_LQ", robots.game, robots.start,
            _linear_quadratic(robots.game), runs, ">= 4",
        ),
        *_against(
            "desired velocities N = 200, vGNE, NashOpt GNEP_LQ", *many_robots(200),
            _linear_quadratic(many_robots(200)[0]), runs,
        ),
    ]  # fmt: skip


def many_robots(count: int) -> tuple[Game, np.ndarray]:
    """A line of robots whose desires make at least a fifth of the bounds bind, and a start."""
    desired = 3.0 + np.random.default_rng(0).normal(size=count)
    return velocity_game(count, 3.0, 0.5, desired, 1.0), np.full(count, 3.0 - 1e-3)


def _times(game: Game, start: np.ndarray, runs: int) -> list[dict[str, str]]:
    near = 1.001 * penalised_equilibrium(game, 0.1, start).action
    calls: dict[str, tuple[Run, str]] = {
        "penalised equilibrium OSNR N = 10, from nearby (1.001 y*): us": (
            lambda: penalised_equilibrium(game, 0.1, near), "< 20"),
        "the same from y = 0.2 mW: us": (lambda: penalised_equilibrium(game, 0.1, start), ""),
        "vGNE OSNR N = 10 with multipliers, from y = 0.2 mW: us": (
            lambda: variational_equilibrium(game, start), "<= 12"),
    }  # fmt: skip
    spent = _in_turns({name: run for name, (run, _) in calls.items()}, runs)
    return [_row(name, 1e6 * spent[name], target=calls[name][1]) for name in calls]


def _many_robots(runs: int) -> list[dict[str, str]]:
    game, start = many_robots(1000)
    found = variational_equilibrium(game, start)
    active = np.mean(found.multipliers > -game.constraints(found.action))
    y = penalised_equilibrium(game, 0.1, start).action
    vgne = f"vGNE, desired velocities, N = 1000, {active:.0%} of the bounds active: ms"
    epsilon = "best responses of all 1000: ms"
    calls: dict[str, Run] = {
        vgne: lambda: variational_equilibrium(game, start),
        epsilon: lambda: measured_epsilon(game, y),
    }
    spent = _in_turns(calls, runs)
    return [_row(vgne, 1e3 * spent[vgne], target="< 5"), _row(epsilon, 1e3 * spent[epsilon])]


def _against(
    what: str,
    game: Game,
    start: np.ndarray,
    theirs: dict[str, Run],
    runs: int,
    target: str = ">= 20",
) -> list[dict[str, str]]:
    """One row: our vGNE against the fastest of theirs that finds the same."""
    expected = variational_equilibrium(game, start).action
    right = {name: run for name, run in theirs.items() if _distance(run, expected) <= ACCURACY}
    if not right:
        raise ArithmeticError(f"{what}: NashOpt's result differs by more than {ACCURACY:g}")
    spent = _in_turns({"ours": lambda: variational_equilibrium(game, start), **right}, runs)
    fastest = min(right, key=lambda name: spent[name])
    other = f" {fastest}" if fastest else ""
    return [_row(f"{what}{other}: us", 1e6 * spent["ours"], 1e6 * spent[fastest], target)]


def _distance(run: Run, expected: np.ndarray) -> float:
    return float(np.max(np.abs(run()[: len(expected)] - expected)))


def _in_turns(calls: dict[str, Run], runs: int) -> dict[str, float]:
    """Median time of each call in s, all in turns so that they see the same machine."""
    spent: dict[str, list[float]] = {name: [] for name in calls}
    repeats = {}
    for name, run in calls.items():
        run()
        began = time.perf_counter()
        run()
        repeats[name] = 20 if time.perf_counter() - began < 1e-3 else 1
    for _ in range(runs):
        for name, run in calls.items():
            for _ in range(repeats[name]):
                began = time.perf_counter()
                run()
                spent[name].append(time.perf_counter() - began)
    return {name: statistics.median(values) for name, values in spent.items()}


def _row(what: str, ours: float, other: float | None = None, target: str = "") -> dict[str, str]:
    return {
        "what": what,
        "ours": f"{ours:.3g}",
        "other": "" if other is None else f"{other:.4g}",
        "ratio": "" if other is None else f"{other / ours:.1f}",
        "target": target,
    }


def _nashopt(game: GNEP, start: np.ndarray) -> Run:
    """What GNEP.solve(solver="lm") does after compiling; its profile comes first in the result."""
    residual, jacobian = jax.jit(game.kkt_residual), jax.jit(jax.jacobian(game.kkt_residual))
    first = jnp.hstack((start, 0.1 * jnp.ones(game.nlam_sum)))
    options = {"ftol": 1e-12, "xtol": 1e-12, "gtol": 1e-12, "maxiter": 200}
    return lambda: root(residual, first, jac=jacobian, method="lm", options=options).x


def _nashopt_osnr(start: np.ndarray) -> Run:
    numbers = ten_channels()
    a, b, c, n0 = (np.array(numbers[k]) for k in ("price", "utility_weight", "gain", "noise_power"))
    matrix = np.array(numbers["system_matrix"])
    np.fill_diagonal(matrix, 0.0)
    limit = numbers["total_power_limit"]

    def cost(i: int, y: Any) -> Any:
        return a[i] * y[i] - b[i] * jnp.log(1.0 + c[i] * y[i] / (n0[i] + matrix[i] @ y))

    game = GNEP(
        [1] * 10, [partial(cost, i) for i in range(10)], lambda y: jnp.array([jnp.sum(y) - limit]),
        1, lb=np.zeros(10), ub=np.full(10, np.inf), variational=True,
    )  # fmt: skip
    return _nashopt(game, start)


def _nashopt_velocity(game: Game, start: np.ndarray) -> Run:
    v0, delta, desired, weight = _numbers(game)

    def gaps(y: Any) -> Any:
        return y - jnp.concatenate([jnp.array([v0]), y[:-1]])

    def cost(i: int, y: Any) -> Any:
        return gaps(y)[i] ** 2 + weight[i] * (y[i] - desired[i]) ** 2

    def bounds(y: Any) -> Any:
        return jnp.concatenate([gaps(y) - delta, -gaps(y) - delta])

    peer = GNEP(
        [1] * game.agents, [partial(cost, i) for i in range(game.agents)], bounds, 2 * game.agents,
        variational=True,
    )  # fmt: skip
    return _nashopt(peer, start)


def _linear_quadratic(game: Game) -> dict[str, Run]:
    """NashOpt's methods for linear-quadratic games, the gaps bounded by 2N affine constraints."""
    v0, delta, desired, weight = _numbers(game)
    n = game.agents
    quadratic, linear = np.zeros((n, n, n)), np.zeros((n, n))
    for i in range(n):
        quadratic[i, i, i] = 2.0 + 2.0 * weight[i]
        linear[i, i] = -2.0 * weight[i] * desired[i] - (2.0 * v0 if i == 0 else 0.0)
        if i > 0:
            quadratic[i, i, i - 1] = quadratic[i, i - 1, i] = -2.0
            quadratic[i, i - 1, i - 1] = 2.0
    rows, first = np.eye(n) - np.eye(n, k=-1), v0 * np.eye(n)[0]
    games = {
        method: GNEP_LQ(
            [1] * n, list(quadratic), list(linear), A=np.vstack([rows, -rows]),
            b=np.concatenate([delta + first, delta - first]), variational=True, solver=method,
        )
        for method in LINEAR_QUADRATIC
    }  # fmt: skip
    return {method: lambda peer=peer: peer.solve().x for method, peer in games.items()}


def _numbers(game: Game) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    delta, desired, weight = game.parameters[1:].reshape(3, game.agents)
    return float(game.parameters[0]), delta, desired, weight


if __name__ == "__main__":
    for line in rows():
        print(*line.values(), sep="  ")
