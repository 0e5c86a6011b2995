"""Runs side by side, and a small table of how they went."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

from gne_mj.arguments import answering
from gne_mj.controllers.table import LawTable
from gne_mj.errors import InvalidInput
from gne_mj.interface.running import Run, part_changes, run_scenario
from gne_mj.progress import Tell, if_asked
from gne_mj.scenario import Source, load_scenario

if TYPE_CHECKING:
    import pandas

MOST = 100  # runs; more are a batch


@dataclass(frozen=True, repr=False)
class Variations:
    """Runs of one set-up that differ in a few values.

    Attributes:
        varied: for each run its values, in words, by what was varied.
        runs: in the same order.
    """

    varied: tuple[dict[str, str], ...]
    runs: tuple[Run, ...]

    @property
    def table(self) -> pandas.DataFrame:
        """A row for each run, or each system of one: status, margin, settling time, distances.

        Times in s, margins -g and distances in the action's unit; not a number where unknown.
        """
        import pandas

        rows = []
        for varied, run in zip(self.varied, self.runs, strict=True):
            for name, report in run.reports.items():
                system = {"system": name} if len(run.reports) > 1 else {}
                rows.append({**varied, **system, **_row(report)})
        return pandas.DataFrame(rows)

    def __repr__(self) -> str:
        shown = self.table.to_string(index=False, float_format=lambda value: f"{value:.4g}")
        return str(shown)

    def _repr_html_(self) -> str:
        html = self.table.to_html(index=False, float_format=lambda value: f"{value:.4g}")
        return str(html)


def _row(report: Mapping[str, Any]) -> dict[str, Any]:
    worst, distances = report["worst_constraint"] or {}, report["equilibrium"]
    return {
        "status": report["status"],
        "least margin": worst.get("margin"),
        "of": worst.get("name"),
        "settled": report["settling_time"],
        "from y*": distances["final_distance"],
        "from vGNE": distances["final_distance_to_variational"],
        "peak input": report["actuators"]["peak"],
    }


@answering
def vary(
    source: Source,
    values: Mapping[str, Sequence[Any]],
    changes: Mapping[str, Any] | None = None,
    *,
    progress: Callable[[int, int], None] | bool = False,
) -> Variations:
    """Run all combinations of a few values, and put the runs beside each other.

    >>> laws = [gne_mj.full_information(), gne_mj.partial_information("ring")]
    >>> gne_mj.vary("velocity-sync", {"law": laws, "rho": [0.1, 0.01]})

    Args:
        source: a scenario, or a game.
        values: dotted keys, or the names that :func:`gne_mj.setup` has for parts, each with a list
            of values.
        changes: of all runs.
        progress: True to tell on stderr how long it takes and how far it is, as commands do; or
            what is called before each run with its number, from 0, and how many there are.

    Raises:
        InvalidInput: names the key, the value and what would be right; before anything is run.
    """
    for key, each in values.items():
        if isinstance(each, str | bytes | Mapping) or not isinstance(each, Sequence):
            raise InvalidInput(f"values.{key}", each, "its values must be a list")
    combinations = [dict(zip(values, each, strict=True)) for each in product(*values.values())]
    if not 0 < len(combinations) <= MOST:
        raise InvalidInput(
            "values", f"{len(combinations)} runs", f"there must be 1 to {MOST}; more are a batch"
        )
    base = load_scenario(source, changes)
    scenarios = [load_scenario(base, part_changes(source, each)) for each in combinations]
    total = sum(scenario.clock().duration for scenario in scenarios)
    runs: list[Run] = []
    with if_asked(progress) as tell:
        tell(0.0, total, f"{len(scenarios)} runs, {total:g} s of them together")
        done = 0.0
        for number, scenario in enumerate(scenarios):
            if callable(progress):
                progress(number, len(scenarios))
            words = f"run {number + 1} of {len(scenarios)}"
            runs.append(run_scenario(scenario, _within(tell, done, total, words)))
            done += scenario.clock().duration
    varied = tuple({key: _words(value) for key, value in each.items()} for each in combinations)
    return Variations(varied, tuple(runs))


def _within(tell: Tell, done: float, total: float, words: str) -> Callable[[float], None]:
    """What one of several simulations calls with its time."""
    return lambda time: tell(done + time, total, words)


def _words(value: Any) -> str:
    """A value in a table."""
    if isinstance(value, LawTable):
        return f"{value.information}, {value.mode}"  # type: ignore[attr-defined]
    if callable(value):
        return getattr(value, "__name__", repr(value))
    return f"{value:g}" if isinstance(value, float) else str(value)
