"""Run a store's missing chunks, here or on a Dask cluster."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from gne_mj.batches.chunk import Runner
from gne_mj.batches.cluster import on_cluster
from gne_mj.batches.plan import Plan
from gne_mj.batches.progress import Progress, count_early
from gne_mj.batches.shard import Shard
from gne_mj.batches.store import Store
from gne_mj.bounds import check_count
from gne_mj.cores import cores
from gne_mj.errors import InvalidInput

if TYPE_CHECKING:
    from distributed import Client

MOST_THREADS = 1024


def ahead(plan: Plan, threads: int, cluster: str | None) -> str:
    """What a batch's runs are, in words: how long, and where they are computed."""
    threads = threads or cores()
    where = f"the cluster at {cluster}" if cluster else f"{threads} processor{'s' * (threads > 1)}"
    return f"runs of {plan.duration:g} s on {where}"


def execute(
    store: Store,
    *,
    threads: int = 0,
    cluster: "Client | None" = None,
    shard: Shard | None = None,
    progress: Callable[[Progress], None] | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> Progress:
    """Run what is missing; what is stored stays if this is stopped, killed or fails.

    Args:
        store: of the batch.
        threads: native threads of this process; 0 for one a processor.
        cluster: a Dask client (:func:`gne_mj.batches.cluster.connected`) whose workers run the
            chunks, and see the folder under the same path.
        shard: run these chunks only, beside other processes that run others; not on a cluster.
        progress: called after each chunk; with a cluster several times a minute at least.
        stopped: says whether to end early; asked several times a second.

    Raises:
        InvalidInput: threads that are negative, a shard on a cluster, or another process that runs
            this batch.
        StorageError: a chunk could not be written.
        UserCodeError: a function of the user's own failed.
        ClusterError: the scheduler no longer answers, or its workers end.
    """
    if threads < 0:
        raise InvalidInput("threads", threads, "it must not be negative")
    check_count("threads", threads, MOST_THREADS)
    if shard is not None and cluster is not None:
        raise InvalidInput("shard", str(shard), "a cluster hands out the chunks itself")
    now = Progress.of(store, shard)

    def tell(done: int, early: int, workers: int | None = None) -> Progress:
        after = Progress(now.done + done, now.total, now.ended_early + early, workers)
        if progress is not None:
            progress(after)
        return after

    now = tell(0, 0)
    with store.locked(alone=shard is None):
        if cluster is not None:
            for finished in on_cluster(store, cluster, stopped):
                now = tell(*finished)
            return Progress.of(store)
        runner = Runner(store.plan, threads or cores())
        for chunk in (each for each in store.missing() if shard is None or shard.has(each)):
            variables = None if stopped() else runner.run(chunk, stopped)
            if variables is None:
                break
            store.write(chunk, variables)
            now = tell(len(variables["status"][1]), count_early(variables["status"][1]))
    return now
