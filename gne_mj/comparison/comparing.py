"""One call: laws tuned, run from the same starts, and put together as one dataset."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gne_mj.arguments import answering
from gne_mj.batches import Plan, Store
from gne_mj.comparison.entrants import ALL, Entrant, Given, entrants
from gne_mj.comparison.stored import batch
from gne_mj.comparison.tuning import OBJECTIVE, Search, Tuned, tune
from gne_mj.epsilon import epsilon_at
from gne_mj.errors import InvalidInput
from gne_mj.margins import of_the_set
from gne_mj.progress import Tell, if_asked
from gne_mj.scenario import Source, load_scenario
from gne_mj.scenario_tables import Scenario
from gne_mj.simulation import Simulation
from gne_mj.system import System
from gne_mj.theory.guarantees import certify
from gne_mj.trajectory import Trajectory, versions

if TYPE_CHECKING:
    import xarray

REPLAY = "replay.zarr"  # one run of each law, beside each other
ROWS = 200  # samples of violation and distance that are kept of each run
TUNING_STARTS = 10
# What is kept of each run, by its name in batches
FIGURES = (
    "status", "largest_violation", "violation_of_bound", "exits", "time_outside",
    "violation_integral", "last_outside", "settling_time_to_variational",
    "final_error_to_variational", "peak_input", "least_margin", "exit_time",
)  # fmt: skip


@answering
def compare(
    source: Source,
    laws: Sequence[Given] = (ALL,),
    changes: Mapping[str, Any] | None = None,
    *,
    out: str | Path,
    runs: int = 100,
    system: str | None = None,
    seed: int = 0,
    spread: float = 0.9,
    budget: int = 24,
    tolerance: float = 1e-2,
    threads: int = 0,
    resume: bool = False,
    progress: Callable[[str], None] | bool = False,
) -> xarray.Dataset:
    """Put laws beside each other: the same random starts, faults and periods, each law tuned.

    >>> laws = ["full", "primal-dual", "my_law.py"]
    >>> found = gne_mj.compare("desired-velocity", laws, runs=100, out="results/laws")

    Args:
        source: see :func:`gne_mj.load_scenario`.
        laws: names, each perhaps with a mode (``full:sampled``), files of laws of one's own, tables
            as :func:`gne_mj.full_information` makes them; "all" that scenarios can name.
        changes: dotted keys to new values.
        out: folder to write, in which each law has its batches.
        runs: random starts, around the middle of the set.
        system: which; may be left out if there is only one.
        seed: from which all starts' seeds follow.
        spread: how far towards the boundary starts lie, between 0 and 1.
        budget: combinations of gains that are tried for each law at most; 1: none is tuned.
        tolerance: while tuning, on the final distance to the variational equilibrium.
        threads: native threads; 0 for one a processor.
        resume: go on with what an earlier call has begun there, if any.
        progress: True to tell on stderr how far it is; or what is called before each law's work.

    Returns:
        Of dimensions law, run, time: figures of runs as batches have them, ``violation`` (law, run,
        time), max_l g_l, 0 inside, and ``distance`` to the variational equilibrium; of each law
        ``gains``, what is ``certified``, ``messages`` and ``step_time`` of one run.

    Raises:
        InvalidInput: names the key, the value and what would be right.
    """
    if Path(out).exists() and not resume:
        raise InvalidInput("out", str(out), "it exists already; name another, or add `resume`")
    if runs < 1:
        raise InvalidInput("runs", runs, "there must be one random start at least")
    base = load_scenario(source, changes)
    name = base.name_of(system)
    one = base.model_copy(update={"systems": {name: base.systems[name]}})
    search = Search(budget, TUNING_STARTS, tolerance, seed + 1, spread)
    how = {"starts": runs, "seed": seed, "spread": spread, "threads": threads}
    with if_asked(progress) as tell:
        told = progress if callable(progress) else lambda words: None
        return _compared(one, laws, Path(out), search, how, _Note(tell, told))


class _Note(NamedTuple):
    """Whom to tell how far it is."""

    tell: Tell
    told: Callable[[str], Any]

    def __call__(self, done: float, total: int, words: str) -> None:
        self.tell(done, float(total), words)
        self.told(words)


def _compared(
    one: Scenario,
    laws: Sequence[Given],
    folder: Path,
    search: Search,
    how: Mapping[str, Any],
    note: _Note,
) -> xarray.Dataset:
    """The comparison of laws in a scenario of one system."""
    found, refused = entrants(one, laws)
    parts: dict[str, xarray.Dataset] = {}
    tuned = []
    for number, entrant in enumerate(found):
        words = f"law {number + 1} of {len(found)}, {entrant.name}"
        note(number, len(found), f"{words}: tuning")
        best = tune(entrant, search, folder / "tuning" / entrant.name, how["threads"])
        note(number + 0.5, len(found), f"{words}: running")
        parts[entrant.name] = _run(best.entrant, folder / "laws" / entrant.name, how)
        tuned.append(best)
    note(len(found), len(found), "one run of each law")
    data = _together(parts, tuned, _beside(tuned, folder))
    data.attrs |= {
        "scenario": one.model_dump_json(exclude_none=True), "refused": json.dumps(refused),
        "runs": how["starts"], "seed": how["seed"], "spread": how["spread"],
        "budget": search.budget, "tuning_starts": search.starts, "tolerance": search.tolerance,
        "objective": OBJECTIVE, "versions": json.dumps(versions()),
    }  # fmt: skip
    return data


def _run(entrant: Entrant, folder: Path, how: Mapping[str, Any]) -> xarray.Dataset:
    """A law's runs: figures, violation and distance, of the dimensions run and time."""
    import xarray

    clock = load_scenario(entrant.tables).clock()
    rows = clock.steps(clock.duration) / clock.steps(clock.sample_period)
    runs = batch(entrant.tables, folder, {}, record=max(1, int(np.ceil(rows / ROWS))), **how)
    (system,) = load_scenario(entrant.tables).system_objects()
    g = runs["constraint"].to_numpy()
    y = runs["action"].to_numpy()
    found = system.variational
    away = np.abs(y - (np.nan if found is None else found.action))
    data: dict[str, Any] = {
        name: ("run", runs[name].to_numpy(), runs[name].attrs) for name in FIGURES
    }
    data["rms_input"] = (
        "run", np.sqrt(np.mean(runs["rms_input"].to_numpy() ** 2, axis=1)),
        {**runs["rms_input"].attrs, "long_name": "RMS over time and channels"},
    )  # fmt: skip
    ends = runs["final_action"].to_numpy()
    data["epsilon"] = (
        "run", np.array([_epsilon(system, clock.duration, end) for end in ends]),
        {"long_name": "what an agent could gain by deviating alone at the end"},
    )  # fmt: skip
    data["violation"] = (
        ("run", "time"),
        np.maximum(np.max(g, axis=2), 0.0),
        {"long_name": "max_l g_l, 0 inside"},
    )
    data["distance"] = (
        ("run", "time"), np.max(away, axis=2),
        {"units": system.game.action_unit, "long_name": "to the variational equilibrium"},
    )  # fmt: skip
    return xarray.Dataset(data, {"time": ("time", runs["time"].to_numpy(), {"units": "s"})})


