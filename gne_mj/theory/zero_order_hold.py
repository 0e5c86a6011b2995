"""What mode implicit promises at its control instants, and against which disturbances.

The statements and their proofs are in docs/held-inputs.md; here their conditions are looked at for
one system.
"""

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.load_margins import beyond_estimates, shrinking
from gne_mj.margins import Disturbance, Influence, influence, largest_push
from gne_mj.plants.agent_type import has_ode
from gne_mj.system import Clock, System
from gne_mj.system.first_input import first_input, law_at_start
from gne_mj.theory.assumption import ASSUMED, FAILS, MET, UNKNOWN, Assumption
from gne_mj.theory.commanded_input import CommandedInput, limited
from gne_mj.theory.convexity import convex_constraints, own_convexity
from gne_mj.theory.disturbances import greatest_change, strength, unknown_at_start
from gne_mj.theory.moving import moving
from gne_mj.theory.theorem import Theorem

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ZeroOrderHold:
    """The conditions of the promise for one system on one clock.

    Args:
        system: in a mode that promises, as implicit does.
        clock: its period and step.
    """

    system: System
    clock: Clock

    @property
    def influence(self) -> Influence | None:
        """Bounds of the plant's map over a control period; None where no ODE is known."""
        bound = self.system.disturbance
        return self._influence(0 if bound is None else bound.delay)

    def _influence(self, delay: int, steps: int | None = None) -> Influence | None:
        system, clock = self.system, self.clock
        if not has_ode(system.agents.kind):
            return None
        steps = clock.steps(clock.control_period) if steps is None else steps
        return influence(system.agents, clock.timestep, system.integrator, steps, delay)

    @cached_property
    def commanded_input(self) -> CommandedInput:
        """The first input: as a run solves for it where there are limits, else as the law reads."""
        system = self.system
        if not limited(system):
            return CommandedInput(system, np.abs(law_at_start(system)), "the law at the start")
        return CommandedInput(system, first_input(system, self.clock), "the first period")

    @property
    def conditions(self) -> tuple[Assumption, ...]:
        """What the promise rests on."""
        found = [
            self._law(),
            convex_constraints(self.system),
            self._monotone(),
            self._slopes(),
            self._inputs(),
        ]
        if (game := moving(self.system, self.clock)) is not None:
            found.append(game.assumption())
        if self.system.disturbance is not None or self.system.faults:
            found.append(self._disturbances())
        return tuple(found)

    @property
    def promised(self) -> bool:
        """Whether g < 0 at every control instant is certain, from this and every interior start."""
        return all(condition.granted for condition in self.conditions)

    def report(self) -> dict[str, Any]:
        """All of it as plain data."""
        system, effect = self.system, self.influence
        bound = system.disturbance
        return {
            "promised": self.promised,
            "conditions": [asdict(condition) for condition in self.conditions],
            "control_period": self.clock.control_period,
            "least_slope": None if effect is None else effect.least_slope.tolist(),
            "slope_exact": None if effect is None else effect.exact,
            "tightening": system.game.margins.tolist(),
            "between": system.between,
            "observer": self.observer,
            "disturbance": None
            if bound is None
            else {
                "push": bound.push.tolist(),
                "noise": bound.noise.tolist(),
                "delay": bound.delay,
            },
            "prediction_error": None
            if effect is None or bound is None
            else effect.of(self._unforeseen()).tolist(),
            "largest_push": self.largest_push(),
        }

    def largest_push(self) -> float | None:
        """The greatest push on all agents at once that the tightening covers; None if unknown.

        Besides the errors and delay of sensors that are declared, or that faults make.
        """
        declared, m = strength(self.system), self.system.game.actions
        bound = self.system.disturbance or Disturbance(np.zeros(m), np.zeros(m))
        effect = self._influence(max(bound.delay, declared.delay))
        if effect is None:
            return None
        if self.system.decentralised:
            return 0.0
        if (
            self.system.guarded or self.system.observer > 0.0
        ):  # more is not left room for at the steps on the way
            return float(np.min(bound.push))
        besides = Disturbance(np.zeros(m), np.maximum(bound.noise, declared.noise))
        return largest_push(self.system.game, effect, besides, self.system.game.margins)

    def _law(self) -> Assumption:
        label = "law"
        if self.system.law.alone:
            return Assumption(
                label,
                FAILS,
                "the fully distributed law's barriers are at estimates: each agent keeps what it"
                " takes for the profile inside, and others move meanwhile",
            )
        how = (
            "each agent by itself, to its share of every slack"
            if self.system.decentralised
            else ("the equation of all agents together")
        )
        return Assumption(label, MET, f"{self.system.law.information} information, {how}")

    def _monotone(self) -> Assumption:
        label, system = "monotone", self.system
        slopes = Theorem(system).slopes
        if system.decentralised or system.law.graph is not None:
            return own_convexity(system, slopes)  # only own derivatives of the costs enter
        if slopes.monotone:
            return Assumption(label, MET, "F is strongly monotone")
        if slopes.merely_monotone:
            return Assumption(label, MET, "F is merely monotone (mu = 0), which is enough here")
        if slopes.refuted:
            return Assumption(label, FAILS, "F is not monotone: dF/dy has a negative direction")
        return Assumption(label, ASSUMED, "F monotone, which nothing that was looked at refutes")

    def _slopes(self) -> Assumption:
        label, guarded = "dy+/du > 0", self.system.guarded
        effect = self._influence(0, 1) if guarded else self.influence
        span = "an integration step, down to which periods are cut" if guarded else "a period"
        if effect is None:
            return Assumption(
                label, UNKNOWN, "of MJCF robots no ODE is known: checked in every period of a run"
            )
        least = float(np.min(effect.least_slope))
        if least > 0:
            return Assumption(
                label,
                MET,
                f"at least {least:.4g} over {span}"
                + (", exactly" if effect.exact else ", for all states"),
            )
        if effect.exact:
            return Assumption(label, FAILS, f"it is {least:.4g} over {span}")
        return Assumption(
            label, UNKNOWN, "no bound for all states is positive: checked in every period of a run"
        )

    def _inputs(self) -> Assumption:
        if not limited(self.system):
            return Assumption("inputs", MET, "delivered as asked for")
        exceeded = self.commanded_input.exceeded
        if exceeded is not None:
            return Assumption("inputs", FAILS, f"{exceeded}: a limit is met at once")
        return Assumption(
            "inputs", ASSUMED, "as long as no input limit is met, which a run reports"
        )

    def _compared(
        self, declared: Disturbance, bound: Disturbance
    ) -> list[tuple[str, Array, Array]]:
        """What faults do, and the margin covers, by name."""
        found = [("noise", declared.noise, bound.noise)]
        if self.system.observer == 0.0:
            return [("push", declared.push, bound.push), *found]
        change = np.zeros_like(bound.push) if bound.change is None else bound.change
        span = self.clock.control_period
        return [
            ("push that is not known at the start", unknown_at_start(self.system), bound.push),
            ("change of a push in a period", greatest_change(self.system, span), change),
            *found,
        ]

    @property
    def observer(self) -> dict[str, Any] | None:
        """What is known of the observer of loads; None without one."""
        gain, effect = self.system.observer, self.influence
        if gain == 0.0:
            return None
        shrinks = None if effect is None else float(np.max(shrinking(effect, gain)[0]))
        known = shrinks is not None and shrinks < 1.0
        return {
            "gain": gain,
            "shrinks": shrinks if known else None,
            "unforeseen_push": self._unforeseen().push.tolist()
            if known and self.system.disturbance is not None
            else None,
        }

    def _unforeseen(self) -> Disturbance:
        """What predictions do not know, of what is declared."""
        system, clock = self.system, self.clock
        assert system.disturbance is not None
        return beyond_estimates(
            system.agents, clock.timestep, system.integrator, clock.steps(clock.control_period),
            system.disturbance, system.observer, system.guarded,
        )  # fmt: skip

    def _disturbances(self) -> Assumption:
        label, system = "disturbances", self.system
        bound = system.disturbance
        declared = strength(system)
        if bound is None:
            if np.any(declared.push) or np.any(declared.noise):
                return Assumption(label, FAILS, "there are faults and no [margin] that covers them")
            return Assumption(label, MET, _harmless(declared.delay))
        if system.decentralised:
            return Assumption(
                label, FAILS, "shares of slacks leave no room for disturbances: no margin is known"
            )
        for what, given, most in self._compared(declared, bound):
            if np.any(given > most * (1.0 + 1e-12)):
                worst = int(np.argmax(given - most))
                return Assumption(
                    label,
                    FAILS,
                    f"faults reach a {what} of {given[worst]:.4g} on agent"
                    f" {int(system.game.agent_of_action[worst]) + 1}, and the margin covers"
                    f" {most[worst]:.4g}",
                )
        if declared.delay > bound.delay:
            return Assumption(
                label,
                FAILS,
                f"sensors are {declared.delay} periods late, and the margin covers {bound.delay}",
            )
        why = "the barrier is tightened by what they can do within a control period"
        if system.observer > 0.0 and not has_ode(system.agents.kind):
            return Assumption(label, ASSUMED, f"{why}, dy+/du being what the observer divides by")
        if system.game.tested:
            return Assumption(label, MET, why)
        kinds = "the constraints being affine or bounds on gaps"
        return Assumption(label, ASSUMED, f"{why}, {kinds}")


def _harmless(delay: int) -> str:
    """What is so where nothing pushes agents and sensors read true, late or not."""
    if not delay:
        return "no fault pushes the agents or makes their sensors wrong"
    return (
        f"sensors are {delay} periods late and read true, and all agents' inputs since then are"
        " known, so that the plant's map looks ahead exactly"
    )
