"""What the paper's theorems guarantee for one system, and what they do not."""

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gne_mj.controllers import FullInformation, FullyDistributed, PartialInformation
from gne_mj.game import Box
from gne_mj.graph import complete
from gne_mj.system import Clock, System
from gne_mj.theory import assumptions
from gne_mj.theory.assumptions import Assumption
from gne_mj.theory.constants import Slopes
from gne_mj.theory.coupling import Coupling, coupling, needed_connectivity
from gne_mj.theory.gain import Gain, required_gain
from gne_mj.theory.periods import linear_period, push_period

CERTIFIED, CONDITIONAL, NOT_CERTIFIED = "certified", "certified for small epsilon", "not certified"
CONVENTION = "mu of (y-y')'(F(y)-F(y')) >= mu |y-y'|^2, where the paper's definition has mu/2"
THEOREMS = {
    FullInformation: "full information, lemma:FI and thm:FI",
    PartialInformation: "partial information, lemma:nonlinearPI and the theorem after it",
    FullyDistributed: "fully distributed, lemma:centreInv and the theorem after it",
}


@dataclass(frozen=True, eq=False)
class Theorem:
    """The theorem for a system's law, its assumptions and its conditions.

    Args:
        system: what is examined.
    """

    system: System

    @property
    def name(self) -> str | None:
        """Which theorem; None for a law that the paper does not have."""
        return THEOREMS.get(type(self.system.law))

    @cached_property
    def slopes(self) -> Slopes:
        """What is known of dF/dy over the set that matters.

        Feasible profiles; under partial information the box that also holds the estimates' starts:
        consensus keeps every estimate of an action between where they start and what that action
        has been, and the mean of all profiles, at which the proof takes F, lies in the box too.
        """
        partial = isinstance(self.system.law, PartialInformation)
        box = _with_estimates(self.system) if partial else self.system.game.box
        return Slopes(self.system.game, box, self.system.start, feasible=not partial)

    @cached_property
    def coupling(self) -> Coupling | None:
        """The conditions on the coupling gain, under partial information."""
        law = self.system.law
        if not isinstance(law, PartialInformation):
            return None
        return coupling(self.slopes, law.graph, law.coupling)

    @cached_property
    def under_partial_information(self) -> tuple[str, Coupling] | None:
        """What agents under another law would need under partial information (c = 1 is tried).

        On the law's "own" graph or, without one, on the "complete" one.
        """
        law = self.system.law
        if self.coupling is not None or self.system.game.agents == 1:
            return None
        own = law.graph is not None
        graph = law.graph if law.graph is not None else complete(self.system.game.agents)
        return "own" if own else "complete", coupling(self.slopes, graph, 1.0)

    @cached_property
    def gain(self) -> Gain | None:
        """The condition on k, for the fully distributed law."""
        law = self.system.law
        if not isinstance(law, FullyDistributed):
            return None
        mu = self.slopes.mu.value if self.slopes.monotone else None
        return required_gain(self.system.agents, mu, law.gain)

    @cached_property
    def assumptions(self) -> tuple[Assumption, ...]:
        """All that the theorem assumes of game, agents, graph and start."""
        if self.name is None:
            return ()
        system, slopes = self.system, self.slopes
        found = [
            assumptions.costs(system, slopes),
            assumptions.pseudo_gradient(system, slopes, strong=system.law.graph is not None),
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
        if self.name is None:
            return (f"the {self.system.law.information} law is none of the paper's",)
        found = [f"[{a.label}] {a.status}: {a.why}" for a in self.assumptions if not a.granted]
        if self.coupling is not None and not found and not self.coupling.certified:
            found.append(
                f"the coupling gain c = {self.coupling.gain:g} is not above what a condition that"
                " proves stability asks for"
            )
        gain = self.gain
        if gain is not None and gain.least is not None and not gain.gain > gain.least:
            found.append(f"the gain k = {gain.gain:g} must exceed {gain.least:.6g}")
        return tuple(found)

    @property
    def continuous(self) -> bool:
        """Whether a run follows the law in continuous time up to the integrator's error."""
        return self.system.mode == "continuous" and self.system.integrator != "euler"

    @property
    def status(self) -> str:
        """Whether the system as it is set up is certified."""
        if self.obstacles or not self.continuous:
            return NOT_CERTIFIED
        return CONDITIONAL if isinstance(self.system.law, FullyDistributed) else CERTIFIED

    @property
    def lyapunov(self) -> bool:
        """Whether V is claimed never to rise, as long as no actuator's limit is met.

        The fully distributed theorem has a Lyapunov function for its reduced system only.
        """
        if isinstance(self.system.law, FullyDistributed) or not self.continuous:
            return False
        return self.status == CERTIFIED


@dataclass(frozen=True)
class Guarantees:
    """What is guaranteed for one system; see docs/certificates.md for every entry.

    All values are plain numbers, strings, lists and dictionaries; None stands for "not known" and
    for "infinite".
    """

    system: dict[str, Any]
    status: str
    theorem: dict[str, Any]
    constants: dict[str, Any]
    graph: dict[str, Any] | None
    coupling: dict[str, Any] | None
    gain: dict[str, Any] | None
    epsilon: dict[str, Any] | None
    start: dict[str, Any]
    equilibrium: dict[str, Any]
    periods: dict[str, Any]
    lyapunov_claimed: bool

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        plain: dict[str, Any] = _plain(asdict(self))
        return plain


def certify(system: System, clock: Clock) -> Guarantees:
    """Examine a system that is to run on a clock."""
    theorem = Theorem(system)
    law, game = system.law, system.game
    return Guarantees(
        system={
            "name": system.name,
            "game": game.name,
            "agents": game.agents,
            "agent_type": system.agents.kind.NAME,
            "information": law.information,
            "mode": system.mode,
            "integrator": system.integrator,
            "engine": system.engine,
            "limited_inputs": bool(np.any(np.isfinite(system.agents.input_limit))),
        },
        status=theorem.status,
        theorem={
            "name": theorem.name,
            "assumptions": [asdict(a) for a in theorem.assumptions],
            "obstacles": list(theorem.obstacles),
            "continuous": theorem.continuous,
        },
        constants=_constants(theorem),
        graph=None
        if law.graph is None
        else {
            "edges": len(law.graph.edges),
            "lambda_2": law.graph.algebraic_connectivity,
            "lambda_max": law.graph.largest_eigenvalue,
        },
        coupling=_coupling(theorem),
        gain=None if theorem.gain is None else asdict(theorem.gain),
        epsilon={"given": law.epsilon, "star": None, "search": None}
        if isinstance(law, FullyDistributed)
        else None,
        start=_start(system, theorem.slopes.box),
        equilibrium={
            "penalised": system.equilibrium.action.tolist(),
            "p_rho": game.constraints_count * system.rho,
            "p_rho_affine": _p_rho_affine(system),
            "largest_own_p_rho": float(np.max(game.own_constraints)) * system.rho,
        },
        periods={
            "push": _at_both(system, push_period),
            "linear": _at_both(system, linear_period),
            "control_period": clock.control_period if system.mode == "sampled" else None,
            "timestep": clock.timestep,
            "largest_timestep_for_estimates": system.largest_step(),
        },
        lyapunov_claimed=theorem.lyapunov,
    )


def _constants(theorem: Theorem) -> dict[str, Any]:
    slopes = theorem.slopes
    printed, rigorous = needed_connectivity(slopes)
    box = slopes.box
    instead = theorem.under_partial_information
    return {
        **{name: asdict(getattr(slopes, name)) for name in ("mu", "theta_1", "theta_2")},
        "convention": CONVENTION,
        "domain": "everywhere"
        if slopes.label == "exact"
        else "feasible profiles"
        if slopes.feasible
        else "the box",
        "box": None if box is None else [bound.tolist() for bound in box],
        "c_lambda_2_needed": {"printed": printed, "rigorous": rigorous},
        "under_partial_information": None
        if instead is None
        else {"graph": instead[0], **asdict(instead[1])},
    }


def _coupling(theorem: Theorem) -> dict[str, Any] | None:
    conditions = theorem.coupling
    if conditions is None:
        return None
    assert isinstance(theorem.system.law, PartialInformation)
    return {**asdict(conditions), "time_constant": theorem.system.law.time_constant}


def _with_estimates(system: System) -> Box | None:
    """The game's box widened to hold all estimates' starts."""
    box = system.game.box
    if box is None:
        return None
    lower, upper = (bound.copy() for bound in box)
    rows = system.memory.reshape(system.game.agents, system.game.actions)
    for i, row in enumerate(rows):
        others = system.game.agent_of_action != i
        lower[others] = np.minimum(lower[others], row[others])
        upper[others] = np.maximum(upper[others], row[others])
    return lower, upper


def _start(system: System, box: Box | None) -> dict[str, Any]:
    game = system.game
    worst, value = game.tightest(system.start)
    found: dict[str, Any] = {
        "constraint": game.constraint_names[worst],
        "margin": -value,
        "estimates": None,
    }
    profiles = system.law.barrier_profiles(game.agent_of_action, system.memory)
    if len(profiles):
        values = game.constraints(profiles)
        agent, constraint = np.unravel_index(np.argmax(values), values.shape)
        found["estimates"] = {
            "agent": int(agent) + 1,
            "constraint": game.constraint_names[constraint],
            "margin": -float(values[agent, constraint]),
        }
    elif isinstance(system.law, PartialInformation):
        away = np.abs(system.memory.reshape(game.agents, game.actions) - system.start)
        away[game.agent_of_action, np.arange(game.actions)] = 0.0  # own blocks are no estimates
        distance = float(np.max(away))
        found["estimates"] = {"largest_distance_from_actions": distance}
    return found


def _p_rho_affine(system: System) -> float | None:
    """p rho of the same set by two affine constraints a gap."""
    game = system.game
    if game.gap_bounds is None or any(size > 1 for size in game.sizes):
        return None
    return 2 * game.constraints_count * system.rho


def _at_both(system: System, rule: Any) -> dict[str, float | None]:
    return {
        "start": rule(system, system.start),
        "equilibrium": rule(system, system.equilibrium.action),
    }


def _plain(value: Any) -> Any:
    """JSON has neither infinity nor "not a number": None."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, float | np.floating):
        return float(value) if np.isfinite(value) else None
    return value
