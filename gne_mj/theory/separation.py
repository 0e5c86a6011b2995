"""What is promised of agents that keep apart by half-planes (in space half-spaces) that turn.

docs/positions.md has the proof, which is the same in both.
"""

from dataclasses import dataclass
from typing import Any

from gne_mj.separation import Separation
from gne_mj.system import Clock
from gne_mj.theory.theorem import SEPARATED, Theorem
from gne_mj.theory.zero_order_hold import ZeroOrderHold


@dataclass(frozen=True, eq=False)
class KeptApart:
    """Whether the positions of agents keep a distance.

    Args:
        rule: which.
        theorem: for their law.
        held: what their mode promises, if it does.
        clock: how they step.
    """

    rule: Separation
    theorem: Theorem
    held: ZeroOrderHold | None
    clock: Clock

    @property
    def kept_by(self) -> str:
        """What keeps each pair of agents apart."""
        return "half-planes" if self.theorem.system.agents.dimension == 2 else "half-spaces"

    @property
    def obstacles(self) -> list[str]:
        """Why that is not certain; empty if it is."""
        if self.held is None:
            found = [each for each in self.theorem.obstacles if each != SEPARATED]
            if not self.theorem.continuous:
                found.append(f"{self.kept_by} hold in continuous time only")
            return found
        found = [f"[{c.label}] {c.why}" for c in self.held.conditions if not c.granted]
        if self.theorem.system.integrator != "euler":
            found.append("only Euler's steps move positions to means of outputs exactly")
        elif self.clock.steps(self.clock.control_period) > 1:
            found.append("outputs are on their own between two control instants")
        return found

    def report(self) -> dict[str, Any]:
        """All of it as plain data."""
        return {
            "distance": self.rule.distance,
            "reach": self.rule.reach,
            "turn": self.rule.turn,
            "by": self.kept_by,
            "promised": not self.obstacles,
            "obstacles": self.obstacles,
        }

    def guaranteed(self) -> list[str]:
        """That they keep it, where it is certain."""
        if self.obstacles:
            return []
        kept = f"the positions of any two agents are at least {self.rule.distance:g} m apart"
        if self.held is None:  # between two renewals half-planes are shared constraints
            return [
                "in continuous time every shared constraint holds for all time",
                f"{kept} in continuous time",
            ]
        return [
            f"{kept} at every integration step, each of which ends a control period, unless its"
            " input was not found accurately"
        ]

    def not_certified(self) -> list[str]:
        """That agents arrive; and why they need not keep apart."""
        found = [f"that agents keep {self.rule.distance:g} m apart: {why}; measured"
                 for why in self.obstacles]  # fmt: skip
        return [
            *found,
            "that agents arrive: those that keep apart can hold each other at rest away from the"
            " equilibrium, and a run says which do",
        ]


def kept_apart(theorem: Theorem, held: ZeroOrderHold | None, clock: Clock) -> KeptApart | None:
    """The examination, of agents that keep apart; None of others."""
    rule = theorem.system.separation
    return None if rule is None else KeptApart(rule, theorem, held, clock)
