"""The command that puts laws beside each other."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gne_mj.cli.application import app
from gne_mj.cli.arguments import JSON, SCENARIO, SET, SYSTEM, settings
from gne_mj.cli.output import emit
from gne_mj.progress import PREPARING, telling

if TYPE_CHECKING:
    from gne_mj.comparison.entrants import Given


LAWS = Annotated[
    str,
    typer.Option(
        "--laws",
        metavar="NAMES",
        help="Laws, as full,primal-dual; 'all' that scenarios can name; with a mode of its own as"
        " full:sampled.",
    ),
]
LAW = Annotated[
    list[Path] | None,
    typer.Option("--law", metavar="FILE", help="A law of one's own; may be repeated."),
]
RUNS = Annotated[int, typer.Option("--runs", help="Random interior starts.")]
FOLDER = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder to write.")]
SEED = Annotated[int, typer.Option("--seed", help="From which all starts' seeds follow.")]
SPREAD = Annotated[
    float, typer.Option("--spread", help="How far towards the boundary starts lie, from 0 to 1.")
]
BUDGET = Annotated[
    int,
    typer.Option(
        "--budget", help="Combinations of gains tried for each law at most; 1: none is tuned."
    ),
]
TOLERANCE = Annotated[
    float, typer.Option("--tolerance", help="While tuning, on the final distance to the vGNE.")
]
THREADS = Annotated[int, typer.Option("--threads", help="Native threads; 0 for one a processor.")]
RESUME = Annotated[bool, typer.Option("--resume", help="Go on with what is in DIR already.")]


@app.command()
def compare(
    source: SCENARIO,
    laws: LAWS = "",
    law: LAW = None,
    runs: RUNS = 100,
    folder: FOLDER = Path("results/comparison"),
    set_: SET = None,
    system: SYSTEM = None,
    seed: SEED = 0,
    spread: SPREAD = 0.9,
    budget: BUDGET = 24,
    tolerance: TOLERANCE = 1e-2,
    threads: THREADS = 0,
    resume: RESUME = False,
    as_json: JSON = False,
) -> None:
    """Put laws beside each other: the same starts, faults and periods, each tuned alike.

    Everything ends in DIR: a table (comparison.md, .csv, .json), a figure, each law's batch, and
    one run of each side by side, for `view DIR/replay.zarr`.
    """
    from gne_mj import comparison
    from gne_mj.comparison import report
    from gne_mj.errors import named
    from gne_mj.extras import need

    need("plots", "the figure of a comparison")
    given: list[Given] = [*filter(None, laws.split(",")), *(law or [])] or ["all"]
    with named(out="folder"), telling(PREPARING, quiet=as_json) as tell:
        data = comparison.compare(
            source, given, settings(set_), out=folder, runs=runs, system=system, seed=seed,
            spread=spread, budget=budget, tolerance=tolerance, threads=threads, resume=resume,
            progress=lambda words: tell(0.0, 1.0, words),
        )  # fmt: skip
        paths = report.write(data, folder)
    if as_json:
        emit((folder / "comparison.json").read_text(encoding="utf-8"))
        return
    print("\n".join(report.lines(data)))
    for path in paths:
        print(f"{'figure' if path.suffix == '.png' else 'table':11} {path}")
    print(f"runs        {folder / comparison.REPLAY}")
