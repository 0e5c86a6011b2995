"""The largest epsilon that keeps a start inside, by trial [lemma:centreInv].

What is certain is far smaller (:mod:`gne_mj.theory.epsilon_star`). Each trial runs the system for
the clock's duration. Nothing assures that every epsilon below one that works works too.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from gne_mj.errors import InvalidInput, part_of
from gne_mj.progress import Tell, nothing
from gne_mj.system import Clock, System
from gne_mj.theory.trials import stays_inside

# How the bracket's ends may differ, as a factor
PRECISION = 1.01
# The search ends at this fraction of the given value, and at this many durations: with a larger
# epsilon estimates hardly move in a trial
LEAST, MOST = 2.0**-20, 10.0


@dataclass(frozen=True)
class EpsilonSearch:
    """What the trials showed.

    Attributes:
        inside: the largest epsilon tried that kept all inside to the end; None if none did.
        outside: the smallest one tried above it that did not; None if none was found.
        trials: all pairs (epsilon, whether all stayed inside), in the order tried.
        note: why the search ended where it did, if not at a bracket.
    """

    inside: float | None
    outside: float | None
    trials: tuple[tuple[float, bool], ...]
    note: str | None = None


@part_of("system", "clock")
def search_epsilon(system: System, clock: Clock, progress: Tell = nothing) -> EpsilonSearch:
    """Double or halve the system's epsilon until a bracket is found, then bisect its logarithm.

    Args:
        system: under the fully distributed law.
        clock: duration and steps of every trial.
        progress: called before every trial; those that are ahead are told as the most there can be.

    Raises:
        InvalidInput: another law.
    """
    law = system.law
    if law.epsilon is None:
        raise InvalidInput(
            "law.information",
            law.information,
            "only the distributed law has an epsilon",
        )
    trials: list[tuple[float, bool]] = []
    largest = MOST * clock.duration
    doublings = np.log2(max(largest / law.epsilon, 1.0))
    halvings = np.ceil(np.log2(np.log(2.0) / np.log(PRECISION)))
    most = int(max(doublings, -np.log2(LEAST)) + halvings) + 1

    def stays(epsilon: float) -> bool:
        done = len(trials)
        words = (
            f"{system.name}: trying epsilon = {epsilon:.4g} s"
            if done
            else (f"at most {most} runs of {clock.duration:g} s with other epsilon")
        )
        progress(done, max(most, done + 1), words)
        trial = replace(system, law=replace(law, epsilon=epsilon))  # type: ignore[type-var]
        stayed = stays_inside(trial, clock)
        trials.append((epsilon, stayed))
        return stayed

    good, bad, note = _bracket(stays, law.epsilon, largest)
    while note is None and bad / good > PRECISION:
        middle = float(np.sqrt(good * bad))
        if stays(middle):
            good = middle
        else:
            bad = middle
    inside = max((tried for tried, stayed in trials if stayed), default=None)
    outside = min(
        (tried for tried, stayed in trials if not stayed and (inside is None or tried > inside)),
        default=None,
    )
    return EpsilonSearch(inside, outside, tuple(trials), note)


def _bracket(
    stays: Callable[[float], bool], epsilon: float, most: float
) -> tuple[float, float, str | None]:
    """(good, bad, note): one that stays inside and one that does not, twice or half of it.

    The note says what ended the search before there was such a pair.
    """
    first, good, bad = epsilon, epsilon, epsilon
    growing = stays(epsilon)
    while True:
        following = (2.0 if growing else 0.5) * epsilon
        if following < LEAST * first or (growing and following > most):
            return good, bad, f"{following:.4g} s was not tried"
        try:
            stayed = stays(following)
        except InvalidInput as error:  # a step too long for a smaller epsilon
            return good, bad, f"{following:.4g} s cannot be tried: {error.expected}"
        epsilon = following
        if stayed:
            good = epsilon
        else:
            bad = epsilon
        if stayed != growing:
            return good, bad, None