def _epsilon(system: System, time: float, y: np.ndarray) -> float:
    """What an agent could gain at a run's end; not a number where that is not known."""
    known = np.all(np.isfinite(y))
    found = epsilon_at(of_the_set(system.game_at(time)), y) if known else None
    return np.nan if found is None else found


def _beside(tuned: Sequence[Tuned], folder: Path) -> Trajectory:
    """One run of each law from the first random start, kept as a trajectory of them all."""
    path = folder / REPLAY
    tables: dict[str, Any] = {"systems": {}}
    for each in tuned:
        plan: Plan = Store.open(folder / "laws" / each.entrant.name).plan
        alone = plan.alone(0).model_dump(exclude_none=True)
        (only,) = alone.pop("systems").values()
        tables |= alone
        tables["systems"][each.entrant.name] = only
    if path.exists():
        kept = Trajectory.load(path)
        if set(kept.reports) == set(tables["systems"]):
            return kept
        rmtree(path)  # of fewer laws, or others
    simulation: Simulation = load_scenario(tables).simulation_object()
    trajectory = simulation.run()
    trajectory.save(path)
    return trajectory


def _together(
    parts: Mapping[str, xarray.Dataset], tuned: Sequence[Tuned], beside: Trajectory
) -> xarray.Dataset:
    import xarray

    data = xarray.concat(parts.values(), "law").assign_coords(law=("law", [*parts]))
    gains, laws = {each.entrant.name: each for each in tuned}, []
    for name in parts:
        each, report = gains[name], beside.reports[name]
        messages = report["messages"]
        (system,) = each.entrant.tables["systems"].values()
        words = ", ".join(f"{key} = {value:g}" for key, value in each.gains.items())
        numbers = (None if messages is None else messages["sent"], report["step_time"])
        known = (np.nan if value is None else value for value in numbers)
        mode = system["controller"]["mode"]
        laws.append((words, each.tried, mode, _certified(each.entrant), *known))
    columns = zip(*laws, strict=True)
    names = ("gains", "tried", "mode", "certified", "messages", "step_time")
    return data.assign(
        {key: ("law", np.array(column)) for key, column in zip(names, columns, strict=True)}
    )


def _certified(entrant: Entrant) -> str:
    """The verdict on a law with its gains, from the scenario's own start."""
    scenario = load_scenario(entrant.tables)
    (system,) = scenario.system_objects()
    return certify(system, scenario.clock()).status
