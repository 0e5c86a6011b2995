"""Many runs of a scenario: swept values times random starts, stored as one dataset."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gne_mj.arguments import answering
from gne_mj.batches.cluster import connected
from gne_mj.batches.execute import ahead, execute
from gne_mj.batches.options import parse_record, parse_share
from gne_mj.batches.plan import Plan, make_plan
from gne_mj.batches.progress import Progress, of_runs
from gne_mj.batches.shard import Shard, parse_shard
from gne_mj.batches.store import Store
from gne_mj.batches.sweep import Sweep, parse_sweep
from gne_mj.errors import named
from gne_mj.progress import if_asked

if TYPE_CHECKING:
    import xarray

__all__ = [
    "Plan",
    "Progress",
    "Shard",
    "Store",
    "Sweep",
    "ahead",
    "connected",
    "execute",
    "make_plan",
    "of_runs",
    "open_batch",
    "parse_record",
    "parse_shard",
    "parse_share",
    "parse_sweep",
    "run_batch",
]


@answering
def run_batch(
    source: str | Path | Mapping[str, Any],
    sweep: Mapping[str, Sequence[Any]] | None = None,
    *,
    out: str | Path,
    runs: int = 0,
    changes: Mapping[str, Any] | None = None,
    system: str | None = None,
    record: str | int = "summaries",
    seed: int = 0,
    spread: float = 0.9,
    chunk: int = 0,
    check_in_mujoco: float | str = 0.0,
    threads: int = 0,
    resume: bool = False,
    cluster: str | None = None,
    progress: Callable[[Progress], None] | bool = False,
) -> xarray.Dataset:
    """Run all combinations of swept values from random starts; returns the dataset, read lazily.

    >>> import gne_mj
    >>> sweep = {"barrier.rho": [0.01, 0.1, 1]}
    >>> runs = gne_mj.batch("velocity-sync", sweep, runs=100, out="results/rho")

    Args:
        source: see :func:`gne_mj.load_scenario`.
        sweep: dotted keys, each with its values.
        out: folder to write.
        runs: random interior starts of each combination; 0 for the scenario's own start.
        changes: dotted keys to new values.
        system: which; may be left out if there is only one.
        record: "summaries", "all" samples too, or every so many-th of them.
        seed: from which all starts' seeds follow.
        spread: how far towards the boundary random starts lie, between 0 and 1.
        chunk: runs that are stored together; chosen if 0.
        check_in_mujoco: the share of runs, on engine "ode", that are made in MuJoCo too, as 0.01 or
            "1%"; the seed says which, and the dataset has how far each is from its twin.
        threads: native threads; 0 for one a processor.
        resume: go on with what an earlier call has begun there, if any.
        cluster: address of a Dask scheduler to run on.
        progress: True to tell on stderr how far it is; or what is called after each chunk.

    Raises:
        InvalidInput: names the key, the value and what would be right.
        StorageError: results could not be written; what was stored before is readable.
        ClusterError: the cluster's scheduler no longer answers; likewise.
    """
    own = named(starts="runs", sweeps="sweep", given="record", folder="out", address="cluster")
    with own, named(plan=""):
        more: dict[str, Any] = {"seed": seed, "spread": spread, "record": parse_record(record)}
        more |= {"chunk": chunk, "check_in_mujoco": _share(check_in_mujoco)}
        more |= {"sweeps": _sweeps(sweep or {}), "starts": runs, "system": system}
        plan = make_plan(source, changes, **more)
        with connected(cluster) as client, if_asked(progress) as tell:
            begin = Store.resume if resume and Path(out).exists() else Store.create
            store = begin(Path(out), plan)
            shown = of_runs(tell, ahead(plan, threads, cluster), quiet=not progress)
            told = progress if callable(progress) else shown
            execute(store, threads=threads, cluster=client, progress=told)
        return store.dataset()


def _share(given: float | str) -> float:
    with named(given="check_in_mujoco"):
        return parse_share(given)


def _sweeps(given: Mapping[str, Sequence[Any]]) -> list[Sweep]:
    sweeps = []
    for key, values in given.items():
        with named(values=f"sweep.{key}"):
            sweeps.append(Sweep(key, values))  # type: ignore[arg-type]
    return sweeps


def open_batch(folder: str | Path) -> xarray.Dataset:
    """The dataset of a batch's folder, read lazily; runs that are missing are not numbers."""
    return Store.open(Path(folder)).dataset()
