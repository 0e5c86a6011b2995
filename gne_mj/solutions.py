"""The equilibria of a system's game, what agents could still gain there, and a path over rho."""

import csv
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.bounds import MOST_POINTS
from gne_mj.epsilon import epsilon_bounds
from gne_mj.equality import error_of, multipliers
from gne_mj.equilibrium import (
    Equilibrium,
    measured_epsilon,
    path,
    penalised_equilibrium,
    variational_equilibrium,
)
from gne_mj.errors import InvalidInput, part_of
from gne_mj.game_model import Game
from gne_mj.margins import of_the_set
from gne_mj.optimality import FLAT, Optimality, examine
from gne_mj.progress import Tell, nothing
from gne_mj.summary import bounds_text
from gne_mj.system import System

# A gain up to so many times the variational equilibrium's own rho is one by rounding.
ROUNDING = 1e4


@dataclass(frozen=True)
class Measured:
    """A penalised equilibrium and what the lemma on epsilon says of it [lemma:epsilon].

    Attributes:
        equilibrium: the penalised equilibrium.
        gains: what each agent could gain by deviating alone, shape (N,).
        distance: greatest |y_a - y_a of the variational GNE|.
    """

    equilibrium: Equilibrium
    gains: NDArray[np.float64]
    distance: float


