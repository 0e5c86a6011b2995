"""The theorem that belongs to a system's law, and whether it applies."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gne_mj.bounds import MOST_EXAMINED
from gne_mj.epsilon import epsilon_bounds
from gne_mj.faults import EventTrigger, triggered
from gne_mj.game_model import Box
from gne_mj.graph import complete
from gne_mj.loops.feedback import LARGEST_INPUT
from gne_mj.motion import motion_of
from gne_mj.system import System, mode_of
from gne_mj.system.first_input import law_at_start
from gne_mj.theory import assumptions
from gne_mj.theory.assumption import FAILS, Assumption
from gne_mj.theory.commanded_input import CommandedInput, limited
from gne_mj.theory.constants import Slopes
from gne_mj.theory.convexity import convex_constraints, own_convexity
from gne_mj.theory.coupling import Coupling, coupling
from gne_mj.theory.disturbances import estimate_error
from gne_mj.theory.epsilon_star import EpsilonBound
from gne_mj.theory.gain import Gain, required_gain
from gne_mj.theory.spectra import DENSE
from gne_mj.theory.triggers import Triggers

CERTIFIED, CONDITIONAL, NOT_CERTIFIED = "certified", "certified for small epsilon", "not certified"
# Why no theorem covers agents that keep apart
SEPARATED = "agents keep apart by bounds that turn, and no theorem has constraints that do"
HELD = "certified at control instants"  # mode implicit, see gne_mj.theory.zero_order_hold


@dataclass(frozen=True, eq=False)
class Theorem:
    """The theorem for a system's law, its assumptions and its conditions.

    Args:
        system: what is examined.
    """

    system: System

    @property
    def name(self) -> str | None:
        """Which theorem; None for a law of which nothing is proven."""
        proven = self.system.law.theorem
        return None if proven is None else proven.name

    @property
    def _at_estimates(self) -> bool:
        proven = self.system.law.theorem
        return proven is not None and proven.at_estimates

    @property
    def singular_perturbation(self) -> bool:
        """Whether what is proven is for epsilon small enough."""
        proven = self.system.law.theorem
        return proven is not None and proven.singular_perturbation

    @cached_property
    def slopes(self) -> Slopes:
        """What is known of dF/dy over the set that matters.

        Feasible profiles; under partial information the box that also holds the estimates' starts:
        consensus keeps every estimate of an action between where they start and what that action
        has been, but for what faults of sensors and estimates add, and the mean of all profiles, at
        which the proof takes F, lies in the box too.
        """
        widened = self._at_estimates
        box = _with_estimates(self.system) if widened else self.system.game.box
        return Slopes(self.system.game, box, self.system.start, feasible=not widened)

    @cached_property
    def coupling(self) -> Coupling | None:
        """The conditions on the coupling gain, of a law that evaluates F at estimates."""
        law = self.system.law
        if not self._at_estimates:
            return None
        assert law.graph is not None
        return coupling(self.slopes, law.graph, law.coupling, law.kept)

    @cached_property
    def under_partial_information(self) -> tuple[str, Coupling] | None:
        """What agents under another law would need under partial information (c = 1 is tried).

        On the law's "own" graph or, without one, on the "complete" one, of up to 300 agents.
        """
        law = self.system.law
        if self.coupling is not None or self.system.game.agents == 1:
            return None
        if law.graph is None and self.system.game.agents > DENSE:
            return None
        own = law.graph is not None
        graph = law.graph if law.graph is not None else complete(self.system.game.agents)
        return "own" if own else "complete", coupling(self.slopes, graph, 1.0)

    @cached_property
    def commanded_input(self) -> CommandedInput:
        """What the law, as it reads, asks of the actuators at the start."""
        return CommandedInput(
            self.system, np.abs(law_at_start(self.system)), "the law at the start"
        )

    @cached_property
    def epsilon(self) -> dict[str, Any]:
        """What agents can gain at y* (:func:`gne_mj.epsilon.epsilon_bounds`)."""
        system = self.system
        inside = Slopes(system.game, system.game.box, system.start, feasible=True)
        parts = (own_convexity(system, inside), convex_constraints(system))
        refuted = next((part.why for part in parts if part.status == FAILS), None)
        known = system.known_equilibrium
        return epsilon_bounds(system.game, system.rho, known, refuted=refuted)

    @cached_property
    def gain(self) -> Gain | None:
        """The condition on k, where estimates are fast."""
        if not self.singular_perturbation:
            return None
        mu = self.slopes.mu.value if self.slopes.monotone else None
        return required_gain(self.system.agents, mu, self.system.law.gain)

    @cached_property
    def epsilon_bound(self) -> EpsilonBound | None:
        """How small epsilon must be at most, where estimates are fast."""
        return EpsilonBound(self.system) if self.singular_perturbation else None

    @cached_property
    def triggers(self) -> Triggers | None:
        """What is certain of agents that send by triggers; None where they do not."""
        if not triggered(self.system.faults):
            return None
        return Triggers(self.system, self.slopes if self._at_estimates else None)

    @cached_property
    def assumptions(self) -> tuple[Assumption, ...]:
        """All that the theorem assumes of game, agents, graph and start."""
        proven = self.system.law.theorem
        if proven is None:
            return ()
        system, slopes = self.system, self.slopes
        found = [
            *assumptions.shared(system),
            assumptions.costs(system, slopes),
            assumptions.pseudo_gradient(system, slopes, strong=proven.strong),
            assumptions.plants(system),
        ]
        if system.law.graph is not None:
            found.append(assumptions.graph(system))
        if self.gain is not None:
            found += [
                assumptions.output_to_state(self.gain),
                assumptions.smooth(system),
                assumptions.estimates_start(system),
            ]
        return tuple(found)

    @cached_property
    def obstacles(self) -> tuple[str, ...]:
        """Why the theorem does not apply to the law in continuous time; empty if it does."""
        if self.system.game.actions > MOST_EXAMINED:
            return (f"it has more than {MOST_EXAMINED} actions, which are too many to examine",)
        if self.name is None:
            promise = self.system.law.promise
            return (
                f"the {self.system.law.information} law is none of the paper's"
                + (f": {promise}" if promise else ""),
            )
        found = [f"[{a.label}] {a.status}: {a.why}" for a in self.assumptions if not a.granted]
        if self.coupling is not None and not found and not self.coupling.certified:
            found.append(
                f"the coupling gain c = {self.coupling.gain:g} is not above what a condition that"
                " proves stability asks for"
            )
        gain = self.gain
        if gain is not None and gain.least is not None and not gain.gain > gain.least:
            found.append(f"the gain k = {gain.gain:g} must exceed {gain.least:.6g}")
        if self.system.schedule is not None:
            found.append("the penalty changes in time, and the theorems have a constant one")
        if motion_of(self.system.game) is not None:
            found.append("the game moves, and the paper's theorems have one that stands still")
        if any(not isinstance(fault, EventTrigger) for fault in self.system.faults):
            found.append("the scenario has faults, and the theorems have none")
        if self.triggers is not None and self.triggers.why_not is not None:
            found.append(f"triggers: {self.triggers.why_not}")
        if self.system.separation is not None:
            found.append(SEPARATED)
        mode = mode_of(self.system)
        if not mode.promises and limited(self.system) and self.commanded_input.exceeded:
            found.append(
                f"{self.commanded_input.exceeded}, and the theorems have inputs without limits"
            )
        if not mode.held and np.any(self.commanded_input.asked >= LARGEST_INPUT):
            found.append(
                f"the law at the start asks for {np.max(self.commanded_input.asked):.3g}, and a run"
                f" ends as diverged from {LARGEST_INPUT:g} on"
            )
        return tuple(found)

    @property
    def continuous(self) -> bool:
        """Whether a run follows the law in continuous time up to the integrator's error."""
        return not mode_of(self.system).departure(self.system)

    @cached_property
    def status(self) -> str:
        """Whether the system as it is set up is certified."""
        if self.obstacles or not self.continuous:
            return NOT_CERTIFIED
        bound = self.epsilon_bound
        return CERTIFIED if bound is None or bound.given else CONDITIONAL

    @property
    def lyapunov(self) -> bool:
        """Whether V, or W with fast estimates, is claimed never to rise, as long as no actuator's
        limit is met."""
        return self.status == CERTIFIED


def _with_estimates(system: System) -> Box | None:
    """The game's box widened to hold all estimates' starts, and what faults make of estimates."""
    box = system.game.box
    if box is None:
        return None
    lower, upper = (bound.copy() for bound in box)
    of, values = system.law.estimates_in(system.memory, system.game.agent_of_action)
    np.minimum.at(lower, of, values)
    np.maximum.at(upper, of, values)
    error = estimate_error(system)
    return lower - error, upper + error
