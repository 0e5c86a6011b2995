"""The search for each law's gains: the same budget for all, on starts of its own.

Of the values that a law names for its gains all combinations are tried, thinned evenly to the
budget, each from the same few random starts, which the comparison itself does not have. Chosen is
the combination with the fewest runs that do not settle to the variational equilibrium within a
tolerance, then the least median of the settling time, then of the final error. Violation is not
counted: it is what is compared.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gne_mj.comparison.entrants import Entrant
from gne_mj.comparison.stored import batch
from gne_mj.scenario import load_scenario, plain

OBJECTIVE = (
    "fewest runs whose final distance to the variational equilibrium is above the tolerance, or"
    " that do not settle within 2% of the start's; then the least median settling time, then the"
    " least median final distance; violation is not counted"
)


@dataclass(frozen=True)
class Search:
    """How gains are looked for.

    Args:
        budget: combinations that are tried at most.
        starts: random starts of each.
        tolerance: on the final distance to the variational equilibrium, in the action's unit.
        seed: of these starts.
        spread: how far towards the boundary they lie.
    """

    budget: int
    starts: int
    tolerance: float
    seed: int
    spread: float


@dataclass(frozen=True)
class Tuned:
    """A law with the gains that were found.

    Attributes:
        entrant: with these gains.
        gains: by their keys.
        tried: how many combinations were.
    """

    entrant: Entrant
    gains: Mapping[str, float]
    tried: int


def grid(tuned: Mapping[str, tuple[float, ...]], budget: int) -> dict[str, list[float]]:
    """The values of each key, thinned evenly to at most ``budget`` combinations."""
    counts = {key: len(values) for key, values in tuned.items()}
    while int(np.prod([*counts.values()])) > max(budget, 1):
        longest = max(counts, key=lambda key: counts[key])
        counts[longest] -= 1
    return {
        key: [values[round(k)] for k in np.linspace(0, len(values) - 1, counts[key])]
        if counts[key] > 1
        else [values[(len(values) - 1) // 2]]
        for key, values in tuned.items()
    }


def tune(entrant: Entrant, search: Search, folder: Path, threads: int) -> Tuned:
    """Look for a law's gains.

    Args:
        entrant: the law.
        search: how.
        folder: of the batch of all that is tried; what is there already is not run again.
        threads: native threads; 0 for one a processor.
    """
    sweep = grid(entrant.tuned, search.budget)
    if not sweep or search.budget < 2:
        return Tuned(entrant, {}, 0)
    runs = batch(
        entrant.tables, folder, sweep, threads=threads,
        starts=search.starts, seed=search.seed, spread=search.spread,
    )  # fmt: skip
    settling = runs["settling_time_to_variational"].to_numpy().reshape(-1, search.starts)
    error = runs["final_error_to_variational"].to_numpy().reshape(-1, search.starts)
    scores = [score(*each, search.tolerance) for each in zip(settling, error, strict=True)]
    best = min(range(len(scores)), key=lambda number: scores[number])
    gains = {key: float(runs[key].to_numpy()[best * search.starts]) for key in sweep}
    changed = plain(load_scenario(entrant.tables, gains))
    return Tuned(replace(entrant, tables=changed), gains, len(scores))


def score(settling: Any, error: Any, tolerance: float) -> tuple[float, float, float]:
    """What is made least, of runs with these settling times in s and final errors, each (runs,)."""
    settling, error = (np.where(np.isnan(each), np.inf, each) for each in (settling, error))
    failed = ~((error <= tolerance) & np.isfinite(settling))
    middle = [float(np.quantile(v, 0.5, method="inverted_cdf")) for v in (settling, error)]
    return float(failed.sum()), middle[0], middle[1]
