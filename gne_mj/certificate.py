"""What one system's run showed, measured at every integration step: status and certificate."""

from contextlib import suppress
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj import kept_apart, run_metrics, tracking
from gne_mj.epsilon import epsilon_bounds
from gne_mj.equilibrium import measured_epsilon, variational_equilibrium
from gne_mj.errors import SolverError
from gne_mj.faults import triggered
from gne_mj.loops import monitor as watch
from gne_mj.loops.division import PIECES
from gne_mj.margins import of_the_set
from gne_mj.motion import motion_of
from gne_mj.plants.agent_type import followed_position
from gne_mj.registry import MODES
from gne_mj.run_metrics import EXITS, SUCCESSES, TAIL
from gne_mj.system import Clock, System, mode_of
from gne_mj.system.first_input import limits_at
from gne_mj.theory import Theorem

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
        equilibrium: penalised and variational, and how far from them the run ended; of a game that
            moves those of the end, as is epsilon, and settling and ``converged`` are of the
            distance to y*(t).
        tracking: of games or penalties that move, the distance to y*(t) beside its bound
            (:func:`gne_mj.tracking.report`); None of others.
        epsilon: what agents could gain at the penalised equilibrium, against
            :func:`gne_mj.epsilon.epsilon_bounds`.
        settling_time: after which max |y - y*| stays within 2% of its start, at sample times.
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
        network: of a graph that changes: how often it did (``changes``), and for how long it was
            not connected (``disconnected``, s); None of others.
        messages: where agents send by triggers: how many came over links (``sent``), and how many
            would have if all sent once a control period (``periodic``); None of others.
        exit: where the run left, the law and the input that led there; None if it did not.
        of_modes: each mode's section (:meth:`gne_mj.system.modes.Mode.report`) by its name, None in
            other modes: ``division``, of mode continuous with a fixed step, and ``implicit``, of
            how many periods of which (``covered``) the promise for control instants speaks.
        steps, end_time, wall_time: integration steps taken, pieces of divided ones counted;
            simulated and real time.
    """

    status: str
    message: str
    worst_constraint: dict[str, Any] | None
    worst_gap: dict[str, Any] | None
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
    network: dict[str, Any] | None
    messages: dict[str, Any] | None
    exit: dict[str, Any] | None
    of_modes: dict[str, Any]
    steps: int
    end_time: float
    wall_time: float

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
    clock: Clock | None = None,
) -> Certificate:
    """Put together what a run of ``system`` showed.

    Args:
        system: what was run.
        time: sample times (samples,).
        action: y at the sample times (samples, m).
        inputs: u there (samples, m), not a number where there is none.
        monitor: the loop's flat array of what was seen at every step.
        tolerance: for the status ``converged``.
        duration: how long the run was meant to last.
        wall_time: real time that it took.
        interrupted: the user stopped it.
        intervened: the user pushed agents or changed numbers meanwhile, so that nothing is claimed.
        clock: how it stepped; None where that is not known.
    """
    distance = np.max(np.abs(action - system.equilibria(time)), axis=1)
    (settled,) = run_metrics.settling_time(time, distance[None])
    status, message = _status(system, time, distance, monitor, tolerance, duration, interrupted)
    holding = kept_apart.holding(system, time, action, (status, duration, tolerance))
    message += kept_apart.held_text(holding) + _interpolated_text(inputs, monitor)
    return Certificate(
        status=status,
        message=message,
        worst_constraint=_worst_constraint(system, monitor),
        worst_gap=_worst_gap(system, monitor),
        equilibrium=_equilibrium(system, action[-1], time[-1]),
        tracking=tracking.report(system, time, action, clock, _spoilt(monitor, intervened)),
        epsilon=_epsilon(system, time[-1]),
        settling_time=None if np.isnan(settled) else float(settled),
        lyapunov=_lyapunov(system, monitor, intervened),
        actuators=_actuators(system, monitor),
        positions=_positions(system, monitor),
        contacts=_contacts(system, monitor),
        between=_between(system, monitor),
        separation=kept_apart.report(system, monitor, holding),
        network=network,
        messages=_messages(system, monitor),
        exit=_exit_report(system, monitor),
        of_modes=_of_modes(system, monitor),
        steps=int(monitor.steps),
        end_time=float(time[-1]),
        wall_time=wall_time,
    )


def _interpolated_text(inputs: NDArray[np.float64], monitor: Any) -> str:
    """What is added to a status where samples between steps have no input."""
    missing = int(np.sum(np.any(np.isnan(inputs), axis=1)))
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
    worst = _worst_constraint(system, monitor) or {}
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
        now["status"], now["message"] = _exit(system, monitor)
        now["exit_time"] = float(monitor.exit_time)
        now["exit_agents"] = _concerned(system, monitor)
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
        return _exit(system, monitor)
    end = float(time[-1])
    if interrupted:
        return "interrupted", f"stopped by the user at {end:g} s of {duration:g} s"
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
    if system.equilibrium_at(end) is None:
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


def _exit(system: System, monitor: Any) -> tuple[str, str]:
    game = system.game
    at = f"at {monitor.exit_time:.6g} s"
    if monitor.exit_stage > 0:
        at += f" (stage {int(monitor.exit_stage) + 1} of the integration step)"
    value = float(monitor.exit_value)
    code = int(monitor.exit)
    if code == watch.DIVERGED:
        return EXITS[code], f"an output or input is no longer a usable number ({value:g}) {at}"
    if code == watch.FORCES_LOST:
        from gne_mj.plants.native_mujoco import lost_text  # late: MuJoCo is slow to import

        return EXITS[code], f"{at} {lost_text(int(value))}"
    if (pair := kept_apart.pair_of(monitor)) is not None:
        return EXITS[code], kept_apart.exit_text(system, monitor, pair, at)
    constraint = game.constraint_names[int(monitor.exit_constraint)]
    if code == watch.FORESEEN:
        return (
            EXITS[code],
            f"held for even one integration step from {at[3:]} on, the input that there is would"
            f" violate constraint '{constraint}' (predicted g = {value:.6g}), and it was not given:"
            f" {_instead(system)} can go on there",
        )
    if code == watch.STEP_TOO_SMALL:
        return (
            EXITS[code],
            f"1/{PIECES} of the timestep is still too long next to constraint '{constraint}' {at}"
            f" (g = {value:.6g}): {_instead(system)} can go on there",
        )
    if code == watch.MOVED_PAST:
        return (
            EXITS[code],
            f"constraint '{constraint}' moves past the present outputs within the control period"
            f" that begins {at}: g = {value:.6g} at its end, not negative",
        )
    if monitor.exit_between > 0:
        at += ", between two control instants"
    if code == watch.LEFT_SET:
        return (
            EXITS[code],
            f"constraint '{constraint}' was violated {at}: g = {value:.6g}, not negative",
        )
    agent = int(monitor.exit_agent) + 1
    if agent == 0:
        tightened = np.any(game.margins)
        return (
            EXITS[code],
            f"the measured profile violated constraint '{constraint}'"
            f"{', tightened,' if tightened else ''} {at}: g{' + t' if tightened else ''} ="
            f" {value:.6g}, not negative, so the law has no action there",
        )
    return (
        EXITS[code],
        f"agent {agent}'s estimates violated constraint '{constraint}' {at}: g = {value:.6g}, not"
        " negative, so its law has no action there (a smaller epsilon or gain keeps estimates"
        " closer to the actions)",
    )


def _exit_report(system: System, monitor: Any) -> dict[str, Any] | None:
    """What led to an exit: the last input that was held, and under which law."""
    if monitor.exit == watch.INSIDE:
        return None
    constraint = int(monitor.exit_constraint)
    pair = kept_apart.pair_of(monitor)
    known = monitor.exit != watch.DIVERGED and pair is None
    agent = int(monitor.exit_agent) + 1 if pair is None else 0
    return {
        "time": float(monitor.exit_time),
        "stage": int(monitor.exit_stage) + 1,
        "at_control_instant": not monitor.exit_between > 0,
        "constraint": system.game.constraint_names[constraint] if known else None,
        "value": float(monitor.exit_value),
        "estimates_of_agent": agent or None,
        "agents": _concerned(system, monitor),
        "information": system.law.information,
        "mode": system.mode,
        "last_input": monitor.last_u.tolist(),
    }


def _concerned(system: System, monitor: Any) -> list[int]:
    """The agents, from 1, that an exit is of: in the constraint, or the one with the estimates."""
    if monitor.exit == watch.DIVERGED:
        return []
    if (pair := kept_apart.pair_of(monitor)) is not None:
        return sorted({i + 1 for i in pair})
    agent = int(monitor.exit_agent)
    members = system.game.in_constraint[int(monitor.exit_constraint)]
    return [agent + 1] if agent >= 0 else sorted(i + 1 for i in members)


def _instead(system: System) -> str:
    """What does where steps are too long next to a bound."""
    ways = ["a larger rho", "a smaller timestep"]
    if system.mode != "implicit":
        ways.insert(0, "mode 'implicit'")
    if system.law.rosenbrock and system.engine == "ode":
        ways.insert(0, "integrator 'rosenbrock'")
    return f"{', '.join(ways[:-1])} or {ways[-1]}"


def _of_modes(system: System, monitor: Any) -> dict[str, Any]:
    """What each mode's runs report, by section; None in other modes."""
    found: dict[str, Any] = {each.section: None for each in MODES if each.section}
    mode = mode_of(system)
    if mode.section and mode.reports(system):
        found[mode.section] = mode.report(system, monitor)
    return found


