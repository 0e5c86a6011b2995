"""The examination of a plant: trials of all its channels, and the worst that they showed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.bounds import MOST_RUNS, check_count, check_room
from gne_mj.errors import InvalidInput
from gne_mj.passivity.report import (
    CHECKS,
    NO_VIOLATION,
    UNRESOLVED,
    VIOLATED,
    Counterexample,
    Finding,
    PassivityReport,
    Range,
    widest,
)
from gne_mj.passivity.trials import (
    HOLDS,
    Build,
    Extent,
    Rest,
    Storage,
    Subject,
    Trials,
    least_storage,
)
from gne_mj.plants.agents import Agents
from gne_mj.plants.base import Plant
from gne_mj.plants.functions import METHODS
from gne_mj.plants.ode import OdePlant
from gne_mj.progress import Tell, nothing

# How many times the outputs' range is gone through; beyond SIMULATED only where V is negative, by
# more than rounding
REACHES = (1.0, 30.0, 1e3, 1e4, 1e5, 1e6)
SIMULATED, ROUNDING = 1e3, 1e-12
# Channels in one simulation, at most
_CHANNELS = 512
# Timesteps of a trial at most, and numbers that are kept of each held input of a channel
MOST_TRIAL, _KEPT = 1_000_000_000, 12


def plants_of(agents: Agents, engine: str, integrator: str) -> Build:
    """How to build copies of agents on an engine ("ode" or "mujoco"), for :func:`examine`.

    The adaptive integrators are for closed loops; plants alone are stepped by "rk4" then.
    """
    method = integrator if integrator in METHODS else "rk4"

    def build(copies: int, timestep: float) -> Plant:
        if engine == "ode":
            return OdePlant(agents.repeated(copies), timestep, method)
        # Late: MuJoCo is slow to import, and the twins do not need it.
        from gne_mj.plants.fleet_plant import build_fleet

        return build_fleet(agents.repeated(copies), timestep, method, decorated=False)

    return build


def examine(
    build: Build,
    timestep: float,
    *,
    duration: float = 20.0,
    trials: int = 24,
    seed: int = 0,
    outputs: tuple[ArrayLike, ArrayLike] = (-1.0, 1.0),
    owners: ArrayLike | None = None,
    equilibrium: Rest | None = None,
    storage: Storage | Literal["agents"] | None = "agents",
    reaches: Sequence[float] = REACHES,
    progress: Tell = nothing,
) -> PassivityReport:
    """Look for a violation of equilibrium-independent passivity.

    Args:
        build: makes the plant; its channels must not act on each other. ``plants_of`` is one.
        timestep: in s; half of it is used as well.
        duration: of a trial in s.
        trials: of every agent; 24 combine every kind of input with starts at rest and elsewhere.
            More trials repeat the first ones and add to them.
        seed: of the random numbers.
        outputs: (lower, upper), one for all or one for each channel: the range of y*; amplitudes
            and deviations are in proportion.
        owners: (channels,) whose each channel is, numbered from 0; an agent each if left out.
        equilibrium: the state and input that rest at y*; by default the agents' own, with u* = 0.
        storage: V; by default the agents' own, where their type has one. Without one all trials
            start at rest.
        reaches: how many times the outputs' range amplitudes and deviations are in proportion to,
            one after the other until a violation is found or the step no longer resolves the
            motion; beyond a thousand times only where V is seen to be negative.
        progress: called now and then with the share of all trials that is done; some may not be
            needed.

    Raises:
        InvalidInput: numbers that cannot be used, or a plant that does not rest at its equilibria.
    """
    extent = _extent(trials, timestep, duration, seed)
    subject = _subject(build, extent, outputs, owners, equilibrium, storage)
    levels: list[_Level] = []
    unresolved = None
    reaches = [reach for reach in reaches if _is_of_use(subject, reach)]
    progress(0.0, 1.0, f"{_words(extent, subject.owner)}, at up to {len(reaches)} amplitudes")
    for number, reach in enumerate(reaches):

        def tell(share: float, number: int = number) -> None:
            done = (number + share) / len(reaches)
            progress(done, 1.0, f"{done:.0%} of all trials")

        level = _level(subject, extent, reach, tell)
        sure = level.counterexample is None or level.counterexample.confirmed
        if levels and (not sure or (level.escaped and level.counterexample is None)):
            unresolved = reach
            break
        levels.append(level)
        if level.counterexample is not None or level.escaped:
            break
    return _report(levels, unresolved, subject.owner, extent)


def _is_of_use(subject: Subject, reach: float) -> bool:
    return reach <= SIMULATED or least_storage(subject, reach) < -ROUNDING


def _extent(trials: int, timestep: float, duration: float, seed: int) -> Extent:
    for key, value, least in (("trials", trials, 1), ("seed", seed, 0)):
        if value < least:
            raise InvalidInput(key, value, f"it must be at least {least}")
    if not (np.isfinite(timestep) and timestep > 0):
        raise InvalidInput("timestep", timestep, "it must be positive and finite")
    if not (np.isfinite(duration) and duration >= 40 * timestep):
        raise InvalidInput("duration", duration, "it must be finite and at least 40 timesteps")
    check_count("duration", round(min(duration / timestep, 1e300)), MOST_TRIAL, "its timesteps")
    check_count("trials", trials, MOST_RUNS)
    return Extent(trials, timestep, duration, seed)


def _subject(
    build: Build,
    extent: Extent,
    outputs: tuple[ArrayLike, ArrayLike],
    owners: ArrayLike | None,
    equilibrium: Rest | None,
    storage: Storage | Literal["agents"] | None,
) -> Subject:
    channels = build(1, extent.timestep).agents.channels
    held = min(extent.duration / extent.timestep, HOLDS)
    check_room("build", channels, _KEPT * held * channels, "what a trial of them shows")
    owner = np.arange(channels) if owners is None else np.asarray(owners, dtype=np.int64)
    if owner.shape != (channels,):
        raise InvalidInput("owners", owners, f"it must list {channels} agents, one a channel")
    lower, upper = (np.broadcast_to(np.asarray(b, dtype=np.float64), (channels,)) for b in outputs)
    if not (np.all(np.isfinite(upper - lower)) and np.all(lower < upper)):
        raise InvalidInput("outputs", outputs, "each lower one must be below the upper one")
    return Subject(build, lower, upper, owner, equilibrium, storage)


@dataclass(frozen=True)
class _Level:
    """What the trials of one amplitude showed."""

    worst: dict[tuple[int, int], Finding]
    counterexample: Counterexample | None
    examined: float
    escaped: bool
    has_storage: bool
    range: Range


def _level(subject: Subject, extent: Extent, reach: float, tell: Callable[[float], None]) -> _Level:
    """All trials of one amplitude, so many channels at a time."""
    worst: dict[tuple[int, int], Finding] = {}
    counterexample, examined, escaped, has_storage = None, extent.duration, False, False
    ranges = []
    trials, batch = extent.trials, max(1, _CHANNELS // len(subject.owner))
    for first in range(0, trials, batch):
        own = range(first, min(first + batch, trials))

        def part_done(share: float, own: range = own) -> None:
            tell((own.start + share * len(own)) / trials)

        part = Trials(subject, extent, own, reach, part_done)
        examined = min(examined, float(part.time[-1]))
        escaped, has_storage = escaped or part.escaped, part.has_storage
        ranges.append(part.range())
        found = part.findings()
        for finding in found:
            place = (finding.channel, CHECKS.index(finding.check))
            if place not in worst or _severity(finding) > _severity(worst[place]):
                worst[place] = finding
        shown = max(found, key=_rank)
        if shown.violated and (
            counterexample is None or _rank(shown) > _rank(counterexample.finding)
        ):
            counterexample = part.counterexample(shown)
    return _Level(worst, counterexample, examined, escaped, has_storage, widest(ranges))


def _words(extent: Extent, owner: NDArray[np.int64]) -> str:
    agents = len(set(owner.tolist()))
    each = f" for each of {agents} agents" if agents > 1 else ""
    return f"{extent.trials} trials of {extent.duration:g} s{each}"


def _report(
    levels: list[_Level],
    unresolved: float | None,
    owner: NDArray[np.int64],
    extent: Extent,
) -> PassivityReport:
    """The levels together: the last one's violation, or the worst of all that held."""
    last = levels[-1]
    worst = dict(last.worst)
    if last.counterexample is None:
        for level in levels:
            for place, finding in level.worst.items():
                if _severity(finding) > _severity(worst.get(place, finding)):
                    worst[place] = finding
    findings = tuple(worst[place] for place in sorted(worst))
    agents = len(set(owner.tolist()))
    examined = min(level.examined for level in levels)
    message = f"{_words(extent, owner)}, seed {extent.seed}"
    if len(levels) > 1:
        message += f", at {len(levels)} amplitudes"
    if not last.has_storage:
        message += ", no storage function known"
    if last.escaped:
        message += f"; some ended at {examined:.4g} s, when an output had run away"
    if unresolved is not None:
        message += (
            f"; at {unresolved:g} times the outputs' range an output ran away, or the step did not"
            " resolve the motion, which says nothing"
        )
    status, message = _verdict(message, findings, last.counterexample, extent.timestep)
    return PassivityReport(
        status=status,
        message=message,
        agents=agents,
        trials=extent.trials,
        seed=extent.seed,
        duration=extent.duration,
        examined=examined,
        timestep=extent.timestep,
        storage=last.has_storage,
        ranges=tuple(level.range for level in levels),
        findings=findings,
        counterexample=last.counterexample,
    )


def _verdict(
    done: str,
    findings: tuple[Finding, ...],
    counterexample: Counterexample | None,
    timestep: float,
) -> tuple[str, str]:
    """Status and sentence, given what was done in words."""
    if counterexample is None:
        return NO_VIOLATION, f"{done}; this is no proof"
    if not counterexample.confirmed:
        return UNRESOLVED, (
            f"{done}; an excess of {counterexample.finding.excess:.3g} became"
            f" {counterexample.repeated_excess:.3g} with a sixth of the step {timestep:g} s, which"
            " does not resolve the plant's motion"
        )
    guilty = sorted({finding.agent for finding in findings if finding.violated})
    return VIOLATED, f"by agent{'s' * (len(guilty) > 1)} {', '.join(map(str, guilty))}; {done}"


def _severity(finding: Finding) -> tuple[bool, float]:
    """Violations first, by their share of the energy exchanged; else by the bare excess."""
    if finding.violated:
        return True, (finding.excess - finding.error) / finding.exchanged
    return False, finding.excess


def _rank(finding: Finding) -> tuple[bool, int, float]:
    """The greatest is shown: what refutes the plant before what refutes its storage function."""
    violated, share = _severity(finding)
    return violated, -CHECKS.index(finding.check), share
