"""A part of a batch for a process of its own, where there is no scheduler to hand out chunks."""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gne_mj.batches.plan import Plan
from gne_mj.errors import InvalidInput

MOST_SHARDS = 100_000


@dataclass(frozen=True)
class Shard:
    """Every so many-th chunk of a batch.

    Attributes:
        number: which, from 1.
        count: how many there are.
    """

    number: int
    count: int

    def has(self, chunk: int) -> bool:
        """Whether a chunk is in it."""
        return chunk % self.count == self.number - 1

    def runs(self, plan: Plan) -> NDArray[np.bool_]:
        """(runs,) which runs of a batch are in it."""
        chunks: NDArray[np.int64] = np.arange(plan.runs) // plan.chunk
        return np.asarray(chunks % self.count == self.number - 1)

    def __str__(self) -> str:
        return f"{self.number}/{self.count}"


def parse_shard(text: str) -> Shard:
    """A shard from "3/8", the third of eight.

    Raises:
        InvalidInput: it is not of that form.
    """
    parts = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text)
    found = Shard(int(parts[1]), int(parts[2])) if parts else Shard(0, 0)
    if not 1 <= found.number <= found.count <= MOST_SHARDS:
        raise InvalidInput(
            "text", text, f"it must be as '3/8', the third of eight; at most {MOST_SHARDS:,}"
        )
    return found
