"""What is promised of positions that follow outputs: q' = (y - q)/tau (docs/positions.md)."""

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gne_mj.motion import motion_of
from gne_mj.plants.agent_type import followed_position
from gne_mj.system import Clock, System
from gne_mj.theory.assumption import FAILS, MET, Assumption, provided
from gne_mj.theory.convexity import convex_constraints
from gne_mj.theory.theorem import CERTIFIED, CONDITIONAL, Theorem
from gne_mj.theory.zero_order_hold import ZeroOrderHold


@dataclass(frozen=True, eq=False)
class Positions:
    """Whether positions keep the constraints that outputs keep.

    Args:
        system: whose agents' positions follow their outputs.
        clock: how it steps.
    """

    system: System
    clock: Clock

    @cached_property
    def conditions(self) -> tuple[Assumption, ...]:
        """One look-ahead for all, a convex set, and positions that begin in it."""
        tau = self._numbers("lookahead")
        if np.all(tau == tau[0]):
            one = Assumption("one look-ahead", MET, f"tau = {tau[0]:g} s for all")
        else:
            why = f"tau from {np.min(tau):g} to {np.max(tau):g} s: sets that couple are not kept"
            one = Assumption("one look-ahead", FAILS, why)
        worst, value = self.system.game.tightest(self._start)
        name = self.system.game.constraint_names[worst]
        start = Assumption("positions' start", MET, f"inside, least margin {-value:.6g} ({name})")
        found = [one, convex_constraints(self.system), start]
        if (motion := motion_of(self.system.game)) is not None and motion.moves_constraints:
            why = "the set moves, and positions lag behind outputs"
            found.append(Assumption("a set that stands still", FAILS, why))
        return tuple(found)

    @property
    def granted(self) -> bool:
        """Whether positions are where outputs are kept."""
        return all(condition.granted for condition in self.conditions)

    @property
    def stepwise(self) -> bool:
        """Whether each integration step moves q to a mean of q and the new y, exactly."""
        return self.system.integrator == "euler"

    @property
    def _start(self) -> Any:
        return self.system.start_positions

    def _numbers(self, name: str) -> Any:
        agents = self.system.agents
        return agents.parameters[:, agents.kind.PARAMETERS.index(name)]

    def report(self) -> dict[str, Any]:
        """All of it as plain data."""
        agents = self.system.agents
        least = getattr(agents.kind, "least_damping", None)
        return {
            "follow": self.granted,
            "conditions": [asdict(condition) for condition in self.conditions],
            "local_damping": self._numbers("local_damping").tolist(),
            "least_damping": None if least is None else least(agents.parameters).tolist(),
        }

    def guaranteed(self, theorem: Theorem, held: ZeroOrderHold | None) -> list[str]:
        """What follows from what is guaranteed of outputs."""
        if not self.granted:
            return []
        terms = provided(self.conditions)
        if theorem.status in (CERTIFIED, CONDITIONAL):
            return [f"positions keep every shared constraint wherever outputs do so{terms}"]
        if held is None or not held.promised or not self.stepwise:
            return []
        if self.clock.steps(self.clock.control_period) == 1:
            return [
                "positions keep every shared constraint wherever outputs do so, and so at every"
                f" integration step, each of which ends a control period{terms}: safety alone,"
                " where they come to rest is measured"
            ]
        return [
            "positions keep every shared constraint up to the first integration step between two"
            f" control instants at which outputs do not{terms}: safety alone"
        ]

    def not_certified(self, held: ZeroOrderHold | None) -> list[str]:
        """Why nothing is promised of positions, where that is so."""
        found = [
            f"that positions keep the constraints: [{c.label}] {c.status}: {c.why}"
            for c in self.conditions
            if not c.granted
        ]
        if self.granted and held is not None and not self.stepwise:
            found.append(
                "that positions keep the constraints at every integration step: only Euler's moves"
                " them to means exactly; measured"
            )
        return found


def positions_of(system: System, clock: Clock) -> Positions | None:
    """The examination, of agents whose positions follow their outputs; None of others."""
    return Positions(system, clock) if followed_position(system.agents.kind) >= 0 else None
