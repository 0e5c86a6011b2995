"""Commands that run scenarios, draw stored runs and list what is shipped."""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gne_mj.cli.application import app
from gne_mj.cli.arguments import FORMAT, JSON, OUT, SET, WHERE, formats, settings
from gne_mj.cli.output import PREPARING, progress, results, tell, working

if TYPE_CHECKING:
    from gne_mj.simulation import Simulation
    from gne_mj.trajectory import Trajectory


@app.command()
def run(
    scenario: Annotated[
        str | None,
        typer.Argument(help="Name of a shipped scenario (see `scenarios`), or a .toml file."),
    ] = None,
    set_: SET = None,
    out: OUT = None,
    from_: Annotated[
        Path | None,
        typer.Option("--from", metavar="DIR", help="Run one of this batch's runs, by --index."),
    ] = None,
    index: Annotated[int | None, typer.Option("--index", help="Number of the run, from 0.")] = None,
    as_json: JSON = False,
) -> None:
    """Run a scenario; keep the trajectory and a JSON report in --out.

    A batch's run that is run alone takes the same steps to the last bit.
    """
    trajectory = _simulate(_source(scenario, from_, index), set_, out, quiet=as_json)
    tell(trajectory, as_json)
    if out is not None and not as_json:
        print(f"\ntrajectory  {out / 'trajectory.zarr'}\nreport      {out / 'report.json'}")
    raise typer.Exit(0 if trajectory.holds else 1)


@app.command()
def paper(
    set_: SET = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")
    ] = Path("results/paper"),
    as_json: JSON = False,
) -> None:
    """Run the paper's two experiments beside each other and draw its four figures.

    Results of an earlier `paper` in the same folder are replaced; other files there stay.
    """
    trajectory = _simulate("paper", set_, out, quiet=as_json, replace=True, figures=("png",))
    tell(trajectory, as_json)
    if not as_json:
        print(f"\ntrajectory  {out / 'trajectory.zarr'}\nreport      {out / 'report.json'}")
        for figure in sorted(out.glob("*.png")):
            print(f"figure      {figure}")
    raise typer.Exit(0 if trajectory.holds else 1)


@app.command()
def plot(
    run_folder: Annotated[
        Path, typer.Argument(metavar="RUN", help="Folder that `run --out` or `paper` wrote.")
    ],
    out: WHERE = None,
    format_: FORMAT = None,
) -> None:
    """Draw the figures of a stored run."""
    from gne_mj import plots
    from gne_mj.errors import InvalidInput
    from gne_mj.trajectory import Trajectory

    store = run_folder / "trajectory.zarr"
    if not store.is_dir():
        raise InvalidInput("RUN", str(run_folder), "it must be a folder with a trajectory.zarr")
    kinds = formats(format_)
    try:
        trajectory = Trajectory.load(store)
    except (OSError, KeyError):
        raise InvalidInput(
            "RUN", str(run_folder), "its trajectory.zarr must be one that a run wrote"
        ) from None
    target = out or run_folder
    target.mkdir(parents=True, exist_ok=True)
    for path in plots.save(trajectory, target, kinds):
        print(path)


@app.command()
def scenarios(
    name: Annotated[
        str | None, typer.Argument(help="Print this scenario's file, to start one of your own.")
    ] = None,
) -> None:
    """List the shipped scenarios, or print one."""
    import tomllib

    from gne_mj.errors import InvalidInput, nearest
    from gne_mj.scenario import shipped

    files = shipped()
    if name is None:
        width = max(map(len, files))
        for key, text in files.items():
            print(f"{key:{width}}  {tomllib.loads(text)['description']}")
    elif name in files:
        print(files[name], end="")
    else:
        raise InvalidInput("scenario", name, nearest(name, files))


def _source(
    scenario: str | None, folder: Path | None, index: int | None
) -> "str | Mapping[str, Any]":
    """What to run: a scenario's name, or the tables of a batch's run."""
    from gne_mj.errors import InvalidInput

    if (scenario is None) == (folder is None):
        raise InvalidInput("SCENARIO", scenario, "either a scenario or --from must be given")
    if folder is None:
        if index is not None:
            raise InvalidInput("--index", index, "it goes with --from")
        assert scenario is not None
        return scenario
    if index is None:
        raise InvalidInput("--index", index, "it must say which run of the batch")
    from gne_mj.batches import Store

    store = Store.open(folder)
    for difference in store.check_files():
        print(
            f"gne-mj: warning: {difference} since the batch was run, so that the last bits may"
            " differ",
            file=sys.stderr,
        )
    tables: dict[str, Any] = json.loads(store.plan.alone(index).model_dump_json(exclude_none=True))
    return tables


def _simulate(
    scenario: "str | Mapping[str, Any]",
    changes: list[str] | None,
    out: Path | None,
    *,
    quiet: bool,
    replace: bool = False,
    figures: tuple[str, ...] = (),
) -> "Trajectory":
    from gne_mj.simulation import interruption

    simulation = load(scenario, changes, quiet=quiet)
    # The interruption covers the writing too: a first Ctrl-C never loses what was computed.
    with (
        interruption(),
        results(out, replace) as folder,
        progress(simulation.clock.duration, quiet) as show,
    ):
        trajectory = simulation.run(show)
        if folder is not None:
            trajectory.save(folder / "trajectory.zarr")
            report = json.dumps(trajectory.report(), indent=2)
            (folder / "report.json").write_text(report + "\n", encoding="utf-8")
            if figures:
                from gne_mj import plots

                plots.save(trajectory, folder, figures)
    return trajectory


def load(
    scenario: "str | Mapping[str, Any]", changes: list[str] | None, *, quiet: bool
) -> "Simulation":
    """The simulation of a scenario with what --set changes."""
    from gne_mj.scenario import load_scenario

    with working(quiet, PREPARING):
        return load_scenario(scenario, settings(changes)).simulation_object()
