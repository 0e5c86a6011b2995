"""Is a plant equilibrium-independent passive? An empirical test: it can refute, never prove.

For every equilibrium (x*, u*, y*) there should be a storage V >= 0, zero at x*, with
V(x(t2)) - V(x(t1)) <= integral of (y - y*)(u - u*) dt [asmp:nonlinearPlant]. Checked are, along
trajectories under the inputs of :mod:`gne_mj.excitation`:

- *energy extracted*: from rest at x*, -integral (y - y*)(u - u*) dt must never be positive. This
  needs no storage function, and what violates it has none.
- *storage risen*: V may not rise by more than was supplied between any two times, from x* or from
  a random state. What violates it refutes V; the plant could still have another one.
- *storage negative*: V >= 0. (Energy of a spring that pushes apart obeys the balance as well.)

Inputs are held over an even number of steps, so that the supply is exact but for the output's
integral, by Simpson's rule. Everything is computed with the given step and with half of it, under
the same inputs, side by side. The difference of the two bounds the error of the finer one for a
method of any order p >= 1; twice its greatest value so far is taken, of V and of the supply each,
and an excess counts only beyond that and rounding.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gne_mj.errors import InvalidInput
from gne_mj.excitation import Excitation
from gne_mj.plants.agents import Agents
from gne_mj.plants.base import Plant
from gne_mj.plants.ode import OdePlant

# (copies, timestep in s) -> a plant with the channels of all agents, ``copies`` times in a row
Build = Callable[[int, float], Plant]
# y* (channels,) -> state (channels, states) and input (channels,) that rest there
Rest = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]
# (state, rest), each (channels, states) -> V of each channel (channels,)
Storage = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]

# In the order in which one is shown as counter-example
CHECKS = ("energy extracted", "storage risen", "storage negative")
NO_VIOLATION, VIOLATED = "no violation found", "violated"

# Inputs held one after the other in a trial, and channels in one simulation, at most
_HOLDS, _CHANNELS = 2000, 512
# The step's error is taken as this many times the difference to half the step.
_SAFETY = 2.0
# A difference may vanish by chance: its greatest within so many holds counts from the start.
_FIRST = 20
# Roundings in V, relative to the squared range of the output; each step may round once more.
_ROUNDINGS = 10
# A trial ends where an output is this many times its range away: nothing passive gets there.
_ESCAPED = 1e6


@dataclass(frozen=True)
class Finding:
    """The worst of one check for one agent; energies are in units of output times input times s.

    Attributes:
        check: one of CHECKS.
        agent: numbered from 1.
        trial: numbered from 0; with the seed it defines everything that was done.
        excess: by how much the inequality is violated; zero or negative where it holds.
        error: estimate of the error of ``excess``.
        exchanged: energy moved until then, in either direction, to compare with.
        since, time: in s, the interval over which it was found.
        rest_output: y* of the trial.
    """

    check: str
    agent: int
    trial: int
    excess: float
    error: float
    exchanged: float
    since: float
    time: float
    rest_output: float

    @property
    def violated(self) -> bool:
        """Whether the excess is more than error."""
        return self.excess > self.error

    def sentence(self) -> str:
        """For people."""
        if self.excess <= 0.0:
            return f"{self.check}: never"
        if not self.violated:
            return (
                f"{self.check}: {self.excess:.2g} at most, within its error {self.error:.2g}"
                f" (agent {self.agent}, trial {self.trial})"
            )
        return (
            f"agent {self.agent}: {self.check}: {self.excess:.4g} (error {self.error:.2g},"
            f" {self.exchanged:.4g} exchanged) from {self.since:.4g} s to {self.time:.4g} s,"
            f" equilibrium y = {self.rest_output:.4g}, trial {self.trial}"
        )


@dataclass(frozen=True)
class Counterexample:
    """All that is needed to repeat a violation on one channel.

    Attributes:
        finding: what happens.
        rest_state, rest_input: the equilibrium, beside ``finding.rest_output``.
        initial_state: where the trial starts.
        hold: time in s that each input is held.
        timestep: the finer integration step in s.
        input: u, one after the other, until the violation's end.
    """

    finding: Finding
    rest_state: list[float]
    rest_input: float
    initial_state: list[float]
    hold: float
    timestep: float
    input: list[float]


@dataclass(frozen=True)
class PassivityReport:
    """What was looked for, and what was found.

    Attributes:
        status: "no violation found", which is no proof, or "violated".
        message: one sentence.
        agents, trials, seed: how many agents, trials of each, and the random numbers' seed.
        duration: how long the trials were meant to last, in s.
        examined: after which time the shortest one ended, in s (an output had run away).
        timestep: the coarser integration step in s; errors are against half of it.
        storage: whether a storage function was known and checked.
        findings: for each agent the worst of each check.
        counterexample: None if there is no violation.
    """

    status: str
    message: str
    agents: int
    trials: int
    seed: int
    duration: float
    examined: float
    timestep: float
    storage: bool
    findings: tuple[Finding, ...]
    counterexample: Counterexample | None

    @property
    def holds(self) -> bool:
        """Whether no violation was found."""
        return self.status == NO_VIOLATION

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, strings and lists, for JSON."""
        return asdict(self)

    def summary(self) -> list[str]:
        """Lines for people: the status, then all violations, or how near the checks came to one."""
        shown = [finding for finding in self.findings if finding.violated]
        if not shown:
            shown = [
                max((f for f in self.findings if f.check == check), key=lambda f: f.excess)
                for check in CHECKS[: 3 if self.storage else 1]
            ]
        return [
            f"{self.status}: {self.message}",
            *(f"  {finding.sentence()}" for finding in shown),
        ]


