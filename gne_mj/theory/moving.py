"""What is certain of a game or a penalty that moves (docs/moving-problems.md): the set is kept."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gne_mj.motion import motion_of
from gne_mj.plants import flexible_robot, integrator, mixed, pi_cascade, position_robot
from gne_mj.system import Clock, System, mode_of
from gne_mj.theory.assumption import ASSUMED, FAILS, MET, Assumption, provided
from gne_mj.theory.commanded_input import limited
from gne_mj.theory.constants import BOUNDED, EXACT, Slopes
from gne_mj.theory.convexity import convex_constraints

# Outputs that inputs push, all else that moves them being bounded while they are; mixed fleets are
# of the first three
PUSHED = (integrator, pi_cascade, flexible_robot, mixed, position_robot)
LOOKED_AT = 100  # times of a run, besides those at which a rate jumps


@dataclass(frozen=True, eq=False)
class MovingGame:
    """A system whose game moves, on one clock.

    Args:
        system: which.
        clock: how long it runs.
    """

    system: System
    clock: Clock

    @cached_property
    def times(self) -> list[float]:
        """Those in s that are looked at."""
        motion = motion_of(self.system.game)
        assert motion is not None
        even = np.linspace(0.0, self.clock.duration, LOOKED_AT + 1).tolist()
        return sorted({*even, *(t for t in motion.knots if t < self.clock.duration)})

    @cached_property
    def least_monotonicity(self) -> float | None:
        """mu, the least at these times; None if F is not affine."""
        system = self.system
        if not system.game.affine:
            return None
        slopes = [system.game_at(t).pseudo_gradient_jacobian(system.start) for t in self.times]
        return float(min(np.linalg.eigvalsh(0.5 * (s + s.T))[0] for s in slopes))

    @cached_property
    def obstacles(self) -> list[str]:
        """Why the set is not certain to be kept in continuous time; empty if it is."""
        return obstacles_to_keeping(self.system)

    def assumption(self) -> Assumption:
        """What mode implicit needs of the game at all times, not at the start alone."""
        least = self.least_monotonicity
        label, system = "moving", self.system
        if system.law.graph is not None or system.decentralised or least is None:
            return Assumption(label, ASSUMED, "monotone at all times as it is at the start")
        if least < -1e-12:
            return Assumption(label, FAILS, f"F is not monotone at all times: mu = {least:.4g}")
        words = f"mu is at least {least:.4g} at {len(self.times)} times of the run"
        return Assumption(label, MET, words)

    def report(self) -> dict[str, Any]:
        """All of it as plain data."""
        motion = motion_of(self.system.game)
        assert motion is not None
        values = np.array([motion.values(time) for time in self.times])
        speed = np.max(np.abs(np.diff(values, axis=0)) / np.diff(self.times)[:, None], axis=0)
        points = [self.system.path.at(time) for time in self.times]
        rates = [point.rate for point in points if np.isfinite(point.rate)]
        pushes = [point.push for point in points if np.isfinite(point.push)]
        least = self.least_monotonicity
        return {
            "keys": list(motion.keys),
            "rates": speed.tolist(),
            "unit": self.system.game.action_unit,
            "looked_at": len(self.times),
            "least_mu": least,
            "equilibrium_rate": max(rates, default=None),
            "equilibrium_rate_bound": max(pushes, default=0.0) / least
            if least is not None and least > 0.0
            else None,
            "kept": not self.obstacles,
            "obstacles": self.obstacles,
        }

    def guaranteed(self) -> list[str]:
        """That the set is kept, in continuous time."""
        if self.obstacles or mode_of(self.system).departure(self.system):
            return []
        return [
            "in continuous time every shared constraint holds as long as numbers move at finite"
            f" rates and the set has an interior, which it has at {len(self.times)} times that were"
            f" looked at{provided(conditions_of_keeping(self.system))}"
        ]

    def not_certified(self) -> list[str]:
        """What ends a run, and what is not promised of y*."""
        found = [f"that the set is kept while it moves: {why}" for why in self.obstacles]
        if mode_of(self.system).promises:
            found.append(
                "that no bound moves past the present outputs within one control period: such a"
                " run ends there, as bound_moved_past"
            )
        return [
            *found,
            "that y tends to y*, which moves: a run tells how far it is from y*(t), and beside it"
            " what that is at most, where it is known (tracking)",
        ]


@dataclass(frozen=True, eq=False)
class FallingPenalty:
    """A system whose penalty falls while its game stands still."""

    system: System

    @cached_property
    def obstacles(self) -> list[str]:
        """See :class:`MovingGame`."""
        return obstacles_to_keeping(self.system)

    def guaranteed(self) -> list[str]:
        """That the set is kept, in continuous time."""
        if self.obstacles or mode_of(self.system).departure(self.system):
            return []
        terms = provided(conditions_of_keeping(self.system))
        return [f"in continuous time every shared constraint holds while the penalty falls{terms}"]

    def not_certified(self) -> list[str]:
        """What is not promised."""
        return [
            *(f"that the set is kept while the penalty falls: {why}" for why in self.obstacles),
            "that y tends to y*, which moves with the penalty: a run tells how far it is from"
            " y*(t), and beside it what that is at most, where it is known (tracking)",
        ]


def conditions_of_keeping(system: System) -> tuple[Assumption, ...]:
    """What Theorem 6 assumes of the game: convex constraints, and an F that is bounded there."""
    game, label = system.game, "bounded F"
    slopes, still = Slopes(game, game.box, system.start, feasible=True), motion_of(game) is None
    known = slopes.label == EXACT or (still and slopes.label == BOUNDED)
    if known and np.isfinite(slopes.theta_1.value):
        bounded = Assumption(label, MET, "dF/dy is bounded over the set")
    else:
        bounded = Assumption(label, ASSUMED, "F is bounded over the set, up to its boundary")
    return convex_constraints(system), bounded


def obstacles_to_keeping(system: System) -> list[str]:
    """Why Theorem 6 does not apply to a system; empty if it does."""
    found = [f"[{c.label}] {c.why}" for c in conditions_of_keeping(system) if not c.granted]
    if not system.law.guarded or system.game.private:
        found.append("its barrier must be at the outputs as they are, and shared by all")
    if system.agents.kind not in PUSHED:
        found.append(f"{system.agents.kind.NAME}s: the proof is for outputs that inputs push")
    if system.faults or limited(system):
        found.append("the proof has neither faults nor input limits")
    if system.separation is not None:
        found.append("the bounds that keep agents apart turn besides")
    return found


def falling(system: System) -> FallingPenalty | None:
    """The examination, of a penalty that falls in continuous time; None of others."""
    falls = system.schedule is not None and motion_of(system.game) is None
    return FallingPenalty(system) if falls and not mode_of(system).held else None


def moving(system: System, clock: Clock) -> MovingGame | None:
    """The examination, of a game that moves; None of others."""
    return None if motion_of(system.game) is None else MovingGame(system, clock)