def _worst(system: System, monitor: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Each constraint's greatest value and when, that at an exit included."""
    worst, when = run_metrics.worst_constraints(watch.together([monitor]))
    return worst[0], when[0]


def _worst_constraint(system: System, monitor: Any) -> dict[str, Any] | None:
    worst, when = _worst(system, monitor)
    index = int(np.argmax(worst))
    if not np.isfinite(worst[index]):
        return None
    return {
        "name": system.game.constraint_names[index],
        "index": index + 1,
        "margin": float(-worst[index]),
        "each": [float(-value) if np.isfinite(value) else None for value in worst],
        "time": float(when[index]),
    }


def _positions(system: System, monitor: Any) -> dict[str, Any] | None:
    """Where positions stood that follow outputs, at every integration step."""
    if followed_position(system.agents.kind) < 0 or not monitor.positions:
        return None
    return {
        "observed": int(monitor.positions),
        "outside": int(monitor.positions_outside),
        "least_margin": -float(monitor.positions_worst),
        "constraint": system.game.constraint_names[int(monitor.positions_constraint)],
        "time": float(monitor.positions_worst_time),
    }


def _contacts(system: System, monitor: Any) -> dict[str, Any] | None:
    """What was seen of contacts between agents, at every integration step."""
    if not system.agents.contacts:
        return None
    any_at_all = monitor.contacts > 0
    agents = [1 + int(monitor.contact_agent), 1 + int(monitor.contact_other)]
    return {
        "count": int(monitor.contacts),
        "steps": int(monitor.touching),
        "first": float(monitor.contact_time) if any_at_all else None,
        "agents": agents if any_at_all else None,
        "depth": float(monitor.contact_depth),
    }


def _messages(system: System, monitor: Any) -> dict[str, Any] | None:
    """What agents sent, and would have sent once a control period."""
    if not triggered(system.faults):
        return None
    assert system.law.graph is not None
    links = 2 * len(system.law.graph.edges)
    return {
        "sent": int(monitor.messages),
        "periodic": links * int(monitor.message_instants),
    }


def _between(system: System, monitor: Any) -> dict[str, Any] | None:
    """What a guard did between control instants."""
    if not system.guarded:
        return None
    any_at_all = monitor.cut > 0
    return {
        "periods_cut": int(monitor.cut),
        "first_cut": float(monitor.cut_time) if any_at_all else None,
        "shortest_period": float(monitor.shortest_period) if any_at_all else None,
    }


def _worst_gap(system: System, monitor: Any) -> dict[str, Any] | None:
    worst, when = _worst(system, monitor)
    bounds = system.game.gap_bounds
    if bounds is None or not np.any(np.isfinite(worst)):
        return None
    motion = motion_of(system.game)
    others = () if motion is None else [each.gap_bounds for each in motion.others]
    if not all(each is not None and np.array_equal(each, bounds) for each in others):
        return None  # bounds that move
    gaps = np.sqrt(np.maximum(worst + bounds**2, 0.0))
    index = int(np.argmax(gaps / bounds))
    return {
        "name": system.game.constraint_names[index],
        "index": index + 1,
        "gap": float(gaps[index]),
        "bound": float(bounds[index]),
        "unit": system.game.action_unit,
        "time": float(when[index]),
        "each": gaps.tolist(),
    }


def _spoilt(monitor: Any, intervened: bool) -> str:
    """What was met in a run so that nothing is certain of how it tracks y*."""
    if intervened:
        return "agents were pushed or numbers changed meanwhile"
    if monitor.saturated:
        return f"an input met its limit at {monitor.saturated_time:g} s"
    return "some inputs were not accurate" if monitor.unsolved else ""


def _equilibrium(system: System, last: NDArray[np.float64], end: float) -> dict[str, Any]:
    penalised = system.equilibrium_at(end)
    if penalised is None:
        keys = (
            "penalised", "multipliers", "residual", "final_distance", "variational",
            "final_distance_to_variational",
        )  # fmt: skip
        return dict.fromkeys(keys)
    result: dict[str, Any] = {
        "penalised": penalised.action.tolist(),
        "multipliers": penalised.multipliers.tolist(),
        "residual": penalised.residual,
        "final_distance": float(np.max(np.abs(last - penalised.action))),
    }
    try:
        variational = variational_equilibrium(of_the_set(system.game_at(end)), penalised)
        result["variational"] = variational.action.tolist()
        result["final_distance_to_variational"] = float(np.max(np.abs(last - variational.action)))
    except SolverError:
        result["variational"] = result["final_distance_to_variational"] = None
    return result


def _epsilon(system: System, end: float) -> dict[str, Any]:
    # What agents could gain is asked of the set itself, also where the barrier keeps farther away.
    known, gains, game = system.equilibrium_at(end), None, system.game_at(end)
    if known is not None:
        with suppress(SolverError):
            gains = measured_epsilon(of_the_set(game), known.action)
    return {
        "measured": None if gains is None else float(np.max(gains)),
        **epsilon_bounds(game, system.rho, known, gains=gains),
    }


def _lyapunov(system: System, monitor: Any, intervened: bool) -> dict[str, Any]:
    start, rise = float(monitor.storage_start), float(monitor.storage_rise)
    still = motion_of(system.game) is None
    about = still and system.known_equilibrium is not None  # V is about y*
    known = about and system.agents.knows_storage
    unhindered = bool(monitor.started) and not monitor.saturated
    claimed = known and unhindered and not intervened and Theorem(system).lyapunov
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


def _actuators(system: System, monitor: Any) -> dict[str, Any]:
    peak, when, rms, energy = (each[0] for each in run_metrics.inputs(watch.together([monitor])))
    agent = system.game.agent_of_action
    largest = int(np.argmax(peak))
    limits = system.agents.input_limit
    result: dict[str, Any] = {
        "peak": float(peak[largest]),
        "peak_agent": int(agent[largest]) + 1,
        "peak_time": float(when[largest]),
        "peaks": peak.tolist(),
        "rms": rms.tolist(),
        "energy": energy.tolist(),
        "limits": None if np.all(np.isinf(limits)) else limits.tolist(),
        "saturated": None,
    }
    if monitor.saturated > 0:
        index = int(monitor.saturated_action)
        result["saturated"] = {
            "agent": int(agent[index]) + 1,
            "time": float(monitor.saturated_time),
            "demand": float(monitor.saturated_command),
            "limit": float(limits_at(system, float(monitor.saturated_time))[index]),
        }
    return result
