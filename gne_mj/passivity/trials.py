"""Trials of a plant under exciting inputs, at two steps side by side, and their energy balance."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gne_mj.errors import InvalidInput
from gne_mj.passivity.excitation import COMBINATIONS, Excitation
from gne_mj.passivity.report import CHECKS, Counterexample, Finding, Range
from gne_mj.plants.base import Plant

# (copies, timestep in s) -> a plant with the channels of all agents, ``copies`` times in a row
Build = Callable[[int, float], Plant]
# y* (channels,) -> state (channels, states) and input (channels,) that rest there
Rest = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]
# (state, rest), each (channels, states) -> V of each channel (channels,)
Storage = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]

# Inputs held one after the other in a trial, at most
HOLDS = 2000
# The step's error is taken as this many times the difference to half the step.
_SAFETY = 2.0
# A difference may vanish by chance: its greatest within so many holds counts from the start.
_FIRST = 20
# Roundings in V, relative to the squared range of the output; each step may round once more.
_ROUNDINGS = 10
# States at which V is looked at without a trial
_STATES = 200
# A trial ends where an output is this many times its range away: nothing passive gets there.
_ESCAPED = 1e6


@dataclass(frozen=True)
class Subject:
    """What is examined: plants, and about which of their equilibria.

    Args:
        build, equilibrium, storage: as :func:`gne_mj.passivity.examine` has them.
        lower, upper: (channels,) between which y* is drawn.
        owner: (channels,) whose each channel is, from 0.
    """

    build: Build
    lower: NDArray[np.float64]
    upper: NDArray[np.float64]
    owner: NDArray[np.int64]
    equilibrium: Rest | None = None
    storage: Storage | Literal["agents"] | None = "agents"

    def storage_of(self, plant: Plant) -> Storage | None:
        """The storage function to check: the one given, or that of the plant's agents, if any."""
        if self.storage != "agents":
            return self.storage
        return plant.agents.storage if plant.agents.knows_storage else None

    def rest(self, plant: Plant, y: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        """State (channels, states) and input (channels,) that rest at the outputs."""
        if self.equilibrium is None:
            return plant.agents.equilibrium(y), np.zeros(len(y))
        return self.equilibrium(y)


@dataclass(frozen=True)
class Extent:
    """How many trials of how long.

    Args:
        trials: of every agent.
        timestep, duration: in s.
        seed: of the random numbers.
    """

    trials: int
    timestep: float
    duration: float
    seed: int


class Trials:
    """Some trials of all agents in one simulation, at two steps side by side.

    Channels are numbered trial after trial. Arrays over time have shape (holds + 1, channels),
    with a leading axis of 2 for the coarser and the finer step where both are kept.

    Args:
        subject: what is examined.
        extent: of all trials.
        trials: the numbers of these ones.
        reach: how many times the outputs' range amplitudes and deviations are in proportion to.
        tell: called at every held input with the share of these trials that is done.
    """

    def __init__(
        self,
        subject: Subject,
        extent: Extent,
        trials: range,
        reach: float = 1.0,
        tell: Callable[[float], None] = lambda share: None,
    ) -> None:
        timestep, owner, build = extent.timestep, subject.owner, subject.build
        steps = round(extent.duration / timestep)
        self.substeps = 2 * max(1, -(-steps // (2 * HOLDS)))
        holds = steps // self.substeps
        self.subject, self.trials, self.owner, self.reach = subject, trials, owner, reach
        self.timestep = timestep
        self.hold = self.substeps * timestep
        self.plants = [build(len(trials), timestep), build(len(trials), 0.5 * timestep)]
        self.has_storage = subject.storage_of(self.plants[0]) is not None
        # Numbers of a trial depend on the seed and the trial alone.
        generators = [np.random.default_rng([extent.seed, trial]) for trial in trials]
        lower, upper = subject.lower, subject.upper
        width = reach * (upper - lower)
        self.width = np.tile(width, len(trials))
        self.rest_output = np.concatenate([rng.uniform(lower, upper) for rng in generators])
        self.rest_state, self.rest_input = subject.rest(self.plants[0], self.rest_output)
        self._check_rest()
        self.excitation = Excitation.join(
            [
                Excitation.draw(rng, trial, width, self.hold, holds * self.hold)
                for rng, trial in zip(generators, trials, strict=True)
            ]
        )
        self.at_rest = np.repeat(
            [not self.has_storage or trial // COMBINATIONS % 2 == 0 for trial in trials],
            len(self.owner),
        )
        states = self.rest_state.shape[1]
        deviation = np.concatenate([deviations(rng, width, states) for rng in generators])
        self.initial_state = self.rest_state + np.where(self.at_rest[:, None], 0.0, deviation)
        self._simulate(holds, tell)

    def _check_rest(self) -> None:
        plant = self.plants[0]
        plant.reset(self.rest_state)
        plant.step(self.rest_input, self.substeps)
        moved = np.abs(plant.output - self.rest_output)
        if not np.all(moved <= 1e-9 * (np.abs(self.rest_output) + self.width / self.reach)):
            worst = int(np.argmax(np.where(np.isnan(moved), np.inf, moved)))
            raise InvalidInput(
                "equilibrium",
                float(self.rest_output[worst]),
                f"channel {worst % len(self.owner) + 1} must rest at this output, and after"
                f" {self.hold:g} s under the input {self.rest_input[worst]:g} it is"
                f" {moved[worst]:.3g} off",
            )

    def _simulate(self, holds: int, tell: Callable[[float], None]) -> None:
        channels = len(self.rest_output)
        self.input = np.zeros((holds, channels))
        supplied = np.zeros((2, holds + 1, channels))
        stored = np.zeros((2, holds + 1, channels))
        moved, gross = np.zeros((holds + 1, channels)), np.zeros((holds + 1, channels))
        self.farthest = np.max(np.abs(self.initial_state - self.rest_state), axis=0)
        for plant in self.plants:
            plant.reset(self.initial_state)
        self.farthest_output = 0.0
        everyone = slice(None)
        stored[:, 0] = self._stored(self.plants[1], everyone)
        done = 0
        for k in range(holds):
            change = self.excitation.input(k * self.hold, self.plants[1].output - self.rest_output)
            self.input[k] = self.rest_input + change
            for level, plant in enumerate(self.plants):
                integral, size = self._hold(plant, k, everyone, self.substeps << level)
                supplied[level, k + 1] = supplied[level, k] + change * integral
                stored[level, k + 1] = self._stored(plant, everyone)
            moved[k + 1] = moved[k] + np.abs(supplied[1, k + 1] - supplied[1, k])
            gross[k + 1] = gross[k] + np.abs(change) * size
            away = [np.abs(plant.output - self.rest_output) for plant in self.plants]
            # Not a number is away as well.
            if not np.all(np.maximum(*away) <= _ESCAPED * self.width):
                break
            done = k + 1
            tell(done / holds)
            states = np.abs(self.plants[1].state - self.rest_state)
            self.farthest = np.maximum(self.farthest, np.max(states, axis=0))
            self.farthest_output = max(self.farthest_output, float(np.max(away)))
        self.time = self.hold * np.arange(done + 1)
        self.supplied, self.stored = supplied[:, : done + 1], stored[:, : done + 1]
        peak = np.maximum.accumulate(np.abs(self.stored[1]))
        self.exchanged = moved[: done + 1] + peak
        steps_taken = 2 * self.substeps * np.arange(done + 1)[:, None]
        self.rounding = np.finfo(float).eps * (
            steps_taken * (gross[: done + 1] + peak) + _ROUNDINGS * self.width**2
        )
        self.escaped = done < holds

    def _hold(
        self, plant: Plant, k: int, mine: slice, steps: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Integrals of y - y*, by Simpson's rule, and of |y| + |y*| while the k-th input is held.

        The plant is one of the channels ``mine``, and takes this many steps.
        """
        u, rest = self.input[k, mine], self.rest_output[mine]
        integral, size = np.zeros(len(u)), np.zeros(len(u))
        for step in range(steps + 1):
            if step:
                plant.step(u)
            weight = 1.0 if step in (0, steps) else 4.0 if step % 2 else 2.0
            y = plant.output
            integral += weight * (y - rest)
            size += weight * (np.abs(y) + np.abs(rest))
        third = self.hold / steps / 3.0
        return third * integral, third * size

    def _stored(self, plant: Plant, mine: slice) -> NDArray[np.float64]:
        storage = self.subject.storage_of(plant)
        if storage is None:
            return np.zeros(plant.agents.channels)
        return storage(plant.state, self.rest_state[mine])

    def range(self) -> Range:
        """How far the trials went from their equilibria."""
        names = [name for name, _ in self.plants[0].agents.kind.STATES]
        if len(names) != len(self.farthest):
            names = [f"state {k + 1}" for k in range(len(self.farthest))]
        done = len(self.time) - 1
        inputs = np.abs(self.input[:done] - self.rest_input)
        return Range(
            reach=self.reach,
            output=self.farthest_output,
            input=float(np.max(inputs, initial=0.0)),
            states=dict(zip(names, self.farthest.tolist(), strict=True)),
        )

    def findings(self) -> list[Finding]:
        """The worst of each check for each channel."""
        start = np.broadcast_to(0, self.supplied[1].shape)
        extracted = np.where(self.at_rest, -self.supplied[1], -np.inf)
        found = self._worst(CHECKS[0], extracted, _error(self.supplied), start)
        if not self.has_storage:
            return found
        surplus = self.stored - self.supplied
        least, since = _running_least(surplus[1])
        # Both ends of the interval have the errors of both terms.
        error = 2.0 * (_error(self.stored) + _error(self.supplied))
        found += self._worst(CHECKS[1], surplus[1] - least, error, since)
        found += self._worst(CHECKS[2], -self.stored[1], _error(self.stored), start)
        return found

    def _worst(
        self,
        check: str,
        excess: NDArray[np.float64],
        error: NDArray[np.float64],
        since: NDArray[np.int64],
    ) -> list[Finding]:
        error = error + self.rounding
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (excess - error) / self.exchanged
        violated = excess > error
        found = []
        for channel, agent in enumerate(self.owner):
            mine = slice(channel, None, len(self.owner))
            score = np.where(violated[:, mine], share[:, mine], -np.inf)
            if not np.any(violated[:, mine]):
                score = excess[:, mine]
            if np.all(score == -np.inf):
                continue  # no trial of this batch is of this check
            k, trial = np.unravel_index(np.argmax(score), score.shape)
            r = int(trial) * len(self.owner) + channel
            found.append(
                Finding(
                    check=check,
                    agent=int(agent) + 1,
                    channel=channel + 1,
                    trial=self.trials[int(trial)],
                    reach=self.reach,
                    excess=float(excess[k, r]) + 0.0,
                    error=float(error[k, r]),
                    exchanged=float(self.exchanged[k, r]),
                    since=float(self.time[since[k, r]]),
                    time=float(self.time[k]),
                    rest_output=float(self.rest_output[r]),
                )
            )
        return found

    def counterexample(self, finding: Finding) -> Counterexample:
        """The data of one of these trials' findings."""
        r = (finding.trial - self.trials[0]) * len(self.owner) + finding.channel - 1
        return Counterexample(
            finding=finding,
            repeated_excess=self._repeated(finding),
            rest_state=self.rest_state[r].tolist(),
            rest_input=float(self.rest_input[r]),
            initial_state=self.initial_state[r].tolist(),
            hold=self.hold,
            timestep=0.5 * self.timestep,
            input=self.input[: round(finding.time / self.hold), r].tolist(),
        )

    def _repeated(self, finding: Finding) -> float:
        """The finding's excess once more, by a third of the finer step and the same inputs."""
        first = (finding.trial - self.trials[0]) * len(self.owner)
        mine = slice(first, first + len(self.owner))
        channel = finding.channel - 1
        since, end = round(finding.since / self.hold), round(finding.time / self.hold)
        plant = self.subject.build(1, self.timestep / 6.0)
        plant.reset(self.initial_state[mine])
        supplied = before = np.zeros(len(self.owner))
        for k in range(end):
            if k == since:
                before = self._stored(plant, mine) - supplied
            integral, _ = self._hold(plant, k, mine, 6 * self.substeps)
            supplied = supplied + (self.input[k, mine] - self.rest_input[mine]) * integral
        stored = self._stored(plant, mine)
        excess = {
            "energy extracted": -supplied,
            "storage risen": stored - supplied - before,
            "storage negative": -stored,
        }
        return float(excess[finding.check][channel])


def deviations(
    rng: np.random.Generator, width: NDArray[np.float64], states: int
) -> NDArray[np.float64]:
    """Random states (channels, states) about an equilibrium, up to about ``width`` (channels,).

    Each state has a size of its own, so that what is large may be one of them alone.
    """
    shape = (len(width), states)
    direction = rng.normal(size=shape)
    return direction * width[:, None] * np.exp(rng.uniform(-7.0, 0.0, shape))


def least_storage(subject: Subject, reach: float) -> float:
    """The least V, over the squared widths, of many states about an equilibrium; 0 without a V.

    The equilibrium is the one in the middle; states are up to ``reach`` times the outputs' range
    away.
    """
    plant = subject.build(1, 1.0)
    known = subject.storage_of(plant)
    if known is None:
        return 0.0
    width = reach * (subject.upper - subject.lower)
    rest, _ = subject.rest(plant, 0.5 * (subject.lower + subject.upper))
    rng = np.random.default_rng(0)
    found = [
        known(rest + deviations(rng, width, rest.shape[1]), rest) / width**2 for _ in range(_STATES)
    ]
    return float(np.min(found))


def _error(both: NDArray[np.float64]) -> NDArray[np.float64]:
    """Estimate of the finer one's error: the greatest difference so far, with some safety."""
    difference = np.maximum.accumulate(np.abs(both[0] - both[1]))
    error: NDArray[np.float64] = _SAFETY * np.maximum(difference, difference[:_FIRST].max(axis=0))
    return error


def _running_least(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The least value so far in each column, and its row."""
    least = np.minimum.accumulate(values)
    rows = np.where(values == least, np.arange(len(values))[:, None], 0)
    return least, np.maximum.accumulate(rows)
