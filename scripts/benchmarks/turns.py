"""Timing in turns, so that all that is compared sees the same machine, and lines of the table."""

import statistics
from collections.abc import Callable, Mapping


def in_turns(kinds: Mapping[str, Callable[[], float]], turns: int) -> dict[str, list[float]]:
    """What each kind measured in each turn, after one that warms it up."""
    for measure in kinds.values():
        measure()
    times: dict[str, list[float]] = {name: [] for name in kinds}
    for _ in range(turns):
        for name, measure in kinds.items():
            times[name].append(measure())
    return times


def row(
    what: str,
    times: Mapping[str, list[float]],
    ours: str,
    other: str,
    target: str,
    *,
    upside_down: bool = False,
) -> dict[str, str]:
    """A line of the table: medians, and the median of the turns' ratios ours / other.

    Beside what is shown, its "spread" is the share within which the middle half of the turns'
    ratios lie, and "better" says whether a "higher" or a "lower" ratio is.

    Args:
        what: in words, with the unit.
        times: of each kind, in that unit.
        ours, other: which kinds.
        target: for the ratio.
        upside_down: the ratio is other / ours.
    """
    ratios = [a / b for a, b in zip(times[ours], times[other], strict=True)]
    ratio = statistics.median(ratios)
    first, _, last = statistics.quantiles(ratios, n=4) if len(ratios) > 1 else [ratio] * 3
    return {
        "what": what,
        "ours": f"{statistics.median(times[ours]):.3g}",
        "other": f"{statistics.median(times[other]):.3g}",
        "ratio": f"{1 / ratio if upside_down else ratio:.3g}",
        "target": target,
        "spread": f"{(last - first) / ratio:.2g}",
        "better": "higher" if upside_down or target.startswith(">") else "lower",
    }
