"""How far a batch is."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gne_mj.batches.shard import Shard
from gne_mj.batches.store import Store
from gne_mj.progress import Tell, say
from gne_mj.run_metrics import SUCCESSES


@dataclass(frozen=True)
class Progress:
    """How far a batch is.

    Attributes:
        done: runs that are stored.
        total: of the batch, or of a shard of it.
        ended_early: of those done, how many did not run to their end inside their set.
        workers: that a cluster has; None without one.
    """

    done: int
    total: int
    ended_early: int
    workers: int | None = None

    @property
    def complete(self) -> bool:
        """Whether all runs are stored."""
        return self.done == self.total

    @classmethod
    def of(cls, store: Store, shard: Shard | None = None) -> "Progress":
        """Of what is stored; of a shard of it, if one is given."""
        statuses = store.statuses()
        if shard is not None:
            statuses = statuses[shard.runs(store.plan)]
        return cls(int(np.sum(statuses != "")), len(statuses), count_early(statuses))


def count_early(statuses: NDArray[np.str_]) -> int:
    """How many of these runs ended early, or could not begin; those not run yet do not count."""
    return int(np.sum(~np.isin(statuses, ["", *SUCCESSES])))


def of_runs(tell: Tell, ahead: str, *, quiet: bool = False) -> Callable[[Progress], None]:
    """What a batch calls with its progress, to tell it.

    Args:
        tell: of :func:`gne_mj.progress.telling`.
        ahead: what the runs are, see :func:`gne_mj.batches.execute.ahead`.
        quiet: do not say when a cluster begins to have no workers.
    """
    begun = lonely = False

    def note(now: Progress) -> None:
        nonlocal begun, lonely
        if now.workers == 0 and not (lonely or quiet):
            say("gne-mj: waiting: the cluster has no workers (Ctrl-C ends)")
        lonely = now.workers == 0
        words = f"{now.done} of {now.total} runs, {now.ended_early} ended early"
        tell(now.done, now.total, words if begun else f"{now.total - now.done} {ahead}")
        begun = True

    return note
