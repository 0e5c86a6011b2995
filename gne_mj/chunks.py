"""Zarr stores that show what is missing or damaged in them.

Every chunk is written, also one that holds no number at all, so that a file that is not there was
lost; and each carries a checksum of its own, Zstandard's, which every reader checks. Metadata are
written twice by Zarr, in each array's folder and consolidated, and must agree. Stores written
without checksums are read as they are.
"""

import json
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import xarray

METADATA = ".zmetadata"

# What xarray, Zarr and numcodecs raise for a folder that is no store, or a damaged one
UNREADABLE = (AttributeError, LookupError, OSError, RuntimeError, TypeError, ValueError)


def compressor() -> Any:
    """What compresses a chunk and adds its checksum."""
    from numcodecs import Zstd

    return Zstd(level=0, checksum=True)


def encodings(dataset: "xarray.Dataset") -> dict[str, dict[str, Any]]:
    """For xarray: all variables of a dataset compressed so."""
    return {str(name): {"compressors": compressor()} for name in dataset.variables}


@contextmanager
def every_chunk() -> Iterator[None]:
    """Within this every chunk is written, and none left out for holding nothing but its fill.

    Zarr writes files beside each other, and one that fails does not stop the others. They have
    ended when this does, so that whoever removes the folder then has removed all.
    """
    import zarr
    from zarr.core.sync import sync

    with zarr.config.set({"array.write_empty_chunks": True}):
        try:
            yield
        except BaseException:
            sync(_others_end())
            raise


async def _others_end() -> None:
    import asyncio  # slow to load, and for what writes only

    others = asyncio.all_tasks() - {asyncio.current_task()}
    await asyncio.gather(*others, return_exceptions=True)


def disagreement(store: Path) -> str | None:
    """A file of metadata that is missing or differs from the consolidated ones, if any."""
    for name, content in _metadata(store).items():
        content.pop("consolidated_metadata", None)  # of a group, which has it here only
        try:
            own = json.loads((store / name).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return name
        if json.dumps(own, sort_keys=True) != json.dumps(content, sort_keys=True):
            return name
    return None


def missing(store: Path, needed: Callable[[str, int], bool] = lambda *_: True) -> Iterator[str]:
    """Files of chunks that are not there.

    Args:
        store: its folder.
        needed: of an array's name and a chunk's number along the first dimension: whether that has
            been written.
    """
    for name, header in _arrays(store):
        counts = [
            -(-length // size)
            for length, size in zip(header["shape"], header["chunks"], strict=True)
        ]
        found = {path.name for path in (store / name).glob("*")}
        for place in product(*(range(number) for number in counts)):
            file = header.get("dimension_separator", ".").join(map(str, place)) or "0"
            if file not in found and needed(name, place[0] if place else 0):
                yield f"{name}/{file}"


def damaged(store: Path, names: Iterable[str] | None = None) -> Iterator[str]:
    """Files of chunks that do not agree with their checksums, of these arrays or of all."""
    from numcodecs import get_codec

    wanted = None if names is None else set(names)
    for name, header in _arrays(store):
        if wanted is None or name in wanted:
            codec = get_codec(dict(header["compressor"]))
            for path in sorted((store / name).glob("[0-9]*")):
                try:
                    codec.decode(path.read_bytes())
                except (OSError, RuntimeError, ValueError):
                    yield f"{name}/{path.name}"


def _metadata(store: Path) -> dict[str, Any]:
    content = json.loads((store / METADATA).read_text(encoding="utf-8"))
    found: dict[str, Any] = content["metadata"]
    return found


def _arrays(store: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Arrays whose chunks have checksums: name within the store, and header."""
    for name, header in _metadata(store).items():
        if name.endswith("/.zarray") and (header["compressor"] or {}).get("checksum"):
            yield name.removesuffix("/.zarray"), header
