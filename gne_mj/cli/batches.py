"""Commands that run many runs, and tell of them."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gne_mj.cli.application import app
from gne_mj.cli.arguments import (
    FORMAT,
    JSON,
    REPLACE,
    SET,
    SYSTEM,
    WHERE,
    formats,
    meaning,
    settings,
)
from gne_mj.cli.output import emit, folder_for
from gne_mj.cli.signals import stopping
from gne_mj.progress import PREPARING, telling

if TYPE_CHECKING:
    from gne_mj.batches import Plan, Progress, Shard, Store, Sweep
    from gne_mj.batches.report import Report


# What `batch` alone is asked for
SOURCE = Annotated[
    str | None,
    typer.Argument(
        metavar="SCENARIO",
        help="A shipped scenario or a .toml file; with --resume it may be left out.",
    ),
]
SWEEPS = Annotated[
    list[str] | None,
    typer.Option(
        "--sweep",
        metavar="KEY=VALUES",
        help="Values A,B,... or FROM:TO:COUNT or FROM:TO:COUNTlog; may be repeated, and all"
        " combinations are run.",
    ),
]
STARTS = Annotated[
    int,
    typer.Option(
        "--runs", help="Random interior starts of each combination; 0: the scenario's own."
    ),
]
FOLDER = Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder to write.")]
RECORD = Annotated[
    str,
    typer.Option(
        "--record",
        help="What is kept: 'summaries', 'all' samples too, or every K-th one (a number).",
    ),
]
SEED = Annotated[int, typer.Option("--seed", help="From which all starts' seeds follow.")]
SPREAD = Annotated[
    float,
    typer.Option("--spread", help="How far towards the boundary starts lie, between 0 and 1."),
]
CHECK = Annotated[
    str,
    typer.Option(
        "--check-in-mujoco",
        metavar="SHARE",
        help="Make this share of the runs, as 1%, in MuJoCo too, and tell how far they are apart;"
        " for engine 'ode'.",
    ),
]
CHUNK = Annotated[int, typer.Option("--chunk", help="Runs that are stored together; 0: chosen.")]
THREADS = Annotated[int, typer.Option("--threads", help="Native threads; 0 for one a processor.")]
RESUME = Annotated[bool, typer.Option("--resume", help="Go on with what is in DIR already.")]
CLUSTER = Annotated[
    str | None,
    typer.Option("--cluster", metavar="ADDRESS", help="Run on the workers of this Dask scheduler."),
]
SHARD = Annotated[
    str | None,
    typer.Option(
        "--shard",
        metavar="I/N",
        help="Run every N-th chunk only, beside other processes that run the others into DIR.",
    ),
]
FAIL_ON_EXIT = Annotated[
    bool, typer.Option("--fail-on-exit", help="Exit status 1 if any run ended early.")
]


@app.command()
def batch(
    source: SOURCE = None,
    sweeps: SWEEPS = None,
    starts: STARTS = 0,
    folder: FOLDER = Path("results/batch"),
    set_: SET = None,
    system: SYSTEM = None,
    record: RECORD = "summaries",
    seed: SEED = 0,
    spread: SPREAD = 0.9,
    chunk: CHUNK = 0,
    check_in_mujoco: CHECK = "0",
    threads: THREADS = 0,
    resume: RESUME = False,
    cluster: CLUSTER = None,
    shard: SHARD = None,
    fail_on_exit: FAIL_ON_EXIT = False,
    as_json: JSON = False,
) -> None:
    """Run all combinations of swept values from random starts, into one dataset.

    Everything ends in DIR: runs.zarr, which xarray alone can open, tables and a figure. A batch
    that was stopped or killed goes on with --resume, and ends as if it had not been. With --shard
    the same command does both: the first shard makes DIR, and each goes on with its own chunks.
    """
    from gne_mj import batches
    from gne_mj.errors import InvalidInput, named
    from gne_mj.extras import need

    need("plots", "a batch's figure")
    changed = bool(sweeps or set_ or system or starts or seed or chunk or check_in_mujoco != "0")
    if source is None and (changed or record != "summaries" or spread != 0.9):
        raise InvalidInput(
            "source", None, "a scenario must be named, unless `resume` `folder` DIR is all there is"
        )
    own = named(address="cluster", store="folder", target="folder")
    with own, batches.connected(cluster) as client, stopping() as stop:
        part = None if shard is None else meaning("shard", batches.parse_shard, shard)
        plan = None
        if source is not None:
            share = meaning("check_in_mujoco", batches.parse_share, check_in_mujoco)
            plan = batches.make_plan(
                source, settings(set_), system=system, starts=starts,
                sweeps=[_sweep(text) for text in sweeps or []], seed=seed, spread=spread,
                chunk=chunk, check_in_mujoco=share,
                record=meaning("record", batches.parse_record, record),
            )  # fmt: skip
        store = _opened(plan, folder, resume, part)
        with telling(PREPARING, quiet=as_json) as tell:
            words = batches.ahead(store.plan, threads, cluster)
            now = batches.execute(
                store, threads=threads, cluster=client, shard=part, stopped=stop.is_set,
                progress=batches.of_runs(tell, words, quiet=as_json),
            )  # fmt: skip
        _tell(store, now, as_json, part)
    if not now.complete and not as_json:
        print(f"\nstopped: {_partial(store, now)}")
    raise typer.Exit(1 if not now.complete or (fail_on_exit and now.ended_early) else 0)


def _opened(plan: "Plan | None", folder: Path, resume: bool, shard: "Shard | None") -> "Store":
    """The store of a plan, or of a batch that goes on with the plan that it has."""
    from gne_mj.batches import Store
    from gne_mj.errors import InvalidInput, named

    if plan is None:
        if not resume:
            raise InvalidInput("source", None, "a scenario must be named, or `resume`")
        return Store.continued(folder)
    if shard is not None:
        with named(plan=""):
            return Store.begun(folder, plan)
    if folder.exists() and not resume:
        raise InvalidInput(
            "folder",
            str(folder),
            "it exists already; name a folder that does not, or add `resume` to go on with it",
        )
    with named(plan=""):
        begin = Store.resume if folder.exists() else Store.create
        return begin(folder, plan)


def _tell(store: "Store", now: "Progress", as_json: bool, shard: "Shard | None") -> None:
    """What a batch that ended has done, with its tables and figure if there is anything.

    The last one of its shards tells of it all, the others of themselves.
    """
    from gne_mj.batches import Progress
    from gne_mj.batches.report import write_report

    if shard is not None:
        whole = Progress.of(store)
        if not whole.complete:
            if as_json:
                emit(json.dumps({"shard": str(shard), **_counts(now)}))
            else:
                print(
                    f"shard {shard}: {now.done:,} of its {now.total:,} runs are stored,"
                    f" of the batch {whole.done:,} of {whole.total:,}"
                )
            return
        now = whole
    if now.done:
        _print(store, now, write_report(store, store.folder, replace=True), as_json)
    elif as_json:
        emit(json.dumps({**_counts(now), "statuses": {}, "combinations": []}))


@app.command(name="batch-report")
def batch_report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that `batch` wrote.")],
    out: WHERE = None,
    format_: FORMAT = None,
    as_json: JSON = False,
    replace: REPLACE = False,
) -> None:
    """Write a batch's tables (CSV) and its figure, whether it is complete or not.

    In the batch's own folder they take the place of older ones.
    """
    from gne_mj.batches import Progress, Store
    from gne_mj.batches.report import write_report
    from gne_mj.errors import named
    from gne_mj.extras import need

    need("plots", "a batch's figure")
    kinds = formats(format_)
    store = Store.open(folder)
    now, target = Progress.of(store), folder_for(out, folder)
    with named(store="folder", target="out"):
        report = write_report(store, target, kinds, replace=replace or target == folder)
    _print(store, now, report, as_json)
    if not now.complete and not as_json:
        print(f"\npartial: {_partial(store, now)}")


def _sweep(text: str) -> "Sweep":
    """What --sweep says; errors tell of which key."""
    from gne_mj.batches import parse_sweep

    key, equals, _ = text.partition("=")
    return meaning(f"sweeps {key}" if equals else "sweeps", parse_sweep, text)


def _counts(now: "Progress") -> dict[str, Any]:
    return {"runs": now.total, "done": now.done, "complete": now.complete}


def _partial(store: "Store", now: "Progress") -> str:
    return (
        f"{now.done:,} of {now.total:,} runs are stored; go on with"
        f" `gne-mj batch --resume --out {store.folder}`"
    )


def _print(store: "Store", now: "Progress", report: "Report", as_json: bool) -> None:
    from gne_mj.batches.report import checked, summary

    if as_json:
        statuses = report.runs["status"].to_series().value_counts()
        words: dict[str, Any] = {
            **_counts(now),
            "statuses": {str(name): int(count) for name, count in statuses.items()},
            **({"check_in_mujoco": report.check} if report.check else {}),
            "combinations": json.loads(report.table.to_json(orient="records")),
        }
        emit(json.dumps(words, indent=2))
        return
    print("\n".join(summary(report.table, list(report.runs.attrs["swept"]))))
    if report.check:
        print(f"\n{checked(report.check)}")
    print(f"\nruns        {store.folder / 'runs.zarr'}")
    for path in report.paths:
        print(f"{'figure' if path.stem == 'summary' else 'table':11} {path}")
