"""What an examination of a plant's passivity found."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

# In the order in which one is shown as counter-example
CHECKS = ("energy extracted", "storage risen", "storage negative")
NO_VIOLATION, VIOLATED, UNRESOLVED = "no violation found", "violated", "step too long"


@dataclass(frozen=True)
class Finding:
    """The worst of one check for one channel; energies are in units of output times input times s.

    Attributes:
        check: one of CHECKS.
        agent, channel: numbered from 1; a channel is one output with its input.
        trial: numbered from 0; with the seed and ``reach`` it defines everything that was done.
        reach: how many times the outputs' range amplitudes and deviations are in proportion to.
        excess: by how much the inequality is violated; zero or negative where it holds.
        error: estimate of the error of ``excess``.
        exchanged: energy moved until then, in either direction, to compare with.
        since, time: in s, the interval over which it was found.
        rest_output: y* of the trial.
    """

    check: str
    agent: int
    channel: int
    trial: int
    reach: float
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
            f" equilibrium y = {self.rest_output:.4g}, trial {self.trial}, reach {self.reach:g}"
        )


@dataclass(frozen=True)
class Range:
    """How far trials went from their equilibria.

    Attributes:
        reach: how many times the outputs' range amplitudes and deviations were in proportion to.
        output, input: greatest |y - y*| and |u - u*| over all agents and times.
        states: greatest |x - x*| of each state, by its name.
    """

    reach: float
    output: float
    input: float
    states: dict[str, float]

    def sentence(self) -> str:
        """For people."""
        states = ", ".join(f"{name} {value:.3g}" for name, value in self.states.items())
        return (
            f"tried up to {self.output:.3g} from y*, inputs up to {self.input:.3g} from u*,"
            f" states up to: {states}"
        )


def widest(ranges: Sequence[Range]) -> Range:
    """What several ranges of one reach come to together."""
    states = {name: max(r.states[name] for r in ranges) for name in ranges[0].states}
    output, inputs = (max(getattr(r, key) for r in ranges) for key in ("output", "input"))
    return Range(ranges[0].reach, output, inputs, states)


@dataclass(frozen=True)
class Counterexample:
    """All that is needed to repeat a violation on one channel.

    Attributes:
        finding: what happens.
        repeated_excess: its excess once more, with a third of the finer step.
        rest_state, rest_input: the equilibrium, beside ``finding.rest_output``.
        initial_state: where the trial starts.
        hold: time in s that each input is held.
        timestep: the finer integration step in s.
        input: u, one after the other, until the violation's end.
    """

    finding: Finding
    repeated_excess: float
    rest_state: list[float]
    rest_input: float
    initial_state: list[float]
    hold: float
    timestep: float
    input: list[float]

    @property
    def confirmed(self) -> bool:
        """Whether the repetition agrees, to within the error that was estimated.

        What is no more than an error itself fades with the step, and does not count either.
        """
        change = abs(self.repeated_excess - self.finding.excess)
        return change <= min(self.finding.error, 0.5 * self.finding.excess)


@dataclass(frozen=True)
class PassivityReport:
    """What was looked for, and what was found.

    Attributes:
        status: "no violation found", which is no proof; "violated"; or "step too long" where a
            violation was not confirmed by a shorter step, so that nothing can be said.
        message: one sentence.
        agents, trials, seed: how many agents, trials of each, and the random numbers' seed.
        duration: how long the trials were meant to last, in s.
        examined: after which time the shortest one ended, in s (an output had run away).
        timestep: the coarser integration step in s; errors are against half of it.
        storage: whether a storage function was known and checked.
        ranges: how far the trials went from their equilibria, one amplitude after the other.
        findings: for each channel the worst of each check.
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
    ranges: tuple[Range, ...]
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
            f"  {self.ranges[-1].sentence()}",
            *(f"  {finding.sentence()}" for finding in shown),
        ]
