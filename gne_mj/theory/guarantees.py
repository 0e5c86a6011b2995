"""What the paper's theorems guarantee for one system, and what they do not."""

from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from gne_mj.bounds import MOST_EXAMINED, check_count
from gne_mj.controllers.kept import Kept
from gne_mj.errors import part_of
from gne_mj.game_model import Box
from gne_mj.graph import Graph
from gne_mj.membership import There
from gne_mj.system import Clock, System, mode_of
from gne_mj.system.steps import largest_step
from gne_mj.theory import verdict
from gne_mj.theory.commanded_input import limited
from gne_mj.theory.constants import SAMPLED, told
from gne_mj.theory.coupling import needed_connectivity
from gne_mj.theory.moving import falling, moving
from gne_mj.theory.periods import linear_period, push_period
from gne_mj.theory.pieces import forecast
from gne_mj.theory.positions import positions_of
from gne_mj.theory.separation import kept_apart
from gne_mj.theory.theorem import HELD, NOT_CERTIFIED, Theorem
from gne_mj.theory.zero_order_hold import ZeroOrderHold

CONVENTION = "mu of (y-y')'(F(y)-F(y')) >= mu |y-y'|^2, where the paper's definition has mu/2"


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
    triggers: dict[str, Any] | None
    gain: dict[str, Any] | None
    epsilon: dict[str, Any] | None
    start: dict[str, Any]
    equilibrium: dict[str, Any]
    inputs: dict[str, Any]
    periods: dict[str, Any]
    division: dict[str, Any] | None
    held: dict[str, Any] | None
    positions: dict[str, Any] | None
    separation: dict[str, Any] | None
    moving: dict[str, Any] | None
    membership: list[dict[str, Any]] | None
    lyapunov_claimed: bool
    guaranteed: list[str]
    measured: list[str]
    not_certified: list[str]

    def __repr__(self) -> str:
        """One line; ``print`` shows the whole report."""
        return (
            f"<Guarantees of {self.system['name']!r}: {self.status}, {len(self.guaranteed)}"
            f" guaranteed, {len(self.measured)} measured, {len(self.not_certified)} not certified>"
        )

    def __str__(self) -> str:
        from gne_mj.theory.report_text import report_text

        return "\n".join(report_text(self)).strip("\n")

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        plain: dict[str, Any] = _plain(asdict(self))
        return plain


@part_of("system", "clock")
@np.errstate(over="ignore")  # what is beyond all floats is infinite, and no matter for a warning
def certify(system: System, clock: Clock) -> Guarantees:
    """Examine a system that is to run on a clock.

    Where agents leave and join every set of them that is there at some time, if all are admitted,
    is examined by itself, and what is told besides is of those at the start.

    Raises:
        InvalidInput: so many actions that matrices of so many rows and columns fill the memory.
    """
    if system.membership is None:
        return _certify(system, clock)
    found: dict[bytes, Guarantees] = {}
    intervals = []
    for time, there in system.membership.intervals(system.game.agents):
        if there.tobytes() not in found:
            among = system.among(there, system.start).system
            found[there.tobytes()] = _certify(among, clock)
        intervals.append((time, there, found[there.tobytes()]))
    return _of_intervals(system, intervals)


def _of_intervals(system: System, intervals: list[tuple[float, There, Guarantees]]) -> Guarantees:
    """All sets of agents together: from when each is there, and what is told of it by itself."""
    _, _, first = intervals[0]
    names = [", ".join(str(i + 1) for i in np.flatnonzero(there)) for _, there, _ in intervals]
    each = {name: g for name, (_, _, g) in zip(names, intervals, strict=True)}
    same = {g.status for g in each.values()}
    last = intervals[-1][2]
    covered = all(g.guaranteed != [verdict.NOTHING] for g in each.values())
    guaranteed = _told_of_sets(
        {name: [s for s in g.guaranteed if s != verdict.NOTHING] for name, g in each.items()}
    )
    if len(same) == 1 and covered:
        guaranteed = [
            f"in every interval between changes the same of those who are there ({len(each)} sets"
            " of agents), also where somebody is not admitted as long as that set is one of these",
            *(f"of those there at the end: {sentence}" for sentence in last.guaranteed),
        ]
    return replace(
        first,
        system=_system(system),
        status=first.status if len(same) == 1 else NOT_CERTIFIED,
        membership=[
            {
                "from": time,
                "agents": [int(i) + 1 for i in np.flatnonzero(there)],
                "status": g.status,
                "lyapunov_claimed": g.lyapunov_claimed,
                "lambda_2": None if g.graph is None else g.graph["lambda_2"],
                "not_certified": g.not_certified,
            }
            for time, there, g in intervals
        ],
        lyapunov_claimed=all(g.lyapunov_claimed for g in each.values()),
        guaranteed=guaranteed or [verdict.NOTHING],
        not_certified=_told_of_sets({name: g.not_certified for name, g in each.items()}),
    )


def _told_of_sets(sentences: dict[str, list[str]]) -> list[str]:
    """Sentences of sets of agents, those of all of them once."""
    of_all = [s for s in next(iter(sentences.values())) if all(s in o for o in sentences.values())]
    return of_all + [
        f"while agents {name} are there: {sentence}"
        for name, own in sentences.items()
        for sentence in own
        if sentence not in of_all
    ]


