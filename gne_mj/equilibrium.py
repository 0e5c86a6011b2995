"""Equilibria of a game: the penalised one, the variational one, and how near they are.

The penalised equilibrium solves F(y) + dphi(y) = 0 [eq:NEcondition]; as rho falls it follows a
smooth path whose end is the variational GNE [eq:vGNE].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import InfeasibleStart, SolverError
from gne_mj.game import Game

TOLERANCE = 1e-12


@dataclass(frozen=True)
class Equilibrium:
    """A profile with what shows that it is an equilibrium.

    Attributes:
        action: y, shape (m,).
        multipliers: lambda_l >= 0, shape (p,).
        rho: the penalty parameter it was computed with.
        residual: greatest entry of |F(y) + sum_l lambda_l dg_l(y)|, relative to the size of the
            terms that must cancel where that exceeds 1.
        complementarity: greatest lambda_l * (-g_l); it is rho along the path.
        iterations: Newton steps in all.
    """

    action: NDArray[np.float64]
    multipliers: NDArray[np.float64]
    rho: float
    residual: float
    complementarity: float
    iterations: int


def penalised_equilibrium(
    game: Game, rho: float, start: ArrayLike, *, tolerance: float = TOLERANCE
) -> Equilibrium:
    """The unique y* with F(y*) + dphi(y*) = 0, by damped Newton from an interior profile.

    Args:
        game: with F strictly monotone.
        rho: the penalty parameter.
        start: strictly inside, shape (m,).
        tolerance: on the residual as :class:`Equilibrium` defines it; where rounding ends the
            progress before, up to a hundred times as much is accepted and reported.

    Raises:
        InfeasibleStart: ``start`` is not strictly inside.
        SolverError: the tolerance was not reached.
    """
    return _solve(game, rho, start, np.ones(game.actions, dtype=bool), tolerance)


def variational_equilibrium(
    game: Game, start: ArrayLike, *, rho: float = 1.0, last_rho: float = 1e-11
) -> Equilibrium:
    """The variational GNE with its multipliers, by following the path rho -> 0.

    The result lies strictly inside, within about ``last_rho`` of the boundaries that bind:
    p * last_rho bounds what any agent could still gain.
    """
    everyone = np.ones(game.actions, dtype=bool)
    return _follow(game, start, everyone, rho, last_rho)


def best_response(game: Game, agent: int, y: ArrayLike, *, last_rho: float = 1e-11) -> Equilibrium:
    """An agent's own minimiser of J_i over its feasible actions, the others' held at y (m,).

    Found by the same path, for this agent alone; y must be strictly inside.
    """
    return _follow(game, y, game.agent_of_action == agent, 1.0, last_rho)


def measured_epsilon(game: Game, y: ArrayLike) -> NDArray[np.float64]:
    """What each agent could gain by deviating alone from y: J_i(y) - min J_i, shape (N,).

    At the penalised equilibrium it is at most p_i * rho, with p_i the constraints that contain
    y_i, and so at most p * rho [lemma:epsilon].
    """
    y = np.asarray(y, dtype=np.float64)
    costs = game.costs(y)
    gains = np.empty(game.agents)
    for agent in range(game.agents):
        response = best_response(game, agent, y).action
        gains[agent] = costs[agent] - game.costs(response)[agent]
    return np.maximum(gains, 0.0)


def _follow(
    game: Game, start: ArrayLike, free: NDArray[np.bool_], rho: float, last_rho: float
) -> Equilibrium:
    iterations = 0
    while True:
        rho = max(rho, last_rho)
        # On the way only nearness to the path matters.
        point = _solve(game, rho, start, free, TOLERANCE if rho == last_rho else 1e-6)
        iterations += point.iterations
        start = point.action
        if rho == last_rho:
            return Equilibrium(
                point.action,
                point.multipliers,
                rho,
                point.residual,
                point.complementarity,
                iterations,
            )
        rho *= 0.1


def _solve(
    game: Game, rho: float, start: ArrayLike, free: NDArray[np.bool_], tolerance: float
) -> Equilibrium:
    """Damped primal-dual Newton in the free actions.

    Unknowns are y, slacks s = -g(y) > 0 and multipliers lambda with lambda_l s_l = rho. Slacks
    of their own keep the digits that g(y) loses when it is small beside its terms.
    """
    y = np.array(start, dtype=np.float64)
    worst, value = game.tightest(y)
    if not value < 0.0:
        raise InfeasibleStart(game.name, "start", game.constraint_names[worst], value)
    slack = -game.constraints(y)
    point = _Point(game, rho, free, y, slack, rho / slack)
    best, stalled = point, 0
    for iteration in range(300):
        # Near the boundary rounding can end progress shortly before the tolerance.
        if best.error <= tolerance or (stalled >= 4 and best.error <= 100 * tolerance):
            return Equilibrium(
                action=best.y,
                multipliers=best.multipliers,
                rho=rho,
                residual=best.dual,
                complementarity=float(np.max(best.multipliers * best.slack)),
                iterations=iteration,
            )
        point = point.improved()
        stalled = stalled + 1 if point.error > 0.5 * best.error else 0
        if point.error < best.error:
            best = point
    raise SolverError(f"the equilibrium of the {game.name} game was not found", best.error, 300)


class _Point:
    """One iterate of the primal-dual Newton method, with its residuals."""

    def __init__(
        self,
        game: Game,
        rho: float,
        free: NDArray[np.bool_],
        y: NDArray[np.float64],
        slack: NDArray[np.float64],
        multipliers: NDArray[np.float64],
    ) -> None:
        self.game, self.rho, self.free = game, rho, free
        self.y, self.slack, self.multipliers = y, slack, multipliers
        self.jacobian = game.constraint_jacobian(y)[:, free]
        gradient = game.pseudo_gradient(y)[free]
        self.stationarity = gradient + multipliers @ self.jacobian
        size = np.abs(gradient) + multipliers @ np.abs(self.jacobian)
        self.dual = float(np.max(np.abs(self.stationarity) / np.maximum(1.0, size), initial=0.0))
        self.gap = game.constraints(y) + slack
        self.product = multipliers * slack - rho
        self.error = max(
            self.dual,
            float(np.max(np.abs(self.gap))),
            float(np.max(np.abs(self.product))) / rho,
        )
        residuals = (self.stationarity, self.gap, self.product)
        self.merit = float(np.sqrt(sum(np.sum(part**2) for part in residuals)))

    def improved(self) -> "_Point":
        """The next iterate: a Newton step, shortened to stay inside and to make progress."""
        ratio = self.multipliers / self.slack
        curvature = self.game.weighted_constraint_hessian(self.y, self.multipliers)
        matrix = (self.game.pseudo_gradient_jacobian(self.y) + curvature)[
            np.ix_(self.free, self.free)
        ]
        matrix += (self.jacobian.T * ratio) @ self.jacobian
        change = (-self.product + self.multipliers * self.gap) / self.slack
        try:
            step = np.linalg.solve(matrix, -self.stationarity - change @ self.jacobian)
        except np.linalg.LinAlgError:
            raise SolverError(
                f"the derivative of F + dphi is singular in the {self.game.name} game",
                self.error,
                0,
            ) from None
        along = self.jacobian @ step
        step_slack = -self.gap - along
        step_multipliers = change + ratio * along
        length = min(1.0, _longest(self.slack, step_slack))
        length_dual = min(1.0, _longest(self.multipliers, step_multipliers))
        for _ in range(60):
            y = self.y.copy()
            y[self.free] += length * step
            if np.all(self.game.constraints(y) < 0.0):
                trial = _Point(
                    self.game,
                    self.rho,
                    self.free,
                    y,
                    self.slack + length * step_slack,
                    self.multipliers + length_dual * step_multipliers,
                )
                # Close to the solution rounding hides progress: a full step is then taken as is.
                if trial.merit <= (1.0 - 1e-4 * length) * self.merit or self.error < 1e-6:
                    return trial
            length *= 0.5
            length_dual = min(length, length_dual)
        raise SolverError(
            f"Newton's method found no way on in the {self.game.name} game", self.error, 60
        )


def _longest(values: NDArray[np.float64], step: NDArray[np.float64]) -> float:
    """Longest step that keeps positive values at no less than 0.5% of what they are."""
    shrinking = step < 0.0
    if not np.any(shrinking):
        return np.inf
    return float(0.995 * np.min(values[shrinking] / -step[shrinking]))
