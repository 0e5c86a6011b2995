"""Run a store's missing chunks, here or on a Dask cluster."""

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from gne_mj.batches.chunk import Runner
from gne_mj.batches.plan import Plan
from gne_mj.batches.store import Store
from gne_mj.errors import InvalidInput

RETRIES = 5  # of a chunk whose worker was lost


@dataclass(frozen=True)
class Progress:
    """How far a batch is.

    Attributes:
        done: runs that are stored.
        total: of the batch.
        left: of those done, how many did not stay inside their set to the end.
    """

    done: int
    total: int
    left: int

    @classmethod
    def of(cls, store: Store) -> "Progress":
        """Of what is stored."""
        statuses = store.statuses()
        return cls(int(np.sum(statuses != "")), store.plan.runs, _count_left(statuses))


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def execute(
    store: Store,
    *,
    threads: int = 0,
    cluster: str | None = None,
    progress: Callable[[Progress], None] | None = None,
    stopped: Callable[[], bool] = lambda: False,
) -> Progress:
    """Run what is missing; what is stored stays if this is stopped, killed or fails.

    Args:
        store: of the batch.
        threads: native threads of this process; 0 for one a processor.
        cluster: address of a Dask scheduler whose workers run the chunks, and see the folder
            under the same path.
        progress: called after each chunk.
        stopped: says whether to end early; asked several times a second.

    Raises:
        StorageError: a chunk could not be written.
        UserCodeError: a function of the user's own failed.
    """
    now = Progress.of(store)

    def tell(done: int, left: int) -> Progress:
        after = Progress(now.done + done, now.total, now.left + left)
        if progress is not None:
            progress(after)
        return after

    now = tell(0, 0)
    with store.locked():
        if cluster is not None:
            for done, left in _on_cluster(store, cluster, stopped):
                now = tell(done, left)
            return now
        runner = Runner(store.plan, threads or cores())
        for chunk in store.missing():
            variables = None if stopped() else runner.run(chunk, stopped)
            if variables is None:
                break
            store.write(chunk, variables)
            now = tell(len(variables["status"][1]), _count_left(variables["status"][1]))
    return now


def _count_left(statuses: np.ndarray) -> int:
    stayed = np.isin(statuses, ["", "converged", "completed"])
    return int(np.sum(~stayed))


def _on_cluster(store: Store, address: str, stopped: Callable[[], bool]) -> Any:
    """(runs, runs that left) of each chunk, as the workers finish them."""
    try:
        from distributed import Client, wait
    except ImportError:
        raise InvalidInput(
            "--cluster", address, "it needs Dask: pip install 'gne-mj[cluster]'"
        ) from None
    try:
        client = Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise InvalidInput("--cluster", address, f"no scheduler answers there: {error}") from None
    with client:
        manifest = store.plan.manifest()
        futures = [
            client.submit(
                run_chunk, str(store.folder.resolve()), manifest, chunk, pure=False,
                retries=RETRIES, key=f"gne-mj-{store.folder.name}-{chunk}-{os.getpid()}",
            )
            for chunk in store.missing()
        ]  # fmt: skip
        waiting = set(futures)
        while waiting and not stopped():
            try:
                finished, waiting = wait(waiting, timeout=0.5, return_when="FIRST_COMPLETED")
            except TimeoutError:
                continue
            for future in finished:
                yield future.result()
        client.cancel(list(waiting))


def run_chunk(folder: str, manifest: dict[str, Any], chunk: int) -> tuple[int, int]:
    """Run and store one chunk, on a worker of a cluster; the runs, and how many of them left."""
    store = Store.open(Path(folder))
    here = store.plan.manifest()
    if here != manifest:
        raise InvalidInput("cluster", folder, "a worker's versions or files differ from yours")
    variables = _runner(folder).run(chunk)
    assert variables is not None
    store.write(chunk, variables)
    statuses = variables["status"][1]
    return len(statuses), _count_left(statuses)


@lru_cache(maxsize=1)
def _runner(folder: str) -> Runner:
    plan: Plan = Store.open(Path(folder)).plan
    return Runner(plan, 1)
