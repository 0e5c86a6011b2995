"""What to use, from what an examination found: a scenario that runs, and a reason for each key."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.examination.holding import Held
from gne_mj.examination.report import Recommendation
from gne_mj.examination.responses import Slopes, lag
from gne_mj.examination.stable_steps import StableSteps

PERIODS = (0.02, 0.01, 0.005, 0.002)  # s, the first that fits
STEPS = (0.01, 0.005, 0.002, 0.001, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5)  # s
RESERVE = 0.5  # of the longest stable step
SPREAD = 2.0  # of dy+/du over states, for an observer (docs/held-inputs.md)
DEVELOPED = 1.5  # power of time with which a response that lags may still grow
NEAR = 0.8  # of a limit
OFF_CENTRE = 0.005  # m that a quadrotor's output may be from its centre of mass untold
SHIFTS = 0.01  # of the wished output, or of 0.1 if that is more: a lesser shift is not told
SLOWER = 3.0  # a step of rk4 costs more than so many of euler
COUNT, DURATION = 3, 10.0  # robots, and s, of the scenario


@dataclass(frozen=True)
class Found:
    """What was measured.

    Args:
        file: as the scenario is to name it.
        output, input: as a scenario has them.
        keyframe: in which it begins; None for the file's pose.
        wished: (d,) outputs.
        rest, held, slopes, degrees, dead_time, steps, limits: see
            :class:`gne_mj.examination.report.Examination`.
        fresh: whether outputs are known at every stage of a step.
        touches: whether it touches anything where it begins.
        off_centre: m from its centre of mass to the output's point; 0 where there is none.
    """

    file: str
    output: Any
    input: Any
    keyframe: str | None
    wished: NDArray[np.float64]
    rest: Held
    held: Held
    slopes: Slopes
    degrees: list[int | None]
    dead_time: float | None
    steps: StableSteps
    limits: NDArray[np.float64]
    fresh: bool
    touches: bool
    off_centre: float

    @property
    def lags(self) -> bool:
        """See :func:`gne_mj.examination.responses.lag`."""
        return lag(self.degrees)


def step_for(steps: StableSteps, integrator: str, longest: float = STEPS[0]) -> float:
    """The longest of STEPS (s) that is well below the stable one, and at most ``longest``."""
    stable = RESERVE * steps.longest[integrator]
    return next((each for each in STEPS if each <= min(stable, longest) * (1 + 1e-9)), STEPS[-1])


def recommend(found: Found) -> Recommendation:
    """See the module."""
    if found.dead_time is None:
        return Recommendation(
            False, ["There is nothing to recommend: name another output or input."], {},
            ["The input does not move the output."],
        )  # fmt: skip
    turned = found.slopes.most[0] < 0.0 and len(found.wished) == 1
    slopes = _turned(found.slopes) if turned else found.slopes
    input_ = _opposite(found.input) if turned else found.input
    clock, reasons = _clock(found, slopes)
    shift = _shift(found, slopes)
    controller, more = _controller(found, slopes, clock["control_period"], shift)
    limited = bool(np.all(np.isfinite(found.limits)))
    if limited:
        more.append("input_limit: what the file's actuators let through.")
    if turned:
        more.append("input: with the factor -1, so that the output rises with it.")
    if found.held.held:
        room = max(found.held.off, max(found.held.ripple) * abs(slopes.most[0]))
        more.append(
            f"margin: give bounds {room:.2g} more than you need, as far as outputs were off while"
            " they were held; of MJCF robots [margin] is for noise alone."
        )
    agents = {
        "type": "mjcf-robot", "count": COUNT, "file": found.file, "output": found.output,
        "input": input_,
    }  # fmt: skip
    if found.keyframe is not None:
        agents["keyframe"] = found.keyframe
    if limited:
        limits = found.limits.tolist()
        agents["input_limit"] = limits[0] if len(limits) == 1 else [limits] * COUNT
    d = len(found.wished)
    system = {
        "game": _game(found.wished, slopes), "agents": agents, "controller": controller,
        "initial": {"action": 0.0 if d == 1 else [[0.0] * d] * COUNT},
    }  # fmt: skip
    tables = {"simulation": clock, "systems": {"robots": system}}
    cautions = _cautions(found, slopes, turned, "" if "compensation" in controller else shift)
    return Recommendation(True, [*reasons, *more], tables, cautions)


def _clock(found: Found, slopes: Slopes) -> tuple[dict[str, Any], list[str]]:
    """The scenario's simulation, and why."""
    offered = _developed(slopes) if found.lags else PERIODS
    rising = slopes.rising(found.lags)
    low, high = min(rising, default=np.inf), max(rising, default=0.0)
    if low == slopes.periods[0]:  # and below
        low = 0.0
    good = [each for each in offered if low * (1 - 1e-9) <= each <= high * (1 + 1e-9)]
    narrow = [each for each in good if _spread(slopes, each) < SPREAD]
    period = (narrow or good or [*offered, PERIODS[1]])[0]
    longest = found.steps.longest
    integrator = "euler" if SLOWER * longest["euler"] >= longest["rk4"] else "rk4"
    step = step_for(found.steps, integrator, period)
    step = next(
        each for each in (*STEPS, step)
        if each <= step and abs(period / each - round(period / each)) < 1e-9
    )  # fmt: skip
    why = (
        f"over it the output rises with its input at all {slopes.states} states that were tried"
        if good
        else "though over none does the output rise with its input at all states"
    )
    reasons = [
        f"control_period: {1e3 * period:g} ms; {why}.",
        f"timestep: {1e3 * step:g} ms with {integrator}, of which"
        f" {1e3 * longest[integrator]:.3g} ms are still stable.",
    ]
    clock = {
        "duration": DURATION, "timestep": step, "control_period": period, "integrator": integrator
    }  # fmt: skip
    return clock, reasons


