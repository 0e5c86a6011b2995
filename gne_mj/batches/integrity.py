"""Whether all is there, and undamaged, of what a batch has stored."""

from collections.abc import Hashable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gne_mj import chunks
from gne_mj.errors import InvalidInput

AGAIN = "`gne-mj batch --resume --out {}` runs again what it was of"


def broken(folder: Path, what: str) -> InvalidInput:
    """The error that tells of a batch that is not whole."""
    return InvalidInput("folder", str(folder), f"it must be whole: {what}")


def read_statuses(folder: Path, store: Path) -> NDArray[np.str_]:
    """(runs,) statuses as they are stored; empty of runs that have not been run.

    Raises:
        InvalidInput: they, or the store's metadata, are damaged.
    """
    import zarr

    with reading(folder, store, ["status"]):
        lost = chunks.disagreement(store)
        if lost is None:
            array: Any = zarr.open_array(store, path="status", mode="r")
            found: NDArray[np.str_] = array[:]
            return found
    raise broken(folder, f"{store.name}/{lost} is missing or damaged")


def kept_of_runs(store: Path) -> dict[str, tuple[tuple[Hashable, ...], tuple[int, ...]]]:
    """Dimensions and shapes of what runs leave, by name, but not of what says which runs they are.

    Some have the name of a dimension, and are coordinates to xarray: constraints over time.
    """
    import xarray

    with xarray.open_dataset(store, engine="zarr", chunks=None) as dataset:
        return {
            str(name): (each.dims, each.shape)
            for name, each in dataset.variables.items()
            if each.dims[:1] == ("run",) and (name not in dataset.coords or each.ndim > 1)
        }


def lost_chunks(folder: Path, store: Path, ran: NDArray[np.bool_]) -> dict[int, str]:
    """Chunks that were stored and of which something is missing now, each with a file of these.

    Args:
        folder: of the batch.
        store: its dataset.
        ran: (chunks,) which chunks were stored.

    Raises:
        InvalidInput: what is missing is not of runs.
    """
    with reading(folder, store, ()):
        variables = kept_of_runs(store)
    found: dict[int, str] = {}
    for file in chunks.missing(store, lambda name, chunk: name not in variables or ran[chunk]):
        name, _, place = file.rpartition("/")
        if name not in variables:
            raise broken(folder, f"{store.name}/{file} is missing")
        found.setdefault(int(place.partition(".")[0]), file)
    return found


@contextmanager
def reading(folder: Path, store: Path, names: Iterable[str]) -> Iterator[None]:
    """Say in one sentence which file is damaged, where one of these arrays cannot be read."""
    try:
        yield
    except chunks.UNREADABLE as error:
        lost = None
        with suppress(*chunks.UNREADABLE):
            lost = next(chunks.damaged(store, names), None)
        if lost is None:
            raise broken(folder, f"{store.name} cannot be read ({error})") from None
        remedy = ""
        if lost.rpartition("/")[0] in kept_of_runs(store):
            remedy = f"; delete that file, and {AGAIN.format(folder)}"
        raise broken(folder, f"{store.name}/{lost} is damaged{remedy}") from None
