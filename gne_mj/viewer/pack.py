"""The one container in which numbers reach the page: a JSON header and arrays behind it.

Bytes: ``GNE1``, the header's length (unsigned 32 bits, little-endian), the header, zeros up to a
multiple of 8, the arrays' data. The header is ``{"meta": ..., "arrays": [...]}``; each array has a
name, dtype, shape and offset into the data. A shuffled array is column after column (over its first
index), and of all its entries in this order the first bytes come first, then all second ones and so
on, which compresses to a fraction for data that are smooth in time. Meshcat's own messages never
begin with a "G".
"""

import json
import math
import sys
import zlib
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAGIC = b"GNE1"
LITTLE = sys.byteorder == "little"
encoded = json.JSONEncoder(allow_nan=False).encode
_DTYPES = {"f8": "<f8", "f4": "<f4", "i4": "<i4", "u1": "u1"}


def pack(meta: Mapping[str, Any] | str, arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """One message of the live page.

    Args:
        meta: what JSON can hold, or its text (:func:`encoded`); numbers must be finite.
        arrays: of float64, float32, int32 or uint8, by name.
    """
    return _pack(meta, arrays, shuffled=False)


def packed_small(meta: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> bytes:
    """The same, shuffled and compressed (zlib), for a replay."""
    return zlib.compress(_pack(meta, arrays, shuffled=True), 9)


def unpack(data: bytes) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Meta and arrays of a pack, or of a compressed one."""
    if not data.startswith(MAGIC):
        data = zlib.decompress(data)
    length = int.from_bytes(data[4:8], "little")
    header = json.loads(data[8 : 8 + length])
    start = _aligned(8 + length)
    arrays = {}
    for entry in header["arrays"]:
        kind = np.dtype(_DTYPES[entry["dtype"]])
        count = int(np.prod(entry["shape"], dtype=np.int64))
        first = start + entry["offset"]
        raw = np.frombuffer(data, dtype=np.uint8, count=count * kind.itemsize, offset=first)
        shape = entry["shape"]
        if entry["shuffled"]:
            raw = raw.reshape(kind.itemsize, _columns(shape), -1).T.reshape(-1)
        arrays[entry["name"]] = raw.view(kind).reshape(shape)
    return header["meta"], arrays


def _pack(
    meta: Mapping[str, Any] | str, arrays: Mapping[str, NDArray[Any]], shuffled: bool
) -> bytes:
    kinds = tuple([(name, array.dtype, array.shape) for name, array in arrays.items()])
    about, ends = _about(kinds, shuffled)
    header = f'{{"meta": {meta if isinstance(meta, str) else encoded(meta)}, {about}}}'.encode()
    head = MAGIC + len(header).to_bytes(4, "little") + header
    parts = [head, bytes(-len(head) % 8)]
    for array, end in zip(arrays.values(), ends, strict=True):
        piece = (array if LITTLE else array.astype(array.dtype.newbyteorder("<"))).tobytes()
        if shuffled and array.dtype.itemsize > 1:
            of_entries = np.frombuffer(piece, dtype=np.uint8)
            columns = _columns(array.shape)
            piece = of_entries.reshape(-1, columns, array.dtype.itemsize).T.tobytes()
        parts += (piece, end)
    return b"".join(parts)


@lru_cache(maxsize=64)
def _about(
    kinds: tuple[tuple[str, np.dtype[Any], tuple[int, ...]], ...], shuffled: bool
) -> tuple[str, list[bytes]]:
    """What the header says of arrays, and the zeros behind each; frames ask for the same."""
    entries, ends, offset = [], [], 0
    for name, dtype, shape in kinds:
        size, code = dtype.itemsize * math.prod(shape), f"{dtype.kind}{dtype.itemsize}"
        if code not in _DTYPES:
            raise TypeError(f"{name} is of {dtype}")
        mixed = shuffled and dtype.itemsize > 1
        entries.append(
            {"name": name, "dtype": code, "shape": shape, "offset": offset, "shuffled": mixed}
        )
        ends.append(bytes(-size % 8))
        offset += size + len(ends[-1])
    return f'"arrays": {encoded(entries)}', ends


def _columns(shape: Sequence[int]) -> int:
    """Entries of a row, or 1 where there are none."""
    return max(math.prod(shape[1:]), 1)


def _aligned(length: int) -> int:
    return -(-length // 8) * 8