def _developed(slopes: Slopes) -> list[float]:
    """Periods in s after which a response that lags grows nearly in proportion to time.

    Inputs that are renewed sooner swing: zeros of the sampled map lie outside the unit circle.
    """
    most = np.abs(slopes.most)
    grows = np.log(most[1:] / most[:-1]) / np.log(
        np.divide(slopes.periods[1:], slopes.periods[:-1])
    )
    return [
        float(f"{each:.6g}")
        for each, power in zip(slopes.periods[:-1], grows, strict=True)
        if power <= DEVELOPED
    ]


def _controller(
    found: Found, slopes: Slopes, period: float, shift: str
) -> tuple[dict[str, Any], list[str]]:
    """The scenario's law, and why; ``shift`` is what :func:`_shift` tells."""
    if not (slopes.rising(found.lags) and found.fresh):
        return {"information": "full", "mode": "sampled"}, [
            "mode: sampled, which promises nothing; implicit needs an output that is fresh and"
            " rises with its input at all states."
        ]
    reasons = ["mode: implicit, which keeps all bounds at control instants."]
    table: dict[str, Any] = {"information": "full", "mode": "implicit"}
    if shift:
        table["compensation"] = True
        reasons.append(
            "compensation: what the file has of gravity, drag and friction is taken off. Without:"
            f" {shift}"
        )
    spread = _spread(slopes, period)
    if spread < SPREAD:
        table["observer"] = 1.0
        reasons.append(
            f"observer: 1, so that loads which the file does not have are taken off; dy+/du varies"
            f" by a factor of {spread:.3g} only."
        )
    return table, reasons


def _shift(found: Found, slopes: Slopes) -> str:
    """How far what the wished output asks for shifts the equilibrium; empty if not far."""
    load, weight = float(np.max(np.abs(found.held.input))), _weight(slopes)
    size = float(np.max(np.abs(found.wished)))
    if not found.held.held or load <= SHIFTS * weight * max(size, 0.1):
        return ""
    away = min(load / weight, size or np.inf)
    return (
        f"at the wished output the input holds {load:.3g}, and robots rest where costs rise by as"
        f" much as the input there, here up to {away:.2g} away from y*."
    )


