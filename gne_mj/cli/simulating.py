"""What commands that run something, or read a run, have in common."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gne_mj.cli.arguments import settings
from gne_mj.cli.output import Results
from gne_mj.cli.signals import stopping
from gne_mj.progress import PREPARING, of_time, say, telling

if TYPE_CHECKING:
    from gne_mj.simulation import Simulation
    from gne_mj.trajectory import Trajectory


def source_of(
    source: str | None, folder: Path | None, index: int | None
) -> "str | Mapping[str, Any]":
    """What to run: a scenario's name, or the tables of a batch's run."""
    from gne_mj.errors import InvalidInput, named

    if (source is None) == (folder is None):
        raise InvalidInput("source", source, "either a scenario or `folder` must be given")
    if folder is None:
        if index is not None:
            raise InvalidInput("index", index, "it goes with `folder`")
        assert source is not None
        return source
    if index is None:
        raise InvalidInput("index", index, "it must say which run of the batch")
    from gne_mj.batches import Store

    store = Store.open(folder)
    for difference in store.check_files():
        say(
            f"gne-mj: warning: {difference} since the batch was run, so that the last bits may"
            " differ"
        )
    with named(run="index"):
        alone = store.plan.alone(index)
    tables: dict[str, Any] = json.loads(alone.model_dump_json(exclude_none=True))
    return tables


def simulate(
    scenario: "str | Mapping[str, Any]",
    changes: list[str] | None,
    results: Results,
    *,
    quiet: bool,
    illustrate: "Callable[[Trajectory, Path], None] | None" = None,
) -> "Trajectory":
    """Run a scenario to its end, with progress, and keep it in a folder.

    Args:
        scenario, changes: what to run, with what --set changes.
        results: where to keep it, if anywhere.
        quiet: show no progress but on a terminal.
        illustrate: writes pictures beside the trajectory.
    """
    simulation = load(scenario, changes, quiet=quiet)
    warn(simulation)
    with stopping():  # the writing too: a first Ctrl-C never loses what was computed
        duration = simulation.clock.duration
        with telling(PREPARING, quiet=quiet) as tell:
            trajectory = simulation.run(of_time(tell, duration))
        with results.written() as folder:
            if folder is not None:
                with telling("writing", quiet=quiet):
                    keep(trajectory, folder)
                if illustrate is not None:
                    illustrate(trajectory, folder)
    return trajectory


def warn(simulation: "Simulation") -> None:
    """Tell before a run what will go wrong with users' robots."""
    for name, doubts in simulation.doubts().items():
        for doubt in doubts:
            say(f"gne-mj: warning: systems.{name}: {doubt}")


def keep(trajectory: "Trajectory", folder: Path) -> None:
    """Write what a run leaves: the trajectory, its report, and how to do again what was done."""
    trajectory.save(folder / "trajectory.zarr")
    report = json.dumps(trajectory.report(), indent=2)
    (folder / "report.json").write_text(report + "\n", encoding="utf-8")
    if trajectory.interventions:
        from gne_mj.scenario import scenario_of

        (folder / "scenario.toml").write_text(scenario_of(trajectory).toml(), encoding="utf-8")


def is_batch(folder: Path) -> bool:
    """Whether a folder is one that `batch` wrote."""
    return (folder / "manifest.json").is_file()


def is_saved(folder: Path) -> bool:
    """Whether a folder is a trajectory itself, as `Trajectory.save` writes it."""
    return (folder / ".zgroup").is_file()


def stored(folder: Path) -> "Trajectory":
    """The trajectory that a run wrote into a folder, or that a program saved as one."""
    from gne_mj.errors import InvalidInput
    from gne_mj.trajectory import Trajectory

    store = folder if is_saved(folder) else folder / "trajectory.zarr"
    if not store.is_dir():
        batch = "; of a batch say which run, by `index`" if is_batch(folder) else ""
        raise InvalidInput(
            "folder", str(folder), f"it must be a folder with a trajectory.zarr{batch}"
        )
    return Trajectory.load(store)


def load(
    scenario: "str | Mapping[str, Any]", changes: list[str] | None, *, quiet: bool
) -> "Simulation":
    """The simulation of a scenario with what --set changes."""
    from gne_mj.scenario import load_scenario

    with telling(PREPARING, quiet=quiet):
        return load_scenario(scenario, settings(changes)).simulation_object()
