"""Limits found by running a system: the longest period, the smallest push that breaks it.

What trials show holds for the start, the duration and the values that were tried.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gne_mj.errors import InfeasibleStart, InvalidInput, part_of
from gne_mj.faults import Fault, Push, steady_push
from gne_mj.loops import monitor as watch
from gne_mj.margins import with_margin
from gne_mj.plain import raise_pending
from gne_mj.system import Clock, System, mode_of

# How the ends of a bracket may differ, as a factor
PRECISION = 1.02
LARGEST_PUSH = 1e6


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
    game = with_margin(
        system.game, system.agents, system.disturbance, timestep, system.integrator, steps
    )
    return replace(system, game=game)


@part_of("system", "clock")
def search_period(
    system: System, clock: Clock, progress: Callable[[str], None] | None = None
) -> PeriodSearch:
    """Longer and longer control periods until one leaves the set between instants or at one.

    Periods are whole numbers of steps, each a fifth longer than the one before, then bisected. The
    duration is rounded up to whole periods.

    Raises:
        InvalidInput: mode continuous, which has no period.
    """
    if not mode_of(system).held:
        raise InvalidInput("mode", system.mode, "it holds no input")
    trials: list[tuple[float, bool]] = []

    def stays(steps: int) -> bool:
        period = steps * clock.timestep
        if progress is not None:
            progress(f"{system.name}: trying a period of {period:.4g} s")
        duration = np.ceil(clock.duration / period - 1e-9) * period
        try:
            trial = held_for(system, clock.timestep, steps)
            stayed = stays_inside(trial, Clock(duration, clock.timestep, period, duration))
        except (InvalidInput, InfeasibleStart):  # disturbances of so long use up a bound
            stayed = False
        trials.append((period, stayed))
        return stayed

    most = max(1, clock.steps(clock.duration) // 2)
    steps, good = 1, 0
    while steps <= most and stays(steps):
        good = steps
        steps = max(steps + 1, int(1.2 * steps))
    bad = steps if steps <= most else None
    note = "each a fifth longer than the last, then bisected"
    while bad is not None and good and bad - good > 1 and bad / good > PRECISION:
        middle = (good + bad) // 2
        if stays(middle):
            good = middle
        else:
            bad = middle
    if bad is None:
        note = f"half the duration is {most * clock.timestep:g} s"
    h = clock.timestep
    return PeriodSearch(good * h if good else None, bad and bad * h, tuple(trials), note)


@part_of("system", "clock")
def search_push(
    system: System, clock: Clock, progress: Callable[[str], None] | None = None
) -> PushSearch:
    """The smallest push that leaves the set: every pattern is doubled until it does, and bisected.

    Patterns push the agents of one constraint the ways that raise it, steadily, in squares of
    several periods, or once from some time on; the scenario's own faults stay.
    """
    best, pattern, runs, tried = np.inf, None, 0, 0.0
    if not stays_inside(system, clock):
        return PushSearch(0.0, "without any push", 0.0, 1)
    for name, pushes in _patterns(system, clock):

        def stays(size: float, pushes: tuple[Push, ...] = pushes) -> bool:
            nonlocal runs, tried
            runs, tried = runs + 1, max(tried, size)
            scaled = tuple(replace(push, force=push.force * size) for push in pushes)
            faults: tuple[Fault, ...] = (*system.faults, *scaled)
            return stays_inside(replace(system, faults=faults), clock)

        if progress is not None:
            progress(f"{system.name}: pushing, {name}")
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
