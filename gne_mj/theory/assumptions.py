"""The paper's assumptions, one by one, for one system."""

import numpy as np

from gne_mj.changing_graph import DiscGraph, SwitchingGraph
from gne_mj.margins import is_affine
from gne_mj.plants.agent_type import by_type, energy_balance, is_passive, why_not_passive
from gne_mj.system import System
from gne_mj.theory.assumption import ASSUMED, FAILS, MET, UNKNOWN, Assumption
from gne_mj.theory.constants import BOUNDED, EXACT, Slopes
from gne_mj.theory.convexity import convex_constraints, own_convexity, strictly_convex_barrier
from gne_mj.theory.gain import Gain


def shared(system: System) -> list[Assumption]:
    """[eq:GNE]: all constraints are shared; nothing is said of games where they are."""
    game = system.game
    if not game.private:
        return []
    names = ", ".join(f"'{game.constraint_names[k]}'" for k in game.private[:3])
    names += ", ..." if len(game.private) > 3 else ""
    why = (
        f"{len(game.private)} of {game.constraints_count} constraints are private ({names}): agents"
        " that appear in them can push others out, and no barrier that is common to all is left"
    )
    return [Assumption("eq:GNE", FAILS, why)]


def costs(system: System, slopes: Slopes) -> Assumption:
    """[asmp:cost]: convex costs; convex constraints, affine or one strictly; compact, Slater.

    Slater's condition is the start's.
    """
    game, label = system.game, "asmp:cost"
    own, constraints = own_convexity(system, slopes), convex_constraints(system)
    parts = [own, constraints]
    for part in parts:
        if part.status == FAILS:
            return Assumption(label, FAILS, part.why)
    strict = strictly_convex_barrier(system)
    strong = slopes.monotone and slopes.label == EXACT  # then one y* without strict convexity
    if not strict and not strong:
        return Assumption(
            label, FAILS, "phi is not strictly convex: some actions are in no constraint's reach"
        )
    status = UNKNOWN if UNKNOWN in (own.status, constraints.status) else MET
    if status == MET and (
        ASSUMED in (own.status, constraints.status) or (game.box is None and not strong)
    ):
        status = ASSUMED
    why = f"{own.why}; {constraints.why}"
    if not strict:
        why += "; phi is not strictly convex, nor need it be where F is strongly monotone"
    if game.affine_constraints is not None:
        why += (
            f"; by the {game.affine_constraints} affine constraints of the same set and barrier,"
            " since the squared gaps as printed are neither affine nor is any strictly convex"
        )
    elif game.gap_bounds is not None and strict:
        why += (
            "; in substance: no squared gap is strictly convex, but phi is, which is what the"
            " proofs use"
        )
    if game.box is None and strong:
        why += "; F is strongly monotone everywhere, so that y* is there without a compact set"
    elif game.box is None:
        why += "; that the feasible set is compact is taken on trust"
    return Assumption(label, status, why)


def pseudo_gradient(system: System, slopes: Slopes, strong: bool) -> Assumption:
    """[asmp:pseudo]: Lipschitz and strictly (a) or strongly (b) monotone."""
    label = f"asmp:pseudo({'b' if strong else 'a'})"
    where = {EXACT: "everywhere", BOUNDED: "over the box, which is where it is needed"}
    if slopes.monotone:
        return Assumption(label, MET, f"F is strongly monotone {where[slopes.label]}")
    if slopes.refuted:
        return Assumption(label, FAILS, "F is not monotone: dF/dy has a negative direction")
    if slopes.merely_monotone:
        return Assumption(
            label, FAILS, "mu = 0, F is merely monotone: the equilibrium need not be unique"
        )
    reason = (
        "bounds of dF/dy are too coarse"
        if slopes.label == BOUNDED
        else "dF/dy is known at sampled profiles only"
    )
    return Assumption(label, UNKNOWN, f"mu > 0 is not certain: {reason}")


def plants(system: System) -> Assumption:
    """[asmp:nonlinearPlant]: equilibrium-independent passive agents."""
    label = "asmp:nonlinearPlant"
    kinds = by_type(system.agents.kind, system.agents.parameters)
    names = ", ".join(f"{kind.NAME}s" for kind, _ in kinds)
    if all(is_passive(kind, rows) for kind, rows in kinds):
        return Assumption(label, MET, f"{names} with these parameters are passive")
    missing = [why_not_passive(kind, rows, system.agents.dimension) for kind, rows in kinds]
    if any(missing):
        return Assumption(label, FAILS, "; ".join(filter(None, missing)))
    if all(energy_balance(kind, rows) is not None for kind, rows in kinds):
        return Assumption(label, FAILS, f"{names} with these parameters need not be passive")
    return Assumption(label, UNKNOWN, f"nothing is known of the storage function of {names}")


def graph(system: System) -> Assumption:
    """[asmp:graph]: undirected and connected."""
    found, kept = system.law.graph, system.law.kept
    assert found is not None
    if isinstance(found, DiscGraph):
        return Assumption(
            "asmp:graph", ASSUMED, "undirected; that it stays connected only the run tells"
        )
    if isinstance(found, SwitchingGraph):
        each = f"each of the {len(found.graphs)} graphs is undirected and connected"
        return Assumption("asmp:graph", MET, each)
    why = f"undirected and connected, {len(found.edges)} edges"
    if kept is not None:
        why += "; so are the agents that keep each action, with its own agent"
    return Assumption("asmp:graph", MET, why)


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
    game = system.game
    known = all(
        energy_balance(*each) is not None
        for each in by_type(system.agents.kind, system.agents.parameters)
    )
    if known and (game.affine or (game.smooth and game.tested)):
        return Assumption("asmp:C2", MET, "agents and game are smooth")
    return Assumption("asmp:C2", ASSUMED, "smoothness is the author's duty")


def estimates_start(system: System) -> Assumption:
    """The start of z and the estimates in a ball about y(0) that lies inside [lemma:centreInv]."""
    label = "lemma:centreInv, start"
    law, game = system.law, system.game
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
    if not is_affine(game, y):
        return None
    slope = np.linalg.norm(game.constraint_jacobian(y), axis=1)
    return float(np.min(-game.constraints(y) / slope))