def _certify(system: System, clock: Clock) -> Guarantees:
    check_count("agents.count", system.game.actions, MOST_EXAMINED, "the actions of all")
    theorem = Theorem(system)
    held = ZeroOrderHold(system, clock) if mode_of(system).promises else None
    law, pieces = system.law, forecast(system, clock)
    positions, apart = positions_of(system, clock), kept_apart(theorem, held, clock)
    motion, known = moving(system, clock), system.known_equilibrium
    parts = [part for part in (apart, motion, falling(system)) if part is not None]
    return Guarantees(
        system=_system(system),
        status=HELD if held is not None and held.promised else theorem.status,
        theorem=_theorem(theorem),
        constants=_constants(theorem),
        graph=None if law.graph is None else _graph(law.graph, law.kept),
        coupling=_coupling(theorem),
        triggers=_triggers(theorem, clock),
        gain=None if theorem.gain is None else asdict(theorem.gain),
        epsilon=None
        if law.epsilon is None
        else {"given": law.epsilon, **_star(theorem), "search": None},
        start=_start(system, theorem.slopes.box),
        equilibrium={
            "penalised": None if known is None else known.action.tolist(),
            **theorem.epsilon,
        },
        inputs=(theorem if held is None else held).commanded_input.report(),
        periods=_periods(system, clock),
        division=None if pieces is None else asdict(pieces),
        held=None
        if held is None
        else {**held.report(), "period_search": None, "push_search": None},
        positions=None if positions is None else positions.report(),
        separation=None if apart is None else apart.report(),
        moving=None if motion is None else motion.report(),
        membership=None,
        lyapunov_claimed=theorem.lyapunov,
        guaranteed=verdict.together(
            verdict.guaranteed(theorem, held),
            [] if positions is None else positions.guaranteed(theorem, held),
            *(part.guaranteed() for part in parts),
        ),
        measured=verdict.measured(theorem, pieces),
        not_certified=[
            *verdict.not_certified(theorem, held, pieces),
            *([] if positions is None else positions.not_certified(held)),
            *(each for part in parts for each in part.not_certified()),
        ],
    )


def _system(system: System) -> dict[str, Any]:
    return {
        "name": system.name,
        "game": system.game.name,
        "agents": system.game.agents,
        "agent_type": system.agents.kind.NAME,
        "information": system.law.information,
        "mode": system.mode,
        "integrator": system.integrator,
        "engine": system.engine,
        "limited_inputs": limited(system),
    }


def _theorem(theorem: Theorem) -> dict[str, Any]:
    return {
        "name": theorem.name,
        "assumptions": [asdict(a) for a in theorem.assumptions],
        "obstacles": list(theorem.obstacles),
        "continuous": theorem.continuous,
    }


def _graph(graph: Graph, kept: Kept | None) -> dict[str, Any]:
    return {
        "edges": len(graph.edges),
        "lambda_2": graph.algebraic_connectivity,
        "lambda_max": graph.largest_eigenvalue,
        "changes": graph.changes,
        "kept": None
        if kept is None
        else {
            "estimates": len(kept.keeper) - graph.agents,
            "of": graph.agents * (graph.agents - 1),
            "lambda_2": kept.connectivity,
            "smallest": bool(np.all(kept.keepers.smallest)),
        },
    }


def _constants(theorem: Theorem) -> dict[str, Any]:
    slopes = theorem.slopes
    certain = slopes.label != SAMPLED  # of samples nothing follows that would suffice
    printed, rigorous = needed_connectivity(slopes) if certain else (np.nan, np.nan)
    box = slopes.box
    instead = theorem.under_partial_information
    return {
        **{
            name: {**asdict(getattr(slopes, name)), "told": told(name, slopes.label)}
            for name in ("mu", "theta_1", "theta_2")
        },
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
    return {**asdict(conditions), "time_constant": theorem.system.law.time_constant}


def _triggers(theorem: Theorem, clock: Clock) -> dict[str, Any] | None:
    """Of agents that send by triggers; two messages of one are a control period apart, or more."""
    triggers = theorem.triggers
    if triggers is None:
        return None
    return {**triggers.report(), "least_time": clock.control_period}


def _star(theorem: Theorem) -> dict[str, Any]:
    """What is certain of small epsilon; of a theorem that does not apply only why nothing is."""
    nothing = dict.fromkeys(("star", "label", "fast_weight", "no_star", "kept"))
    if theorem.epsilon_bound is None:
        return nothing
    if theorem.obstacles:
        return nothing | {"no_star": f"the theorem does not apply: {theorem.obstacles[0]}"}
    return theorem.epsilon_bound.report()


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
    elif system.law.has_estimates:
        of, values = system.law.estimates_in(system.memory, game.agent_of_action)
        distance = float(np.max(np.abs(values - system.start[of]), initial=0.0))
        found["estimates"] = {"largest_distance_from_actions": distance}
    return found


def _periods(system: System, clock: Clock) -> dict[str, Any]:
    """Rules of thumb for periods and steps in s."""
    return {
        "push": _at_both(system, push_period),
        "linear": _at_both(system, linear_period),
        "control_period": clock.control_period if mode_of(system).held else None,
        "timestep": clock.timestep,
        "largest_timestep_for_estimates": largest_step(system),
    }


def _at_both(system: System, rule: Any) -> dict[str, float | None]:
    known = system.known_equilibrium
    return {
        "start": rule(system, system.start),
        "equilibrium": None if known is None else rule(system, known.action),
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
