"""Commands that run scenarios, draw stored runs and list what is shipped."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gne_mj.cli.application import app
from gne_mj.cli.arguments import FORMAT, INDEX, JSON, OUT, PORT, REPLACE, SET, WHERE, formats
from gne_mj.cli.output import Results, folder_for, tell
from gne_mj.cli.simulating import is_saved, simulate, source_of, stored
from gne_mj.cli.views import REPLAY, watch
from gne_mj.progress import telling

if TYPE_CHECKING:
    from gne_mj.trajectory import Trajectory
    from gne_mj.viewer.session import Begin


@app.command()
def run(
    source: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENARIO",
            help="Name of a shipped scenario (see `scenarios`), or a .toml file.",
        ),
    ] = None,
    set_: SET = None,
    out: OUT = None,
    folder: Annotated[
        Path | None,
        typer.Option("--from", metavar="DIR", help="Run one of this batch's runs, by --index."),
    ] = None,
    index: INDEX = None,
    view: Annotated[
        bool, typer.Option("--view", help="Show it in a browser while it runs, in real time.")
    ] = False,
    now: Annotated[
        bool, typer.Option("--now", help="With --view: begin before a browser is there.")
    ] = False,
    paused: Annotated[
        bool, typer.Option("--paused", help="With --view: begin when a viewer says so.")
    ] = False,
    speed: Annotated[
        str | None,
        typer.Option("--speed", metavar="X", help="With --view: times real time, or 'max'."),
    ] = None,
    port: PORT = None,
    as_json: JSON = False,
) -> None:
    """Run a scenario; keep the trajectory and a JSON report in --out.

    A batch's run that is run alone takes the same steps to the last bit.

    With --view the run begins when the first browser shows its start, and is shown on after its
    end, until Ctrl-C.
    """
    from gne_mj.errors import InvalidInput

    chosen = source_of(source, folder, index)
    if now and paused:
        raise InvalidInput("now", True, "it cannot be with `paused`")
    if view:
        begin: Begin = "now" if now else "paused" if paused else "viewer"
        title = Path(source).stem if source else f"run {index} of {folder}"
        trajectory = watch(
            chosen, set_, Results(out), as_json, title=title, speed=speed, port=port, begin=begin
        )
    else:
        given = (("speed", speed), ("port", port), ("now", now or None), ("paused", paused or None))
        for key, value in given:
            if value is not None:
                raise InvalidInput(key, value, "it goes with `view`")
        results = Results(out)
        trajectory = simulate(chosen, set_, results, quiet=as_json)
        tell(trajectory, as_json, results.out)
    raise typer.Exit(0 if trajectory.holds else 1)


@app.command()
def paper(
    set_: SET = None,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")
    ] = Path("results/paper"),
    as_json: JSON = False,
) -> None:
    """Run the paper's two experiments beside each other; draw their figures and a replay.

    Results of an earlier `paper` in the same folder are replaced; other files there stay.
    """
    from gne_mj.extras import need

    need("plots", "drawing figures")
    need("view", "a replay")
    results = Results(out, replace=True)
    illustrate = partial(_illustrate, quiet=as_json)
    trajectory = simulate("paper", set_, results, quiet=as_json, illustrate=illustrate)
    out = results.out or out
    tell(trajectory, as_json, out)
    if not as_json:
        for figure in sorted(out.glob("*.png")):
            print(f"figure      {figure}")
        print(f"replay      {out / 'replay.html'}")
    raise typer.Exit(0 if trajectory.holds else 1)


def _illustrate(trajectory: "Trajectory", folder: Path, quiet: bool) -> None:
    from gne_mj import plots
    from gne_mj.viewer import write_html

    with telling("drawing", quiet=quiet) as shown:
        plots.save(trajectory, folder, progress=shown)
    with telling(REPLAY, quiet=quiet):
        write_html(trajectory, folder / "replay.html", "paper")


@app.command()
def plot(
    folder: Annotated[
        Path,
        typer.Argument(
            metavar="RUN", help="Folder that `run --out`, `paper` or a program's `save` wrote."
        ),
    ],
    out: WHERE = None,
    format_: FORMAT = None,
    animation: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.webp", help="Write how agents move in the plane, and no figures."
        ),
    ] = None,
    replace: REPLACE = False,
) -> None:
    """Draw the figures of a stored run.

    In the run's own folder they take the place of older ones.
    """
    from gne_mj import plots
    from gne_mj.errors import named
    from gne_mj.extras import need

    need("plots", "drawing figures")
    kinds = formats(format_)
    trajectory = stored(folder)
    if animation is not None:
        with telling("drawing") as shown:
            print(plots.animate(trajectory, animation, replace=replace, progress=shown))
        return
    target = folder_for(out, folder.parent if is_saved(folder) else folder)
    with named(folder="out"), telling("drawing") as shown:
        anyway = replace or target == folder
        paths = plots.save(trajectory, target, kinds, replace=anyway, progress=shown)
    for path in paths:
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
        raise InvalidInput("name", name, nearest(name, files))
