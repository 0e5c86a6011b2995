"""How far a batch is."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gne_mj.batches.store import Store
from gne_mj.verdicts import SUCCESSES


@dataclass(frozen=True)
class Progress:
    """How far a batch is.

    Attributes:
        done: runs that are stored.
        total: of the batch.
        left: of those done, how many did not stay inside their set to the end.
        workers: that a cluster has; None without one.
    """

    done: int
    total: int
    left: int
    workers: int | None = None

    @classmethod
    def of(cls, store: Store) -> "Progress":
        """Of what is stored."""
        statuses = store.statuses()
        return cls(int(np.sum(statuses != "")), store.plan.runs, count_left(statuses))


def count_left(statuses: NDArray[np.str_]) -> int:
    """How many of these runs did not stay inside to the end; those not run yet do not count."""
    return int(np.sum(~np.isin(statuses, ["", *SUCCESSES])))
