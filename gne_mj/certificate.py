"""What one system's run showed, measured at every integration step: status and certificate."""

from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj import exits, kept_apart, monitored, outside, run_metrics, tracking
from gne_mj.epsilon import epsilon_at, epsilon_bounds
from gne_mj.equilibrium import Equilibrium, measured_epsilon, variational_equilibrium
from gne_mj.errors import SolverError
from gne_mj.loops import monitor as watch
from gne_mj.margins import of_the_set
from gne_mj.motion import motion_of
from gne_mj.registry import MODES
from gne_mj.run_metrics import SUCCESSES, TAIL
from gne_mj.system import Clock, System, mode_of
from gne_mj.theory import Theorem
from gne_mj.those_present import ThosePresent, distances, those_present

# V may rise by this much of its start through rounding alone.
ROUNDING = 1e-12


@dataclass(frozen=True)
class Certificate:
    """What is claimed of a run and what was measured; times in s, None where not applicable.

    Attributes:
        status: one of the statuses of the README, with its sentence in ``message``.
        worst_constraint: the least margin -g over all constraints and integration steps, and
            ``each`` constraint's own.
        worst_gap: for games of bounded gaps, the gap that used most of its bound.
        outside: how far, how often and how long outside the set (:func:`gne_mj.outside.report`).
        equilibrium: penalised and variational, how far from them the run ended, and when it settled
            to the variational one as ``settling_time`` has it; of a game that moves those of the
            end, as is epsilon, and settling and ``converged`` are of the distance to y*(t).
        tracking: of games or penalties that move, the distance to y*(t) beside its bound
            (:func:`gne_mj.tracking.report`); None of others.
        epsilon: what agents could gain at the penalised equilibrium, against
            :func:`gne_mj.epsilon.epsilon_bounds`, and where the run ended.
        settling_time: after which max |y - y*| stays within 2% of its start, at sample times; where
            agents leave and join, of what it was when the last of them did.
        lyapunov: V over the run (V^{x*}, and under partial information the estimates' part),
            whether it is known (not of MJCF robots, nor without a y*), and whether the theory
            claims that it never rises (:class:`gne_mj.theory.Theorem`), for the set-up and as long
            as no input limit is met.
        actuators: peak, RMS and energy of the inputs, and where a limit was met.
        positions: of agents whose positions follow their outputs: how often these were observed
            and how often outside, and the least margin -g at them; None of others.
        contacts: of agents whose bodies collide in MuJoCo: how many contacts between two agents
            there were (each counted at every step that it lasted), at how many steps, the first
            one, whose it was, and how deep bodies were in each other; None of others.
        between: where control periods may end early: how many did, when the first one began and
            the length of the shortest; None elsewhere.
        separation: of agents that keep apart: the least distance of two positions (None if no two
            came within reach), and the pairs that hold a run which rests away from the
            equilibrium; None of others.
        membership: of agents that leave and join: who was there ``at_start``, and each of the
            ``changes`` with its time, what, whether it was done (if not, why) and who was there
            then; None of others. ``equilibrium`` and ``epsilon`` are of those there at the end.
        network: of a graph that changes: how often it did (``changes``), and for how long it was
            not connected (``disconnected``, s); None of others.
        messages: in the held modes, under laws with a graph that stays: how many were sent over
            links (``sent``), and how many are if all send once a control period (``periodic``);
            where agents send by triggers what is proven of these besides (``triggers``, see
            :mod:`gne_mj.theory.triggers`); None of others.
        exit: where the run left, the law and the input that led there; None if it did not.
        of_modes: each mode's section (:meth:`gne_mj.system.modes.Mode.report`) by its name, None in
            other modes: ``division``, of mode continuous with a fixed step, and ``implicit``, of
            how many periods of which (``covered``) the promise for control instants speaks.
        steps, end_time, wall_time: integration steps taken, pieces of divided ones counted;
            simulated and real time.
        step_time: real time that a step took; None if there was none.
        not_reached: of a run that came to its end without settling, why, each with ``reason``,
            ``agents``, ``text`` and ``figures`` (:mod:`gne_mj.not_reached`); None of others.
    """

    status: str
    message: str
    worst_constraint: dict[str, Any] | None
    worst_gap: dict[str, Any] | None
    outside: dict[str, Any]
    equilibrium: dict[str, Any]
    tracking: dict[str, Any] | None
    epsilon: dict[str, Any]
    settling_time: float | None
    lyapunov: dict[str, Any]
    actuators: dict[str, Any]
    positions: dict[str, Any] | None
    contacts: dict[str, Any] | None
    between: dict[str, Any] | None
    separation: dict[str, Any] | None
    membership: dict[str, Any] | None
    network: dict[str, Any] | None
    messages: dict[str, Any] | None
    exit: dict[str, Any] | None
    of_modes: dict[str, Any]
    steps: int
    end_time: float
    wall_time: float
    step_time: float | None
    not_reached: list[dict[str, Any]] | None = None

    @property
    def holds(self) -> bool:
        """Whether the run ended well: inside the set at every step, to its end."""
        return self.status in SUCCESSES

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, strings and lists, for JSON; the sections of modes among the others."""
        found = asdict(self)
        of_modes = found.pop("of_modes")
        return {**found, **of_modes}


@np.errstate(over="ignore")  # what is beyond all floats is infinite, and no matter for a warning
def certify_run(
    system: System,
    time: NDArray[np.float64],
    action: NDArray[np.float64],
    inputs: NDArray[np.float64],
    monitor: Any,
    *,
    tolerance: float,
    duration: float,
    wall_time: float,
    interrupted: bool,
    intervened: bool,
    network: dict[str, Any] | None = None,
    membership: dict[str, Any] | None = None,
    clock: Clock | None = None,
) -> Certificate:
    """Put together what a run of ``system`` showed.

    Args:
        system: what was run.
        time: sample times (samples,).
        action, inputs: y and u there (samples, m), not numbers where there are none.
        monitor: the loop's flat array of what was seen at every step.
        tolerance: for the status ``converged``.
        duration: how long the run was meant to last.
        wall_time: real time that it took.
        interrupted: the user stopped it.
        intervened: the user pushed agents or changed numbers meanwhile, so that nothing is claimed.
        network, membership, clock: what the loop tells, and how it stepped, where that is known.
    """
    distance = distances(system, time, action)
    status, message = _status(system, time, distance, monitor, tolerance, duration, interrupted)
    present = those_present(system, time, action, membership)
    holding = present.holding((status, duration, tolerance))
    return Certificate(
        status=status,
        message=message + present.told(holding) + _interpolated_text(inputs, action, monitor),
        worst_constraint=monitored.worst_constraint(system, monitor),
        worst_gap=monitored.worst_gap(system, monitor),
        outside=outside.report(system.game, monitor, system.goes_on),
        equilibrium=present.spread(_equilibrium(present.system, present.action, present.time)),
        tracking=tracking.report(system, time, action, clock, _spoilt(monitor, intervened)),
        epsilon=_epsilon(present.system, time[-1], present.action[-1]),
        settling_time=_settling_time(present.time, distance[-len(present.time) :]),
        lyapunov=_lyapunov(present, monitor, intervened),
        actuators=monitored.actuators(system, monitor),
        positions=monitored.positions(system, monitor),
        contacts=monitored.contacts(system, monitor),
        between=monitored.between(system, monitor),
        separation=kept_apart.report(system, monitor, holding),
        membership=membership,
        network=network,
        messages=_messages(system, monitor, clock),
        exit=exits.exit_report(system, monitor),
        of_modes=_of_modes(system, monitor),
        steps=int(monitor.steps),
        end_time=float(time[-1]),
        wall_time=wall_time,
        step_time=wall_time / float(monitor.steps) if monitor.steps > 0 else None,
    )


def _settling_time(time: NDArray[np.float64], distance: NDArray[np.float64]) -> float | None:
    (settled,) = run_metrics.settling_time(time, distance[None])
    return None if np.isnan(settled) else float(settled)


def _interpolated_text(
    inputs: NDArray[np.float64], action: NDArray[np.float64], monitor: Any
) -> str:
    """What is added to a status where samples between steps have no input, of who is there."""
    missing = int(np.sum(np.any(np.isnan(inputs) & ~np.isnan(action), axis=1)))
    if not missing or monitor.exit != watch.INSIDE:
        return ""
    return (
        f"; at {missing} sample times the state interpolated between two integration steps is"
        " outside, though both steps are inside"
    )


def status_now(system: System, monitor: Any) -> dict[str, Any]:
    """How a run that goes on stands: status, sentence, least margin so far, when it left.

    Args:
        system: what runs.
        monitor: the loop's flat array of what was seen at every step.
    """
    worst = monitored.worst_constraint(system, monitor) or {}
    now: dict[str, Any] = {
        "status": "running",
        "message": "",
        "margin": worst.get("margin"),
        "margin_name": worst.get("name"),
        "margin_time": worst.get("time"),
        "exit_time": None,
        "exit_agents": [],
    }
    if monitor.exit != watch.INSIDE:
        now["status"], now["message"] = exits.exit_status(system, monitor)
        now["exit_time"] = float(monitor.exit_time)
        now["exit_agents"] = exits.concerned(system, monitor)
    return now


def _status(
    system: System,
    time: NDArray[np.float64],
    distance: NDArray[np.float64],
    monitor: Any,
    tolerance: float,
    duration: float,
    interrupted: bool,
) -> tuple[str, str]:
    if monitor.exit != watch.INSIDE:
        name, sentence = exits.exit_status(system, monitor)
        return name, sentence + exits.certified_until(system, monitor)
    end = float(time[-1])
    if interrupted:
        return "interrupted", f"stopped by the user at {end:g} s of {duration:g} s"
    if monitor.exits > 0:
        return run_metrics.WENT_OUTSIDE, outside.sentence(system.game, monitor, end)
    (tail,) = run_metrics.tail_distance(time, distance[None], duration)
    (word,) = run_metrics.status(watch.together([monitor]), np.array([tail]), tolerance)
    moves = motion_of(system.game) is not None
    which = "penalised equilibrium of each time" if moves else "penalised equilibrium"
    if word == "converged":
        return (
            "converged",
            f"within {tail:.2g} of the {which} over the last"
            f" {TAIL * duration:g} s (tolerance {tolerance:g})",
        )
    if np.isnan(distance[-1]):
        return (
            "completed",
            f"ran its {duration:g} s inside the set; no penalised equilibrium was found, so that"
            " how far it is, how soon the run settles and V are not known",
        )
    return (
        "completed",
        f"ran its {duration:g} s inside the set; {distance[-1]:.3g} from the"
        f" {'moving ' * moves}penalised equilibrium at the end (tolerance {tolerance:g})",
    )


def _of_modes(system: System, monitor: Any) -> dict[str, Any]:
    """What each mode's runs report, by section; None in other modes."""
    found: dict[str, Any] = {each.section: None for each in MODES if each.section}
    mode = mode_of(system)
    if mode.section and mode.reports(system):
        found[mode.section] = mode.report(system, monitor)
    return found


