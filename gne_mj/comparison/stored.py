"""Batches of one law: runs from random starts around the middle of the set, kept in a folder."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gne_mj.batches import Store, Sweep, execute, make_plan
from gne_mj.batches.plan import MIDDLE

if TYPE_CHECKING:
    import xarray


def batch(
    tables: Mapping[str, Any],
    folder: Path,
    sweep: Mapping[str, Sequence[float]],
    *,
    threads: int,
    **options: Any,
) -> "xarray.Dataset":
    """Run what is missing of a batch; returns the dataset, read lazily.

    Args:
        tables: a scenario with one system.
        folder: of the batch; what an earlier one of the same plan has stored is not run again.
        sweep: dotted keys, each with its values.
        threads: native threads; 0 for one a processor.
        **options: as of :class:`gne_mj.batches.Plan`.
    """
    sweeps = [Sweep(key, tuple(values)) for key, values in sweep.items()]
    plan = make_plan(tables, sweeps=sweeps, about=MIDDLE, **options)
    begin = Store.resume if folder.exists() else Store.create
    store = begin(folder, plan)
    execute(store, threads=threads)
    return store.dataset()
