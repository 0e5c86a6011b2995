"""The paper's assumptions, one by one, for one system."""

from dataclasses import dataclass

import numpy as np

from gne_mj.controllers import FullyDistributed
from gne_mj.system import System
from gne_mj.theory.constants import BOUNDED, EXACT, Slopes, positive_definite, profiles
from gne_mj.theory.gain import Gain, types

MET, ASSUMED, UNKNOWN, FAILS = "met", "assumed", "unknown", "not met"


@dataclass(frozen=True)
class Assumption:
    """One assumption.

    Attributes:
        label: the paper's, e.g. "asmp:cost".
        status: "met"; "assumed" (the author of the game or law answers for it; nothing that was
            looked at speaks against it); "unknown" (not certified); or "not met".
        why: one sentence.
    """

    label: str
    status: str
    why: str

    @property
    def granted(self) -> bool:
        """Whether conclusions may be drawn from it."""
        return self.status in (MET, ASSUMED)


def costs(system: System, slopes: Slopes) -> Assumption:
    """[asmp:cost]: convex costs; convex constraints, affine or one strictly; compact, Slater."""
    game = system.game
    label = "asmp:cost"
    if not slopes.monotone:
        status = FAILS if slopes.refuted and slopes.label == EXACT else UNKNOWN
        return Assumption(label, status, "convexity of the costs is not certain where mu is not")
    # What the barrier's curvature spans does not depend on how near each bound is: all weigh alike.
    slopes_of = game.constraint_jacobian(system.start)
    ones = np.ones(game.constraints_count)
    span = slopes_of.T @ slopes_of + game.weighted_constraint_hessian(system.start, ones)
    floor = 1e-12 * np.max(np.abs(span))
    if not positive_definite(span - floor * np.eye(game.actions)):
        return Assumption(
            label, FAILS, "phi is not strictly convex: some actions are in no constraint's reach"
        )
    compact = "" if game.box is not None else "; that the feasible set is compact is taken on trust"
    status = MET if game.box is not None else ASSUMED
    if game.gap_bounds is not None:
        if game.affine_constraints is not None:
            reading = (
                f"by the {game.affine_constraints} affine constraints of the same set and barrier;"
                " the squared gaps as printed are neither affine nor is any strictly convex"
            )
        else:
            reading = (
                "in substance: no squared gap is strictly convex, but phi is, which is what the"
                " proofs use"
            )
        return Assumption(label, status, reading + compact)
    points = profiles(game, system.start, game.box, 20, feasible=True)
    curvature = [_curvatures(system, y) for y in points]
    if all(np.all(c == 0.0) for c in curvature):
        own = game.kernels.__name__.startswith("gne_mj.games.")
        seen = "" if own else f" at {len(points)} sampled profiles, which is no proof"
        return Assumption(
            label, status if own else ASSUMED, f"costs convex, constraints affine{seen}{compact}"
        )
    least = min(float(np.linalg.eigvalsh(c).min()) for c in curvature)
    if least < -1e-6:
        return Assumption(label, FAILS, f"a constraint's second derivative has {least:.3g}")
    return Assumption(
        label,
        ASSUMED,
        f"constraints convex at {len(points)} sampled profiles, which is no proof" + compact,
    )


def _curvatures(system: System, y: np.ndarray) -> np.ndarray:
    """Second derivatives of each constraint, (p, m, m), for small games; else of their sum."""
    p, m = system.game.constraints_count, system.game.actions
    weights = np.eye(p) if p * m * m <= 1e6 else np.ones((1, p))
    return np.array([system.game.weighted_constraint_hessian(y, w) for w in weights])


def convex_constraints(system: System) -> Assumption:
    """Convex constraints, which shares of their slacks rest on."""
    game, label = system.game, "convex constraints"
    if game.gap_bounds is not None:
        return Assumption(label, MET, "bounds on gaps are")
    points = profiles(game, system.start, game.box, 20, feasible=True)
    curvature = [_curvatures(system, y) for y in points]
    if min(float(np.linalg.eigvalsh(c).min()) for c in curvature) < -1e-6:
        return Assumption(label, FAILS, "a constraint curves the other way at a sampled profile")
    if game.kernels.__name__.startswith("gne_mj.games."):
        return Assumption(label, MET, "they are affine")
    return Assumption(label, ASSUMED, f"at {len(points)} sampled profiles, which is no proof")