def _spoilt(monitor: Any, intervened: bool) -> str:
    """What was met in a run so that nothing is certain of how it tracks y*."""
    if intervened:
        return "agents were pushed or numbers changed meanwhile"
    if monitor.saturated:
        return f"an input met its limit at {monitor.saturated_time:g} s"
    return "some inputs were not accurate" if monitor.unsolved else ""


def _equilibrium(
    system: System, action: NDArray[np.float64], time: NDArray[np.float64]
) -> dict[str, Any]:
    penalised, last = system.equilibrium_at(time[-1]), action[-1]
    if penalised is None:
        keys = (
            "penalised", "multipliers", "residual", "final_distance", "variational",
            "final_distance_to_variational", "settling_time_to_variational",
        )  # fmt: skip
        return dict.fromkeys(keys)
    result: dict[str, Any] = {
        "penalised": penalised.action.tolist(),
        "multipliers": penalised.multipliers.tolist(),
        "residual": penalised.residual,
        "final_distance": float(np.max(np.abs(last - penalised.action))),
    }
    still = motion_of(system.game) is None
    variational = system.variational if still else _variational_at(system, penalised, time[-1])
    known = variational is not None
    y = variational.action if variational is not None else np.full(len(last), np.nan)
    distance = np.max(np.abs(action - y), axis=1)
    (settled,) = run_metrics.settling_time(time, distance[None])
    result["variational"] = y.tolist() if known else None
    result["final_distance_to_variational"] = float(distance[-1]) if known else None
    settles = still and known and not np.isnan(settled)
    result["settling_time_to_variational"] = float(settled) if settles else None
    return result


