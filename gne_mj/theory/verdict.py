"""The verdict in sentences: what is guaranteed, what only measured, what not certified."""

from gne_mj.motion import motion_of
from gne_mj.plants.agent_type import has_ode
from gne_mj.system import mode_of
from gne_mj.theory.assumption import ASSUMED, provided
from gne_mj.theory.commanded_input import limited
from gne_mj.theory.pieces import Pieces
from gne_mj.theory.theorem import CERTIFIED, CONDITIONAL, Theorem
from gne_mj.theory.zero_order_hold import ZeroOrderHold

NOTHING = "nothing"
_AT_INSTANTS = (
    "at every control instant every shared constraint holds, from every interior start, unless the"
    " input of the period before was not found accurately (a run counts those: not_accurate)"
)
_BETWEEN = (
    "at every integration step every shared constraint holds, from every interior start: control"
    " periods that would lead outside are cut (a run counts those: periods_cut); should no input of"
    " one step be found that leads inside, the run ends before it, as exit_foreseen"
)
_FORESEEN = (
    "without disturbances the run does not leave the set at any integration step: control periods"
    " that would lead outside are cut, and where one step would, the run ends before it, as"
    " exit_foreseen"
)


def guaranteed(theorem: Theorem, held: ZeroOrderHold | None = None) -> list[str]:
    """What the theorem gives."""
    system = theorem.system
    limit = _limit(theorem)
    as_long = ", as long as no input limit is met" if limited(system) else ""
    trust = [f"[{a.label}]" for a in theorem.assumptions if a.status == ASSUMED]
    terms = f", provided {' and '.join(trust)}" if trust else ""
    if theorem.status == CERTIFIED:
        return [
            f"in continuous time every shared constraint holds for all time{as_long}{terms}",
            f"y(t) tends to the penalised equilibrium, {limit}{as_long}{terms}",
            f"the Lyapunov function never rises{as_long}{terms}",
        ]
    if theorem.status == CONDITIONAL:
        assert theorem.epsilon_bound is not None
        star = theorem.epsilon_bound.star
        small = "below some epsilon* > 0" if star is None else f"up to {star.epsilon:.4g} s"
        return [
            f"for all epsilon {small}, in continuous time, every shared constraint"
            f" holds for all time{as_long}{terms}",
            f"for them the penalised equilibrium is exponentially stable, {limit}{as_long}{terms}",
        ]
    if held is not None and held.promised:
        promise = _BETWEEN if held.system.guarded else _AT_INSTANTS
        return [promise + provided(held.conditions)]
    if held is None and system.guarded and has_ode(system.agents.kind):
        return [_FORESEEN]
    if not theorem.obstacles:
        sent = ", triggers being looked at at all times," if theorem.triggers is not None else ""
        return [
            f"nothing of this run; the same law in continuous time{sent} is covered by the theorem"
            f"{as_long}{_after_triggers(theorem)}"
        ]
    return [NOTHING]


def _after_triggers(theorem: Theorem) -> str:
    """What is left of the theorem where agents send by triggers."""
    triggers = theorem.triggers
    if triggers is None:
        return ""
    if triggers.converges:
        return f", but that V can rise by {triggers.rises:.4g} in all"
    return (
        f", but that V falls where |e| > {triggers.ball:.4g} only, e being all profiles' distance"
        " from y*"
    )


def together(*found: list[str]) -> list[str]:
    """All sentences of what is guaranteed; that it is nothing only where there is no other."""
    sentences = [each for some in found for each in some]
    return [each for each in sentences if each != NOTHING] or [NOTHING]


def _limit(theorem: Theorem) -> str:
    """What y* is."""
    bound = theorem.epsilon
    if bound["bound"] is None:
        return "an epsilon-vGNE, of which nothing more is known since it was not found"
    margin = " + sum lambda_l t_l" if bound["of_margin"] else ""
    limit = f"an epsilon-vGNE with epsilon = p rho{margin} = {bound['bound']:g}"
    if bound["bound_affine"] is not None:
        limit += f" ({bound['bound_affine']:g} by the affine reading)"
    return f"{limit}, and over its own constraints each agent's <= {bound['largest_own_bound']:g}"


def measured(theorem: Theorem, pieces: Pieces | None = None) -> list[str]:
    """What a run tells beyond that."""
    found = ["margins of all constraints, V and the distance to y*, at every integration step"]
    if motion_of(theorem.system.game) is not None:
        found = ["margins of all constraints at every integration step, and the distance to y*(t)"]
    if theorem.status == CERTIFIED:
        found.append("how closely the integrator follows continuous time, near the boundary too")
    if pieces is not None:
        found.append(
            f"how finely steps are divided on the way; where 1/{pieces.finest} of the timestep does"
            " not do, the run ends as step_too_small"
        )
    if theorem.status == CONDITIONAL:
        found.append("whether the given epsilon is small enough: from this start, by running")
    return found


def not_certified(
    theorem: Theorem, held: ZeroOrderHold | None = None, pieces: Pieces | None = None
) -> list[str]:
    """What cannot be certified, and why."""
    found = list(theorem.obstacles)
    other = pieces is not None and pieces.ends not in (None, "step_too_small")
    if pieces is not None and other:
        found.append(f"that this run goes on to its end: its first step ends it as {pieces.ends}")
    places = (
        [] if pieces is None else [("start", pieces.start), ("equilibrium", pieces.equilibrium)]
    )
    found += [
        f"that this run goes on to its end: at the {place} pieces finer than 1/{pieces.finest} of"
        " the timestep are needed, and it ends there as step_too_small (mode 'implicit', a larger"
        " rho or a smaller timestep can go on)"
        for place, count in places
        if pieces is not None and count is None and not (other and place == "start")
    ]
    if not theorem.continuous:
        what = mode_of(theorem.system).departure(theorem.system)
        found.append(f"{what}: every theorem of the paper is in continuous time, none covers this")
    if held is not None:
        found += [f"[{c.label}] {c.status}: {c.why}" for c in held.conditions if not c.granted]
        found.append(
            "between two integration steps: nothing is looked at there"
            if held.system.guarded and held.promised
            else "between two control instants: measured, and reported if the set is left"
        )
    if theorem.status == CONDITIONAL:
        found.append(
            "that the given epsilon is small enough; and a Lyapunov function: that W falls is"
            " claimed of certified epsilon only"
        )
    if theorem.system.agents.contacts:
        found.append("anything once bodies of two agents have touched: a run counts contacts")
    if held is None or held.system.disturbance is None:
        found.append("anything under pushes from outside, or inputs that saturate")
    else:
        found.append("anything beyond the disturbances that the margin covers")
    return found
