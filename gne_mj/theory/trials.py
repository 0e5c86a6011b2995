"""Limits found by running a system: the longest period, the smallest push that breaks it.

What trials show holds for the start, the duration and the values that were tried.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gne_mj.errors import InfeasibleStart, InvalidInput, part_of
from gne_mj.faults import Fault, Push, steady_push
from gne_mj.load_margins import beyond_estimates
from gne_mj.loops import monitor as watch
from gne_mj.margins import with_margin
from gne_mj.plain import raise_pending
from gne_mj.progress import Tell, nothing
from gne_mj.system import Clock, System, mode_of

# How the ends of a bracket may differ, as a factor
PRECISION = 1.02
LARGEST_PUSH = 1e6
# Runs to bisect the size of a push, and a period between two that differ by a fifth, at most
HALVINGS, PERIOD_HALVINGS = 7, 4


@dataclass(frozen=True)
class PeriodSearch:
    """What trials with other control periods showed.

    Attributes:
        inside: the longest period (s) up to which every one tried stayed inside at every step.
        outside: the shortest one tried that did not; None if all stayed.
        trials: pairs of a period and whether the run stayed inside.
        note: where the search ended.
    """

    inside: float | None
    outside: float | None
    trials: tuple[tuple[float, bool], ...]
    note: str


@dataclass(frozen=True)
class PushSearch:
    """What an adversary found.

    Attributes:
        smallest_breaking_push: the least size, on every agent that a pattern pushes, with which a
            run left the set; None if none did.
        pattern: which pattern of pushes that was.
        largest_tried: the greatest size tried.
        runs: how many runs it took.
    """

    smallest_breaking_push: float | None
    pattern: str | None
    largest_tried: float
    runs: int


def stays_inside(system: System, clock: Clock) -> bool:
    """Whether a run stays inside at every integration step to the clock's end."""
    loop = system.closed_loop(clock)
    loop.pass_over(clock.steps(clock.duration))
    loop.finish()
    raise_pending()
    return bool(loop.monitor.exit == watch.INSIDE)


def held_for(system: System, timestep: float, steps: int) -> System:
    """The system with the margin that its declared disturbances need for such a control period."""
    if system.disturbance is None:
        return system
    unforeseen = beyond_estimates(
        system.agents, timestep, system.integrator, steps, system.disturbance, system.observer,
        system.guarded,
    )  # fmt: skip
    game = with_margin(
        system.game, system.agents, unforeseen, timestep, system.integrator, steps, system.guarded
    )
    return replace(system, game=game)


