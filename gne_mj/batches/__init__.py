"""Many runs of a scenario: swept values times random starts, stored as one dataset."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gne_mj.batches.cluster import connected
from gne_mj.batches.execute import execute
from gne_mj.batches.plan import Plan, make_plan
from gne_mj.batches.progress import Progress
from gne_mj.batches.store import Store
from gne_mj.batches.sweep import Sweep, parse_sweep

if TYPE_CHECKING:
    import xarray

__all__ = [
    "Plan",
    "Progress",
    "Store",
    "Sweep",
    "connected",
    "execute",
    "make_plan",
    "open_batch",
    "parse_sweep",
    "run_batch",
]


def run_batch(
    source: str | Path | Mapping[str, Any],
    sweep: Mapping[str, Sequence[Any]] | None = None,
    *,
    out: str | Path,
    changes: Mapping[str, Any] | None = None,
    resume: bool = False,
    threads: int = 0,
    cluster: str | None = None,
    progress: Callable[[Progress], None] | None = None,
    **options: Any,
) -> "xarray.Dataset":
    """Run all combinations of swept values from random starts; returns the dataset, read lazily.

    >>> import gne_mj
    >>> runs = gne_mj.run_batch("velocity-sync", {"barrier.rho": [0.01, 0.1, 1]}, starts=100,
    ...                         out="results/rho")
    >>> runs["least_margin"].groupby("barrier.rho").min().values

    Args:
        source, changes: see :func:`gne_mj.load_scenario`.
        sweep: dotted keys, each with its values.
        out: folder to write.
        resume: go on with what an earlier call has begun there, if there is such a folder.
        threads: native threads; 0 for one a processor.
        cluster: address of a Dask scheduler to run on.
        progress: called after each chunk.
        options: system, starts, seed, spread, record, chunk; see :class:`Plan`.

    Raises:
        InvalidInput: names the key, the value and what would be right.
        StorageError: results could not be written; what was stored before is readable.
    """
    sweeps = [Sweep(key, tuple(_plain(v) for v in values)) for key, values in (sweep or {}).items()]
    plan = make_plan(source, changes, sweeps=sweeps, **options)
    folder = Path(out)
    goes_on = resume and folder.exists()
    with connected(cluster) as client:
        store = Store.resume(folder, plan) if goes_on else Store.create(folder, plan)
        execute(store, threads=threads, cluster=client, progress=progress)
    return store.dataset()


def open_batch(folder: str | Path) -> "xarray.Dataset":
    """The dataset of a batch's folder, read lazily; runs that are missing are not numbers."""
    return Store.open(Path(folder)).dataset()


def _plain(value: Any) -> Any:
    """A NumPy scalar as a number of Python's, which a manifest can hold."""
    return value.item() if hasattr(value, "item") else value
