"""The examination of one robot: what is looked at, in which order."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput, renaming
from gne_mj.examination.bench import BUILT, Bench, bench
from gne_mj.examination.holding import PERIOD, Held, hold
from gne_mj.examination.offers import keyframes, offers
from gne_mj.examination.proposal import agents_of, entries, propose
from gne_mj.examination.recommendation import Found, recommend
from gne_mj.examination.report import Examination, Recommendation
from gne_mj.examination.responses import dead_time, relative_degrees, slopes
from gne_mj.examination.stable_steps import stable_steps, worst
from gne_mj.passivity import examine as trials_of
from gne_mj.passivity import plants_of
from gne_mj.plants import mjcf_file
from gne_mj.plants.base import Plant
from gne_mj.plants.mjcf_robot import MjcfRobots
from gne_mj.progress import Tell, nothing

Array = NDArray[np.float64]
TIMESTEP = 0.002  # s, if that is stable
SHOTS = 6  # states under random inputs besides those on the way to the held ones
SHARE = 0.1  # of the wished output: how far inputs move it while its response is looked at
LAGGING, LINEAR = 0.5, 2.6  # s; a response in proportion to time doubles, with some room
LATER = 0.2  # s in which inputs of what lags have shown
INTEGRATORS = ("rk4", "euler")
TRIALS, LASTING = 4, 2.0  # of passivity, and s


_NOTHING = "No actuator with a name gives a force at a joint or tendon, and no named body floats."
_NAMELESS = " Some things of it have no name: give them one."


@dataclass(frozen=True)
class Subject:
    """What is to be examined.

    Args:
        file: as messages and scenarios name it.
        robot: one robot, with d channels.
        output: as a scenario has them.
        input: likewise.
        keyframe: in which it begins; None for its file's pose.
    """

    file: str
    robot: MjcfRobots
    output: Any
    input: Any
    keyframe: str | None = None


def examine(
    path: Path,
    file: str,
    output: Any = None,
    input: Any = None,
    wished: Array | None = None,
    *,
    keyframe: str | None = None,
    passivity: bool = True,
    progress: Tell = nothing,
) -> Examination:
    """Examine a file's robot.

    Args:
        path: of the MJCF file.
        file: as the recommended scenario is to name it.
        output: as a scenario's table has them; both proposed if left out.
        input: likewise.
        wished: (d,) outputs that are to be held, 0.5 each if left out.
        keyframe: of the file, in which it begins.
        passivity: whether to try that, which takes longest.
        progress: told what is looked at.

    Raises:
        InvalidInput: the file cannot be used, or the output or input; names ``path``, ``output``,
            ``input`` or ``wished``.
    """
    model = mjcf_file.alone(path)
    offered = [*offers(model), *keyframes(mjcf_file.with_keyframes(path))]
    if (output is None) != (input is None):
        missing = "input" if input is None else "output"
        raise InvalidInput(missing, None, "output and input are to be given together, or neither")
    pair: tuple[Any, Any] | None = (output, input)
    vain: list[str] = []
    if output is None:
        pair, vain = propose(path, model, offered, keyframe)
    if pair is None:
        nothing = _NOTHING + _NAMELESS * any(not each.name for each in offered)
        nothing_there = Recommendation(
            False, ["There is nothing to recommend."], {}, vain or [nothing]
        )
        return Examination(
            file, "", "", ("", ""), offered, TIMESTEP, [], None, None, None, [], None, None,
            "not tried", nothing_there,
        )  # fmt: skip
    dimension = entries(pair[0]) if output is None or wished is None else len(wished)
    robot = agents_of(path, *pair, dimension, keyframe)
    found = examine_robot(
        Subject(file, robot, *pair, keyframe), wished, passivity=passivity, progress=progress
    )
    return replace(found, offers=offered)


def examine_robot(
    subject: Subject,
    wished: Array | None = None,
    *,
    timestep: float = TIMESTEP,
    passivity: bool = True,
    progress: Tell = nothing,
) -> Examination:
    """Examine a robot with its output and input; see :func:`examine`."""
    d = subject.robot.dimension
    target = np.full(d, 0.5) if wished is None else np.asarray(wished, dtype=np.float64)
    if target.shape != (d,) or not np.all(np.isfinite(target)):
        raise InvalidInput(
            "wished", target.tolist(), f"it must be {d} finite number{'s' * (d > 1)}"
        )
    with renaming(lambda key: key.removeprefix("agents.")):
        own = bench(subject.robot, timestep, "rk4")
    still = np.zeros(d)
    change = _change(own, still, target, PERIOD)
    progress(0.1, 1.0, "holding it")
    late = dead_time(own, own.start, still, change)
    if late is None:
        return _immovable(subject, own)
    degrees = relative_degrees(own, own.start, still, change)
    if degrees != [1] * d:  # what lags would be pushed far beyond what it does
        change = _change(own, still, target, LATER)
        degrees = relative_degrees(own, own.start, still, change)
    rest, held, period = _held(own, target, change, late, degrees)
    progress(0.4, 1.0, "longest stable steps")
    ends = [each.shots[-1] for each in (rest, held)]
    steps = worst([stable_steps(own, *end, INTEGRATORS) for end in ends])
    progress(0.6, 1.0, "responses")
    states = [*rest.shots, *held.shots, *_shaken(own, held, change, period)]
    seen = slopes(own, states, change)
    progress(0.7, 1.0, "passivity")
    tried = _passivity(subject.robot, own, target, change) if passivity else "not tried"
    found = Found(
        subject.file, subject.output, subject.input, subject.keyframe, target, rest, held, seen,
        degrees, late, steps, own.limits, own.plant.measures_every_stage, own.touches(),
        own.off_centre(),
    )  # fmt: skip
    return Examination(
        subject.file, _shown(subject.output), _shown(subject.input), _units(own), [],
        own.plant.timestep, own.limits.tolist(), rest, held, seen, degrees, late, steps, tried,
        recommend(found),
    )  # fmt: skip


def _immovable(subject: Subject, own: Bench) -> Examination:
    recommendation = Recommendation(
        False, ["There is nothing to recommend: name another output or input."], {},
        ["The input does not move the output."],
    )  # fmt: skip
    return Examination(
        subject.file, _shown(subject.output), _shown(subject.input), _units(own), [],
        own.plant.timestep, own.limits.tolist(), None, None, None,
        [None] * own.channels, None, None, "not tried", recommendation,
    )  # fmt: skip


def _change(own: Bench, u: Array, target: Array, period: float) -> Array:
    """(d,) by how much to change inputs: what moves outputs by a tenth of the wished ones in it."""
    steps = own.steps(period)
    moved = own.response(own.start, u + 1.0, steps) - own.response(own.start, u - 1.0, steps)
    size = max(float(np.max(np.abs(target))), 0.1)
    found = SHARE * size / np.maximum(0.5 * np.abs(moved), 1e-6)
    return np.minimum(np.clip(found, 1e-6, 1e6), 0.5 * own.limits)


def _held(
    own: Bench, target: Array, change: Array, late: float, degrees: list[int | None]
) -> tuple[Held, Held, int]:
    """At rest and at the wished output, and the period in steps by which they were held."""
    period = max(own.steps(PERIOD), 2 * own.steps(late))
    still = np.zeros(own.channels)
    lags = any(degree != 1 for degree in degrees)
    while lags and period < own.steps(LAGGING) and _growth(own, still, change, period) > LINEAR:
        period *= 2  # until inputs show as if there were no lag
    rise = _rise(own, still, change, period)
    rest = hold(own, own.start, still, rise, period)
    try:
        begin = own.moving(target)
    except InvalidInput:  # no joint velocities give them
        begin = own.start
    return rest, hold(own, begin, target, rise, period), period


def _growth(own: Bench, u: Array, change: Array, steps: int) -> float:
    """How many times as far a change of inputs leads in twice the time."""
    once, twice = own.course(own.start, u + change, (steps, 2 * steps)) - own.course(
        own.start, u - change, (steps, 2 * steps)
    )
    return float(np.max(np.abs(twice) / np.maximum(np.abs(once), 1e-300)))


def _rise(own: Bench, u: Array, change: Array, steps: int) -> Array:
    columns = []
    for axis in range(own.channels):
        part = np.where(np.arange(own.channels) == axis, change, 0.0)
        moved = own.response(own.start, u + part, steps) - own.response(own.start, u - part, steps)
        columns.append(moved / (2.0 * change[axis]))
    return np.array(columns).T


def _shaken(own: Bench, held: Held, change: Array, period: int) -> list[tuple[Array, Array]]:
    """States under random inputs, from the held one."""
    rng, found = np.random.default_rng(0), []
    state, u = held.shots[-1]
    for _ in range(SHOTS):
        own.go(state)
        for _ in range(5):
            shaken = u + 3.0 * change * rng.uniform(-1.0, 1.0, own.channels)
            if not own.move(np.clip(shaken, -own.limits, own.limits), period):
                break
        else:
            found.append((own.save(), u))
    return found


def _passivity(robot: MjcfRobots, own: Bench, target: Array, change: Array) -> str:
    """The trials' status and sentence, or why there were none.

    An equilibrium is the file's pose at an output, with the input that keeps the output there for a
    step; where the robot does not stay so, these trials have no equilibrium to begin from.
    """
    size = max(float(np.max(np.abs(target))), 0.1)

    def at_rest(y: Array) -> tuple[Array, Array]:
        copies = len(y) // robot.dimension
        plant = build(copies, own.plant.timestep)
        state = np.column_stack([y, np.zeros(len(y))])
        return state, _input_at(plant, state, np.tile(change, copies))

    agents = replace(robot, input_limit=np.full(robot.dimension, BUILT))
    build = plants_of(agents, "mujoco", own.plant.integrator)
    try:
        report = trials_of(
            build, own.plant.timestep, duration=LASTING, trials=TRIALS, outputs=(0.0, size),
            owners=np.zeros(robot.dimension, dtype=np.int64), equilibrium=at_rest, storage=None,
            reaches=(1.0,),
        )  # fmt: skip
    except InvalidInput as refused:
        if refused.key.startswith("equilibrium"):
            return "not tried: under a steady input it does not stay as its file has it"
        return f"not tried: {refused.about}"
    if max(each.input for each in report.ranges) > float(np.min(own.limits)):
        return "not tried: the trials' inputs are beyond what the file's actuators let through"
    return f"{report.status}: {report.message}"


def _input_at(plant: Plant, state: Array, change: Array) -> Array:
    """(m,) inputs that keep outputs for a step, each by itself."""
    u, y = np.zeros(len(state)), state[:, 0]
    for _ in range(3):
        ends = []
        for each in (u, u + change):
            plant.reset(state)
            plant.step(each)
            ends.append(plant.output)
        rise = (ends[1] - ends[0]) / change
        u = u + np.divide(y - ends[0], rise, out=np.zeros(len(u)), where=rise != 0)
    return u


def _units(own: Bench) -> tuple[str, str]:
    turns = own.plant.push_unit(0) == "N m"
    return ("rad/s", "N m") if turns else ("m/s", "N")


def _shown(given: Any) -> str:
    if isinstance(given, list):
        return ", ".join(map(_shown, given))
    if isinstance(given, dict):
        return "{" + ", ".join(f"{key} = {value!r}" for key, value in given.items()) + "}"
    return f"'{given}'"