def pseudo_gradient(system: System, slopes: Slopes, strong: bool) -> Assumption:
    """[asmp:pseudo]: Lipschitz and strictly (a) or strongly (b) monotone."""
    label = f"asmp:pseudo({'b' if strong else 'a'})"
    where = {EXACT: "everywhere", BOUNDED: "over the box, which is where it is needed"}
    if slopes.monotone:
        return Assumption(label, MET, f"F is strongly monotone {where[slopes.label]}")
    if slopes.refuted:
        return Assumption(label, FAILS, "F is not monotone: dF/dy has a negative direction")
    reason = (
        "bounds of dF/dy are too coarse"
        if slopes.label == BOUNDED
        else "dF/dy is known at sampled profiles only"
    )
    return Assumption(label, UNKNOWN, f"mu > 0 is not certain: {reason}")


def plants(system: System) -> Assumption:
    """[asmp:nonlinearPlant]: equilibrium-independent passive agents."""
    label = "asmp:nonlinearPlant"
    kinds = types(system.agents)
    names = ", ".join(f"{kind.NAME}s" for kind, _ in kinds)
    if all(getattr(kind, "is_passive", lambda _: False)(rows) for kind, rows in kinds):
        return Assumption(label, MET, f"{names} with these parameters are passive")
    if all(hasattr(kind, "energy_balance") for kind, _ in kinds):
        return Assumption(label, FAILS, f"{names} with these parameters need not be passive")
    return Assumption(label, UNKNOWN, f"nothing is known of the storage function of {names}")


def graph(system: System) -> Assumption:
    """[asmp:graph]: undirected and connected."""
    assert system.law.graph is not None
    edges = len(system.law.graph.edges)
    return Assumption("asmp:graph", MET, f"undirected and connected, {edges} edges")


def output_to_state(gain: Gain) -> Assumption:
    """[asmp:OSSPassive]: V decays where the output rests."""
    label = "asmp:OSSPassive"
    if gain.fails:
        names = " and ".join(f"{name}s" for name in gain.fails)
        return Assumption(label, FAILS, f"V does not decay in all states of {names}")
    if gain.unknown:
        names = " and ".join(f"{name}s" for name in gain.unknown)
        return Assumption(label, UNKNOWN, f"{names} tell no energy balance")
    which = "any beta > 0" if not gain.beta else f"any beta > {gain.beta:.6g}"
    return Assumption(label, MET, f"with {which}")


def smooth(system: System) -> Assumption:
    """[asmp:C2]: f and F twice, V three times continuously differentiable."""
    own = system.game.kernels.__name__.startswith("gne_mj.games.")
    known = all(hasattr(kind, "energy_balance") for kind, _ in types(system.agents))
    if known and (own or system.game.affine):
        return Assumption("asmp:C2", MET, "agents and game are smooth")
    return Assumption("asmp:C2", ASSUMED, "smoothness is the author's duty")


def estimates_start(system: System) -> Assumption:
    """The start of z and the estimates in a ball about y(0) that lies inside [lemma:centreInv]."""
    label = "lemma:centreInv, start"
    law, game = system.law, system.game
    assert isinstance(law, FullyDistributed)
    own = law.barrier_profiles(game.agent_of_action, system.memory)
    distance = float(np.linalg.norm(own - system.start))
    if distance == 0.0:
        return Assumption(label, MET, "estimates and z start at y(0)")
    if not np.all(game.constraints(own) < 0.0):
        return Assumption(
            label, FAILS, "an agent's profile starts outside a constraint that is not its own"
        )
    radius = _distance_to_boundary(system)
    if radius is None or distance >= radius:
        return Assumption(
            label, UNKNOWN, f"estimates and z start {distance:.3g} from y(0), all of them inside"
        )
    return Assumption(
        label, MET, f"they start {distance:.3g} from y(0), the boundary is {radius:.3g} away"
    )


def _distance_to_boundary(system: System) -> float | None:
    """From y(0), where it is known: for affine constraints."""
    game, y = system.game, system.start
    if np.any(_curvatures(system, y)):
        return None
    slope = np.linalg.norm(game.constraint_jacobian(y), axis=1)
    return float(np.min(-game.constraints(y) / slope))