@dataclass(frozen=True)
class Solution:
    """What was computed for one system.

    Attributes:
        name: of the system.
        game: its game.
        penalised: at each rho that was asked for.
        variational: the variational GNE, or a profile at which no agent's first derivative tells
            it to move.
        gains: what each agent could gain there by deviating alone, shape (N,).
        optimality: what second derivatives tell of it, and which constraints bind.
        path: over rho, empty if it was not asked for.
    """

    name: str
    game: Game
    penalised: tuple[Measured, ...]
    variational: Equilibrium
    gains: NDArray[np.float64]
    optimality: Optimality
    path: tuple[Measured, ...]

    def __repr__(self) -> str:
        """Two lines; ``print`` shows all (:func:`summary`)."""
        what = "variational GNE" if self.holds else "stationary profile, and no equilibrium"
        active = len(self.optimality.active)
        return (
            f"<Solution of {self.game.name}, {self.game.agents} agents: {what}"
            f" {_listed(self.variational.action)},\n {active} of {self.game.constraints_count}"
            f" constraints active; penalised at rho ="
            f" {', '.join(f'{point.equilibrium.rho:g}' for point in self.penalised)}>"
        )

    def __str__(self) -> str:
        return "\n".join(summary(self))

    @property
    def deviating(self) -> tuple[int, ...]:
        """The agents, from 0, for whom the profile in the variational GNE's place is no minimum.

        A best response gains, or the own second derivative is negative.
        """
        rho = self.variational.rho
        gaining = self.gains > (self.game.own_constraints + ROUNDING) * rho
        return tuple(sorted({*self.optimality.not_minima, *np.flatnonzero(gaining).tolist()}))

    @property
    def holds(self) -> bool:
        """Whether an equilibrium was found, as far as second derivatives and responses tell."""
        return not self.deviating

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, strings and lists, for JSON."""
        game = self.game
        return {
            "game": game.name,
            "action": game.action_name,
            "unit": game.action_unit,
            "agents": game.agents,
            "constraints": list(game.constraint_names),
            "variational": {
                **_numbers(game, self.variational),
                "active": [game.constraint_names[k] for k in self.optimality.active],
                "weakly_active": [game.constraint_names[k] for k in self.optimality.weakly_active],
                "is_equilibrium": self.holds,
                "not_minima": [i + 1 for i in self.deviating],
                "gains": self.gains.tolist(),
                "own_curvature": [
                    value if np.isfinite(value) else None
                    for value in self.optimality.curvature.tolist()
                ],
                "monotonicity": self.optimality.monotonicity,
            },
            "penalised": [_compared(game, point) for point in self.penalised],
            "path": [_compared(game, point) for point in self.path],
        }


@part_of("system", "rhos", "path_rhos")
@np.errstate(over="ignore")  # what is beyond all floats is infinite, and no matter for a warning
def solve_system(
    system: System,
    rhos: Sequence[float] = (),
    path_rhos: Sequence[float] = (),
    progress: Tell = nothing,
) -> Solution:
    """Solve the game of a system from its start.

    Args:
        system: whose game and start are used.
        rhos: penalty parameters; the system's own if there are none.
        path_rhos: penalty parameters of a path, each equilibrium started from the one before.
        progress: called after every agent's best response, which take most of the time.

    Raises:
        InvalidInput: a rho that is not positive and finite.
        SolverError: an equilibrium was not found.
    """
    for key, given in (("rhos", rhos), ("path_rhos", path_rhos)):
        for rho in given:
            if not 0.0 < rho < np.inf:
                raise InvalidInput(key, rho, "it must be positive and finite")
    game, start = system.game, system.start
    points, responses = (len(rhos) or 1) + 1 + len(path_rhos), 0
    progress(
        0, points * game.agents,
        f"{points} equilibria, and at each the best response of each of {game.agents} agents",
    )  # fmt: skip

    def responded() -> None:
        nonlocal responses
        responses += 1
        words = f"{system.name}: {responses // game.agents} of {points} equilibria"
        progress(responses, points * game.agents, words)

    penalised = [penalised_equilibrium(game, rho, start) for rho in rhos or (system.rho,)]
    variational = variational_equilibrium(of_the_set(game), penalised[0])
    return Solution(
        name=system.name,
        game=game,
        penalised=tuple(_measure(game, point, variational, responded) for point in penalised),
        variational=variational,
        gains=measured_epsilon(game, variational.action, responded),
        optimality=examine(game, variational),
        path=tuple(
            _measure(game, point, variational, responded)
            for point in path(game, path_rhos, penalised[0])
        ),
    )


def parse_path(text: str) -> list[float]:
    """FROM:TO:COUNT as that many positive numbers at equal ratios.

    Raises:
        InvalidInput: it does not read so.
    """
    parts = text.split(":")
    try:
        first, last, count = float(parts[0]), float(parts[1]), int(parts[2])
        right = len(parts) == 3 and 0 < first < np.inf and 0 < last < np.inf and count >= 2
        right = right and count <= MOST_POINTS
    except (ValueError, IndexError):
        right = False
    if not right:
        raise InvalidInput(
            "text", text, "it must read FROM:TO:COUNT, e.g. 1:1e-6:13 (two positive numbers and"
            f" how many, from 2 to {MOST_POINTS})",
        )  # fmt: skip
    return np.geomspace(first, last, count).tolist()


def write_path(solution: Solution, file: Path) -> None:
    """The path as CSV: a row for each rho, with every action and multiplier."""
    game = solution.game
    header = ["rho", "distance_to_variational", "epsilon_measured", "bound", "largest_own_bound"]
    header += [f"{game.action_name} {a + 1}" for a in range(game.actions)]
    header += [f"multiplier of {name}" for name in game.constraint_names]
    with file.open("w", encoding="utf-8", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        for point in solution.path:
            numbers = _compared(game, point)
            epsilon = numbers["epsilon"]
            writer.writerow(
                [
                    numbers["rho"],
                    numbers["distance_to_variational"],
                    epsilon["measured"],
                    epsilon["bound"],
                    epsilon["largest_own_bound"],
                    *numbers["action"],
                    *numbers["multipliers"],
                ]
            )


def _measure(
    game: Game, point: Equilibrium, variational: Equilibrium, responded: Callable[[], None]
) -> Measured:
    distance = float(np.max(np.abs(point.action - variational.action)))
    return Measured(point, measured_epsilon(of_the_set(game), point.action, responded), distance)


def _numbers(game: Game, point: Equilibrium) -> dict[str, Any]:
    return {
        "rho": point.rho,
        "action": point.action.tolist(),
        "multipliers": point.multipliers.tolist(),
        "equalities": _equalities(game, point),
        "residual": point.residual,
        "largest_constraint": float(np.max(game.constraints(point.action), initial=-np.inf)),
        "complementarity": point.complementarity,
        "iterations": point.iterations,
    }


def _equalities(game: Game, point: Equilibrium) -> list[dict[str, Any]]:
    """Of each equality what is missing to it, and its multiplier."""
    found = multipliers(game.equalities, point.action, point.multipliers)
    return [
        {
            "name": each.name,
            "error": error_of(each, point.action),
            "width": each.width,
            "multiplier": float(multiplier),
        }
        for each, multiplier in zip(game.equalities, found, strict=True)
    ]


def _compared(game: Game, point: Measured) -> dict[str, Any]:
    largest = int(np.argmax(point.gains))
    return {
        **_numbers(game, point.equilibrium),
        "distance_to_variational": point.distance,
        "epsilon": {
            "measured": float(point.gains[largest]),
            "agent": largest + 1,
            "each": point.gains.tolist(),
            **bounds_of(game, point),
        },
    }


def bounds_of(game: Game, point: Measured) -> dict[str, Any]:
    """What epsilon is at most at a penalised equilibrium (:func:`epsilon_bounds`)."""
    found = point.equilibrium
    return epsilon_bounds(game, found.rho, found, gains=point.gains)


def summary(solution: Solution) -> list[str]:
    """The solution in words, line by line."""
    game, variational, found = solution.game, solution.variational, solution.optimality
    unit = f" {game.action_unit}" if game.action_unit else ""
    kind = "GNE" if game.private else "variational GNE"
    moves = ", as it is at time 0, and it moves" * (game.motion is not None)
    lines = [f"{solution.name}: {game.called}, {game.agents} agents{moves}"]
    for point in solution.penalised:
        numbers = _compared(game, point)
        epsilon = numbers["epsilon"]
        lines += [
            f"  penalised equilibrium at rho = {numbers['rho']:g}",
            f"    {game.action_name:16} {_listed(point.equilibrium.action)}{unit}",
            f"    {'multipliers':16} {_listed(point.equilibrium.multipliers)}",
            f"    {'residual':16} {numbers['residual']:.1e}; {numbers['iterations']} iterations",
            f"    {'epsilon':16} {epsilon['measured']:.4g} measured (agent {epsilon['agent']});"
            f" {bounds_text(epsilon)}",
            f"    {'distance':16} {point.distance:.4g}{unit} to the {kind}",
        ]
    active = [
        f"{game.constraint_names[k]} (lambda = {variational.multipliers[k]:.4g})"
        for k in found.active
    ]
    weakly = [game.constraint_names[k] for k in found.weakly_active]
    lines += [
        _title(solution),
        f"    {game.action_name:16} {_listed(variational.action)}{unit}",
        f"    {'active':16} {len(active)} of {game.constraints_count} constraints"
        + (f": {_shortened(active)}" if active else "")
        + (f"; weakly (lambda = 0): {_shortened(weakly)}" if weakly else ""),
        f"    {'residual':16} stationarity {variational.residual:.1e}, complementarity"
        f" {variational.complementarity:.1e}, every constraint negative;"
        f" {variational.iterations} iterations",
        *(
            f"    {'equality':16} {each['name']}: multiplier {each['multiplier']:.6g}, off by"
            f" {each['error']:.2g} within the width {each['width']:g}"
            for each in _equalities(game, variational)
        ),
        *_doubts(solution),
    ]
    if solution.path:
        lines += ["  path", f"    {'rho':>10}  {'distance':>10}  {'epsilon':>10}  {'at most':>10}"]
        for point in solution.path:
            lines.append(
                f"    {point.equilibrium.rho:10.3g}  {point.distance:10.3g}"
                f"  {np.max(point.gains):10.3g}"
                f"  {_number(bounds_of(game, point)['bound'])}"
            )
    return lines


def _title(solution: Solution) -> str:
    if not solution.holds:
        return "  stationary profile, and no equilibrium"
    private = len(solution.game.private)
    if private:
        return f"  GNE, {private} of {solution.game.constraints_count} constraints private"
    return "  variational GNE"


def _doubts(solution: Solution) -> list[str]:
    """Lines on agents that could do better, and on other equilibria."""
    found, deviating, lines = solution.optimality, solution.deviating, []
    if deviating:
        agents = _shortened([str(i + 1) for i in deviating])
        best = int(np.argmax(solution.gains))
        why = f"a best response gains {solution.gains[best]:.4g} (agent {best + 1})"
        if found.not_minima:
            least = min(found.not_minima, key=lambda i: found.curvature[i])
            why += f"; its own second derivative is negative (agent {least + 1})"
        lines.append(f"    {'not minima':16} agents {agents}: {why}; start elsewhere")
    if found.monotonicity is not None and found.monotonicity < FLAT:
        kind = "not monotone" if found.monotonicity < -FLAT else "merely monotone"
        lines.append(f"    {'uniqueness':16} F is {kind} there: the equilibrium need not be unique")
    return lines


def _number(value: float | None) -> str:
    return f"{'none' if value is None else format(value, '.3g'):>10}"


def _listed(values: NDArray[np.float64]) -> str:
    return _shortened([f"{value:.5g}" for value in values])


def _shortened(words: Sequence[str], most: int = 12) -> str:
    shown = ", ".join(words[:most])
    return shown if len(words) <= most else f"{shown}, ... ({len(words)} in all)"
