"""The verdict in sentences: what is guaranteed, what only measured, what not certified."""

from typing import Any

import numpy as np

from gne_mj.system import System
from gne_mj.theory.assumption import ASSUMED
from gne_mj.theory.held import Held
from gne_mj.theory.theorem import CERTIFIED, CONDITIONAL, Theorem


def epsilon_bounds(system: System) -> dict[str, Any]:
    """Bounds of the epsilon of the limit, an epsilon-vGNE [lemma:epsilon].

    p rho, the same where affine constraints describe the set (None if the game's own do, or none
    do), and the greatest p_i rho.
    """
    game = system.game
    affine = game.affine_constraints
    return {
        "p_rho": game.constraints_count * system.rho,
        "p_rho_affine": None if affine is None else affine * system.rho,
        "largest_own_p_rho": float(np.max(game.own_constraints)) * system.rho,
    }


def guaranteed(theorem: Theorem, held: Held | None = None) -> list[str]:
    """What the theorem gives."""
    system = theorem.system
    bound = epsilon_bounds(system)
    limit = f"an epsilon-vGNE with epsilon = p rho = {bound['p_rho']:g}"
    if bound["p_rho_affine"] is not None:
        limit += f" ({bound['p_rho_affine']:g} by the affine reading)"
    limit += f", and p_i rho <= {bound['largest_own_p_rho']:g}"
    limited = np.any(np.isfinite(system.agents.input_limit))
    as_long = ", as long as no input limit is met" if limited else ""
    trust = [f"[{a.label}]" for a in theorem.assumptions if a.status == ASSUMED]
    provided = f", provided {' and '.join(trust)}" if trust else ""
    if theorem.status == CERTIFIED:
        return [
            f"in continuous time every shared constraint holds for all time{as_long}{provided}",
            f"y(t) tends to the penalised equilibrium, {limit}{as_long}{provided}",
            f"the Lyapunov function never rises{as_long}{provided}",
        ]
    if theorem.status == CONDITIONAL:
        return [
            "for all epsilon below some epsilon* > 0, in continuous time, every shared constraint"
            f" holds for all time{as_long}{provided}",
            f"for them the penalised equilibrium is exponentially stable, {limit}{as_long}"
            f"{provided}",
        ]
    if system.mode == "implicit" and held is not None and held.promised:
        terms = [f"[{c.label}] {c.why}" for c in held.conditions if c.status == ASSUMED]
        return [
            "at every control instant every shared constraint holds, from every interior start"
            + (f", provided {' and '.join(terms)}" if terms else "")
        ]
    if not theorem.obstacles:
        return ["nothing of this run; the same law in continuous time is covered by the theorem"]
    return ["nothing"]


def measured(theorem: Theorem) -> list[str]:
    """What a run tells beyond that."""
    found = ["margins of all constraints, V and the distance to y*, at every integration step"]
    if theorem.status == CERTIFIED:
        found.append("how closely the integrator follows continuous time, near the boundary too")
    if theorem.status == CONDITIONAL:
        found.append("whether the given epsilon is below epsilon*: from this start, by running")
    return found


def not_certified(theorem: Theorem, held: Held | None = None) -> list[str]:
    """What cannot be certified, and why."""
    found = list(theorem.obstacles)
    if not theorem.continuous:
        mode = theorem.system.mode
        what = f"mode '{mode}'" if mode != "continuous" else "Euler's method"
        found.append(f"{what}: every theorem of the paper is in continuous time, none covers this")
    if held is not None:
        found += [f"[{c.label}] {c.status}: {c.why}" for c in held.conditions if not c.granted]
        found.append("between two control instants: measured, and reported if the set is left")
    if theorem.status == CONDITIONAL:
        found.append(
            "that the given epsilon is small enough; and a Lyapunov function: V's decrease is"
            " claimed of the limit epsilon -> 0 only"
        )
    if held is None or held.system.disturbance is None:
        found.append("anything under pushes from outside, or inputs that saturate")
    else:
        found.append("anything beyond the disturbances that the margin covers")
    return found