def plants_of(agents: Agents, engine: str, integrator: str) -> Build:
    """How to build copies of agents on an engine ("ode" or "mujoco"), for :func:`examine`.

    The adaptive "rosenbrock" is for closed loops; plants alone are stepped by "rk4" then.
    """
    method = "rk4" if integrator == "rosenbrock" else integrator

    def build(copies: int, timestep: float) -> Plant:
        if engine == "ode":
            return OdePlant(agents.repeated(copies), timestep, method)
        # Late: MuJoCo is slow to import, and the twins do not need it.
        from gne_mj.plants.mujoco import MujocoPlant

        return MujocoPlant(agents.repeated(copies), timestep, method, decorated=False)

    return build


def examine(
    build: Build,
    timestep: float,
    *,
    duration: float = 20.0,
    trials: int = 24,
    seed: int = 0,
    outputs: tuple[ArrayLike, ArrayLike] = (-1.0, 1.0),
    equilibrium: Rest | None = None,
    storage: Storage | Literal["agents"] | None = "agents",
) -> PassivityReport:
    """Look for a violation of equilibrium-independent passivity.

    Args:
        build: makes the plant; its channels must not act on each other. ``plants_of`` is one.
        timestep: in s; half of it is used as well.
        duration: of a trial in s.
        trials: of every agent; 24 combine every kind of input with starts at rest and elsewhere.
            More trials repeat the first ones and add to them.
        seed: of the random numbers.
        outputs: (lower, upper), one for all or one for each agent: the range of y*; amplitudes
            and deviations are in proportion.
        equilibrium: the state and input that rest at y*; by default the agents' own, with u* = 0.
        storage: V; by default the agents' own, where their type has one. Without one all trials
            start at rest.

    Raises:
        InvalidInput: numbers that cannot be used, or a plant that does not rest at its equilibria.
    """
    for key, value, least in (("trials", trials, 1), ("seed", seed, 0)):
        if value < least:
            raise InvalidInput(key, value, f"it must be at least {least}")
    if not (np.isfinite(timestep) and timestep > 0):
        raise InvalidInput("timestep", timestep, "it must be positive and finite")
    if not (np.isfinite(duration) and duration >= 40 * timestep):
        raise InvalidInput("duration", duration, "it must be finite and at least 40 timesteps")
    agents = build(1, timestep).agents.channels
    lower, upper = (np.broadcast_to(np.asarray(b, dtype=np.float64), (agents,)) for b in outputs)
    if not (np.all(np.isfinite(upper - lower)) and np.all(lower < upper)):
        raise InvalidInput("outputs", outputs, "each lower one must be below the upper one")
    batch = max(1, _CHANNELS // agents)
    parts = [
        _Batch(build, range(first, min(first + batch, trials)), timestep, duration, seed,
               (lower, upper), equilibrium, storage)
        for first in range(0, trials, batch)
    ]  # fmt: skip
    found = [finding for part in parts for finding in part.findings()]
    worst: dict[tuple[int, int], Finding] = {}
    for finding in found:
        place = (finding.agent, CHECKS.index(finding.check))
        if place not in worst or _severity(finding) > _severity(worst[place]):
            worst[place] = finding
    findings = tuple(worst[place] for place in sorted(worst))
    counterexample = None
    for check in reversed(CHECKS):
        violations = [f for f in findings if f.check == check and f.violated]
        if violations:
            first = max(violations, key=_severity)
            counterexample = parts[first.trial // batch].counterexample(first)
    guilty = sorted({finding.agent for finding in findings if finding.violated})
    examined = min(part.time[-1] for part in parts)
    message = f"{trials} trials of {duration:g} s for each of {agents} agents, seed {seed}"
    if parts[0].storage is None:
        message += ", no storage function known"
    if any(part.escaped for part in parts):
        message += f"; some ended at {examined:.4g} s, when an output had run away"
    if guilty:
        message = f"by agent{'s' * (len(guilty) > 1)} {', '.join(map(str, guilty))}; {message}"
    else:
        message += "; this is no proof"
    return PassivityReport(
        status=VIOLATED if guilty else NO_VIOLATION,
        message=message,
        agents=agents,
        trials=trials,
        seed=seed,
        duration=duration,
        examined=float(examined),
        timestep=timestep,
        storage=parts[0].storage is not None,
        findings=findings,
        counterexample=counterexample,
    )


def _severity(finding: Finding) -> tuple[bool, float]:
    """Violations first, by their share of the energy exchanged; else by the bare excess."""
    if finding.violated:
        return True, (finding.excess - finding.error) / finding.exchanged
    return False, finding.excess


class _Batch:
    """Some trials of all agents in one simulation, at two steps side by side.

    Channels are numbered trial after trial. Arrays over time have shape (holds + 1, channels),
    with a leading axis of 2 for the coarser and the finer step where both are kept.
    """

    def __init__(
        self,
        build: Build,
        trials: range,
        timestep: float,
        duration: float,
        seed: int,
        outputs: tuple[NDArray[np.float64], NDArray[np.float64]],
        equilibrium: Rest | None,
        storage: Storage | Literal["agents"] | None,
    ) -> None:
        steps = round(duration / timestep)
        self.substeps = 2 * max(1, -(-steps // (2 * _HOLDS)))
        holds = steps // self.substeps
        self.trials, self.timestep = trials, timestep
        self.hold = self.substeps * timestep
        self.plants = [build(len(trials), timestep), build(len(trials), 0.5 * timestep)]
        self.agents = self.plants[0].agents.channels // len(trials)
        own = self.plants[0].agents
        if storage == "agents":
            known = hasattr(getattr(own, "kind", None), "storage")
            self.storage: Storage | None = own.storage if known else None
        else:
            self.storage = storage
        # Numbers of a trial depend on the seed and the trial alone.
        generators = [np.random.default_rng([seed, trial]) for trial in trials]
        lower, upper = outputs
        width = upper - lower
        self.width = np.tile(width, len(trials))
        self.rest_output = np.concatenate([rng.uniform(lower, upper) for rng in generators])
        if equilibrium is None:
            self.rest_state = own.equilibrium(self.rest_output)
            self.rest_input = np.zeros(len(self.rest_output))
        else:
            self.rest_state, self.rest_input = equilibrium(self.rest_output)
        self._check_rest()
        self.excitation = Excitation.join(
            [
                Excitation.draw(rng, trial, width, self.hold, holds * self.hold)
                for rng, trial in zip(generators, trials, strict=True)
            ]
        )
        self.at_rest = np.repeat(
            [self.storage is None or trial // 12 % 2 == 0 for trial in trials], self.agents
        )
        shape = (self.agents, self.rest_state.shape[1])
        deviation = np.concatenate(
            [
                rng.normal(size=shape)
                * width[:, None]
                * np.exp(rng.uniform(-3.5, 0.0, (shape[0], 1)))
                for rng in generators
            ]
        )
        self.initial_state = self.rest_state + np.where(self.at_rest[:, None], 0.0, deviation)
        self._simulate(holds)

    def _check_rest(self) -> None:
        plant = self.plants[0]
        plant.reset(self.rest_state)
        plant.step(self.rest_input, self.substeps)
        moved = np.abs(plant.output - self.rest_output)
        if not np.all(moved <= 1e-9 * (np.abs(self.rest_output) + self.width)):
            worst = int(np.argmax(np.where(np.isnan(moved), np.inf, moved)))
            raise InvalidInput(
                "equilibrium",
                float(self.rest_output[worst]),
                f"agent {worst % self.agents + 1} must rest at this output, and after"
                f" {self.hold:g} s under the input {self.rest_input[worst]:g} it is"
                f" {moved[worst]:.3g} off",
            )

    def _simulate(self, holds: int) -> None:
        channels = len(self.rest_output)
        self.input = np.zeros((holds, channels))
        supplied = np.zeros((2, holds + 1, channels))
        stored = np.zeros((2, holds + 1, channels))
        moved, gross = np.zeros((holds + 1, channels)), np.zeros((holds + 1, channels))
        for plant in self.plants:
            plant.reset(self.initial_state)
        stored[:, 0] = self._stored(self.plants[1])
        done = 0
        for k in range(holds):
            change = self.excitation.input(k * self.hold, self.plants[1].output - self.rest_output)
            self.input[k] = self.rest_input + change
            for level, plant in enumerate(self.plants):
                integral, size = self._hold(plant, self.input[k], self.substeps << level)
                supplied[level, k + 1] = supplied[level, k] + change * integral
                stored[level, k + 1] = self._stored(plant)
            moved[k + 1] = moved[k] + np.abs(supplied[1, k + 1] - supplied[1, k])
            gross[k + 1] = gross[k] + np.abs(change) * size
            away = [np.abs(plant.output - self.rest_output) for plant in self.plants]
            # Not a number is away as well.
            if not np.all(np.maximum(*away) <= _ESCAPED * self.width):
                break
            done = k + 1
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
        self, plant: Plant, u: NDArray[np.float64], steps: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Integrals of y - y*, by Simpson's rule, and of |y| + |y*| over one held input."""
        integral, size = np.zeros(len(u)), np.zeros(len(u))
        for step in range(steps + 1):
            if step:
                plant.step(u)
            weight = 1.0 if step in (0, steps) else 4.0 if step % 2 else 2.0
            y = plant.output
            integral += weight * (y - self.rest_output)
            size += weight * (np.abs(y) + np.abs(self.rest_output))
        third = self.hold / steps / 3.0
        return third * integral, third * size

    def _stored(self, plant: Plant) -> NDArray[np.float64]:
        if self.storage is None:
            return np.zeros(len(self.rest_output))
        return self.storage(plant.state, self.rest_state)

    def findings(self) -> list[Finding]:
        """The worst of each check for each agent."""
        start = np.broadcast_to(0, self.supplied[1].shape)
        extracted = np.where(self.at_rest, -self.supplied[1], -np.inf)
        found = self._worst(CHECKS[0], extracted, _error(self.supplied), start)
        if self.storage is None:
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
        for agent in range(self.agents):
            mine = slice(agent, None, self.agents)
            score = np.where(violated[:, mine], share[:, mine], -np.inf)
            if not np.any(violated[:, mine]):
                score = excess[:, mine]
            if np.all(score == -np.inf):
                continue  # no trial of this batch is of this check
            k, trial = np.unravel_index(np.argmax(score), score.shape)
            r = int(trial) * self.agents + agent
            found.append(
                Finding(
                    check=check,
                    agent=agent + 1,
                    trial=self.trials[int(trial)],
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
        """The data of one of this batch's findings."""
        r = (finding.trial - self.trials[0]) * self.agents + finding.agent - 1
        return Counterexample(
            finding=finding,
            rest_state=self.rest_state[r].tolist(),
            rest_input=float(self.rest_input[r]),
            initial_state=self.initial_state[r].tolist(),
            hold=self.hold,
            timestep=0.5 * self.timestep,
            input=self.input[: round(finding.time / self.hold), r].tolist(),
        )


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