@part_of("system", "clock")
def search_period(system: System, clock: Clock, progress: Tell = nothing) -> PeriodSearch:
    """Longer and longer control periods until one leaves the set between instants or at one.

    Periods are whole numbers of steps, each a fifth longer than the one before, then bisected. The
    duration is rounded up to whole periods.

    Args:
        system: in a mode that holds its input.
        clock: steps and duration of every run.
        progress: called before every run; those that are ahead are told as the most there can be.

    Raises:
        InvalidInput: mode continuous, which has no period.
    """
    if not mode_of(system).held:
        raise InvalidInput("mode", system.mode, "it holds no input")
    trials: list[tuple[float, bool]] = []

    def stays(steps: int, ahead: int) -> bool:
        period = steps * clock.timestep
        done = len(trials)
        words = (
            f"{system.name}: trying a period of {period:.4g} s"
            if done
            else (f"at most {ahead} runs of {clock.duration:g} s with longer and longer periods")
        )
        progress(done, done + ahead, words)
        duration = np.ceil(clock.duration / period - 1e-9) * period
        try:
            trial = held_for(system, clock.timestep, steps)
            stayed = stays_inside(trial, Clock(duration, clock.timestep, period, duration))
        except (InvalidInput, InfeasibleStart):  # disturbances of so long use up a bound
            stayed = False
        trials.append((period, stayed))
        return stayed

    most = max(1, clock.steps(clock.duration) // 2)
    tried = list(_longer(most))
    good, bad = 0, None
    for k, steps in enumerate(tried):
        if not stays(steps, len(tried) - k + PERIOD_HALVINGS):
            bad = steps
            break
        good = steps
    note = "each a fifth longer than the last, then bisected"
    while bad is not None and good and bad - good > 1 and bad / good > PRECISION:
        middle = (good + bad) // 2
        if stays(middle, (bad - good - 1).bit_length()):
            good = middle
        else:
            bad = middle
    if bad is None:
        note = f"half the duration is {most * clock.timestep:g} s"
    h = clock.timestep
    return PeriodSearch(good * h if good else None, bad and bad * h, tuple(trials), note)


def _longer(most: int) -> Iterator[int]:
    """Steps of a period, each a fifth more than the last."""
    steps = 1
    while steps <= most:
        yield steps
        steps = max(steps + 1, int(1.2 * steps))


@part_of("system", "clock")
def search_push(system: System, clock: Clock, progress: Tell = nothing) -> PushSearch:
    """The smallest push that leaves the set: every pattern is doubled until it does, and bisected.

    Patterns push the agents of one constraint the ways that raise it, steadily, in squares of
    several periods, or once from some time on; the scenario's own faults stay.

    Args:
        system: what is run.
        clock: of its runs.
        progress: called before every pattern, with how many runs are expected.
    """
    best, pattern, runs, tried = np.inf, None, 0, 0.0
    patterns = list(_patterns(system, clock))
    progress(0, _expected(0, len(patterns)), _ahead(len(patterns), clock))
    if not stays_inside(system, clock):
        return PushSearch(0.0, "without any push", 0.0, 1)
    for number, (name, pushes) in enumerate(patterns):

        def stays(size: float, pushes: tuple[Push, ...] = pushes) -> bool:
            nonlocal runs, tried
            runs, tried = runs + 1, max(tried, size)
            scaled = tuple(replace(push, force=push.force * size) for push in pushes)
            faults: tuple[Fault, ...] = (*system.faults, *scaled)
            return stays_inside(replace(system, faults=faults), clock)

        total = runs + 1 + _expected(number, len(patterns))
        progress(runs + 1, total, f"{system.name}: pushing, {name}")
        high = min(best, LARGEST_PUSH) if pattern is not None else 1.0
        if pattern is None:
            while high < LARGEST_PUSH and stays(high):
                high *= 4.0
            if high >= LARGEST_PUSH:
                continue
            low = 0.25 * high if high > 1.0 else 0.0
        else:
            if stays(high / PRECISION):
                continue
            low = 0.0
        while low == 0.0 or high / low > PRECISION:
            middle = 0.5 * high if low == 0.0 else 0.5 * (low + high)
            if stays(middle):
                low = middle
            else:
                high = middle
            if high < 1e-9:
                break
        best, pattern = high, name
    return PushSearch(best if pattern is not None else None, pattern, tried, runs)


def _expected(done: int, patterns: int) -> float:
    """Runs of the patterns that are left: one of each, and some more where it breaks sooner.

    In random order the k-th of them does so with probability 1/k.
    """
    return sum(1.0 + HALVINGS / k for k in range(done + 1, patterns + 1))


def _ahead(patterns: int, clock: Clock) -> str:
    runs = _expected(0, patterns)
    return f"{patterns} patterns of pushes, some {runs:.0f} runs of {clock.duration:g} s"


def _patterns(system: System, clock: Clock) -> Iterator[tuple[str, tuple[Push, ...]]]:
    """Directions that raise one constraint, each with several courses in time, of size 1."""
    game = system.game
    period = clock.control_period
    gaps = game.gap_bounds is not None or game.constraint_class == "quadratic"
    slopes = game.constraint_jacobian(system.start)
    around = game.constraint_jacobian(0.5 * (system.start + system.centre))
    courses: list[tuple[str, dict[str, Any]]] = [("steadily", {})]
    courses += [("from half the time on", {"start": 0.5 * clock.duration})]
    courses += [
        (f"in squares of {length:g} s", {"profile": "square", "period": length})
        for length in (2.0 * period, 20.0 * period, 0.2 * clock.duration)
    ]
    for k, name in enumerate(game.constraint_names):
        # Of a bound on a gap that vanishes every direction is as good as the other.
        direction = np.sign(np.where(slopes[k] != 0, slopes[k], around[k]))
        if not np.any(direction):
            continue
        for sign in (1.0, -1.0) if gaps else (1.0,):
            for course, options in courses:
                pushes = steady_push(game, sign * direction, **options)
                yield f"'{name}', {'+' if sign > 0 else '-'}, {course}", pushes