def _variational_at(system: System, penalised: Equilibrium, time: float) -> Equilibrium | None:
    """Of a game that moves, that of a time in s; None where none was found."""
    try:
        return variational_equilibrium(of_the_set(system.game_at(time)), penalised)
    except SolverError:
        return None


def _epsilon(system: System, end: float, y: NDArray[np.float64]) -> dict[str, Any]:
    # What agents could gain is asked of the set itself, also where the barrier keeps farther away.
    known, gains, game = system.equilibrium_at(end), None, system.game_at(end)
    if known is not None:
        with suppress(SolverError):
            gains = measured_epsilon(of_the_set(game), known.action)
    return {
        "measured": None if gains is None else float(np.max(gains)),
        "at_end": epsilon_at(of_the_set(game), y) if np.all(np.isfinite(y)) else None,
        **epsilon_bounds(game, system.rho, known, gains=gains),
    }


def _messages(system: System, monitor: Any, clock: Clock | None) -> dict[str, Any] | None:
    seen = monitored.messages(system, monitor, clock)
    triggers = None if seen is None else Theorem(system).triggers
    if seen is None or triggers is None:
        return seen
    return {**seen, "triggers": triggers.report()}


def _lyapunov(present: ThosePresent, monitor: Any, intervened: bool) -> dict[str, Any]:
    system = present.system
    start, rise = float(monitor.storage_start), float(monitor.storage_rise)
    still = motion_of(system.game) is None
    # V is about y*
    about = still and all(each.known_equilibrium is not None for each in present.systems)
    known = about and system.agents.knows_storage
    unhindered = bool(monitor.started) and not monitor.saturated
    claimed = known and unhindered and not intervened
    claimed = claimed and all(Theorem(each).lyapunov for each in present.systems)
    return {
        "claimed": claimed,
        "known": known,
        "start": start if about else None,
        "final": float(monitor.storage) if about else None,
        "largest_rise": rise if about else None,
        "largest_rise_time": float(monitor.storage_rise_time) if about and rise > 0 else None,
        "monotone": rise <= ROUNDING * max(start, 1.0) if about else None,
        "observed_until": float(monitor.time),
        "left": bool(monitor.exit != watch.INSIDE),
    }