def _cautions(found: Found, slopes: Slopes, turned: bool, shift: str) -> list[str]:
    """What is wrong, or must be known; ``shift`` is what :func:`_shift` tells."""
    said = []
    flies = isinstance(found.input, dict) and found.input.get("controller") == "quadrotor"
    if flies and found.touches:
        said.append(
            "It stands on something where it begins, and no tilt moves it there: let it begin in"
            " the air, in a keyframe of its file or a pose."
        )
    if flies and found.off_centre > OFF_CENTRE:
        said.append(
            f"Its centre of mass lies {100.0 * found.off_centre:.2g} cm from the output's point,"
            " which a tilt first moves the wrong way: take a site at that centre."
        )
    if turned:
        said.append("The output falls where its input rises: the input is to be turned round.")
    longest = max(slopes.rising(found.lags), default=0.0)
    if longest < PERIODS[0] and not turned:
        said.append(
            f"dy+/du is not positive at all states over more than {1e3 * longest:.3g} ms"
            f" (at the worst at {min(slopes.positive):.0%} of them): nothing is promised over"
            " longer periods."
            if longest
            else "dy+/du is not positive at all states, from the shortest period on: nothing is"
            " promised."
        )
    degrees = [each for each in found.degrees if each is not None]
    if max(degrees, default=1) > 1:
        advice = "choose the velocity of what it moves, or a look-ahead"
        if isinstance(found.input, dict) and "controller" in found.input:
            advice = "costs may only ask for changes that are slow beside the controller"
        said.append(
            f"The relative degree is {max(degrees)}, so that the robot is not passive from this"
            f" input to this output: {advice}."
        )
    for seen, name in ((found.rest, "at rest"), (found.held, "at the wished output")):
        load = float(np.max(np.abs(seen.input) / found.limits))
        if not seen.held:
            stop = "; a limited joint needs its position as output, by a lookahead" * (
                "stop" in seen.why
            )
            said.append(f"It could not be held {name}: {seen.why}{stop}.")
        elif load > NEAR:
            said.append(f"Held {name} it needs {load:.0%} of its limit.")
    if shift:
        said.append(shift[0].upper() + shift[1:])
    if found.steps.growth > 0.1:
        said.append(
            f"By itself it leaves its state at up to {found.steps.growth:.3g} 1/s:"
            " it stands only as long as something holds it."
        )
    return said


def _game(wished: NDArray[np.float64], slopes: Slopes) -> dict[str, Any]:
    """One in which each wants the wished output, as heavy as a second's time constant needs."""
    gap = 3.0 * max(float(np.max(np.abs(wished))), 1e-3)
    weight = _weight(slopes)
    if len(wished) > 1:
        return {
            "type": "velocity-consensus", "reference_velocity": wished.tolist(),
            "leader_weight": [weight] * COUNT, "gap_bound": gap, "leader_gap_bound": gap,
        }  # fmt: skip
    return {
        "type": "expressions", "cost": "0.5 * weight * (y[i] - wanted)**2",
        "constraints": {"gap": "abs(y[i] - y[i-1]) <= gap"},
        "parameters": {"weight": weight, "wanted": float(wished[0]), "gap": gap},
    }  # fmt: skip


def _weight(slopes: Slopes) -> float:
    """Of costs, so that outputs come closer with a time constant of a second."""
    return float(f"{slopes.periods[0] / max(abs(slopes.most[0]), 1e-9):.3g}")


def _spread(slopes: Slopes, period: float) -> float:
    """By what factor dy+/du varies over a period, at most."""
    row = int(np.argmin(np.abs(np.array(slopes.periods) - period)))
    least, most = slopes.least[row], slopes.most[row]
    return most / least if least > 0.0 else np.inf


def _turned(slopes: Slopes) -> Slopes:
    """Those of the input that is turned round."""
    return Slopes(
        slopes.periods, [-each for each in slopes.most], [-each for each in slopes.least],
        [1.0 - each for each in slopes.positive], slopes.states, slopes.coupling,
    )  # fmt: skip


def _opposite(given: Any) -> Any:
    """An input the other way round."""
    if isinstance(given, str):
        return {"actuators": [given], "factors": [-1.0]}
    if isinstance(given, dict) and "actuators" in given:
        factors = given.get("factors", [1.0] * len(given["actuators"]))
        return {**given, "factors": [-each for each in factors]}
    return given
