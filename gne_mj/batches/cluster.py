"""Chunks of a batch on the workers of an existing Dask scheduler, each writing its own."""

import json
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from gne_mj.batches.chunk import Runner
from gne_mj.batches.plan import Plan
from gne_mj.batches.progress import count_early
from gne_mj.batches.store import Store
from gne_mj.errors import InvalidInput

if TYPE_CHECKING:
    from distributed import Client

RETRIES = 5  # of a chunk that failed; one whose worker was lost is run elsewhere besides
PATIENCE = "10s"  # for a scheduler to answer


@contextmanager
def connected(address: str | None) -> Iterator["Client | None"]:
    """A client of the scheduler at an address; none without one.

    Raises:
        InvalidInput: Dask is not installed, or no scheduler answers.
    """
    if address is None:
        yield None
        return
    try:
        from distributed import Client
        from distributed.comm import get_address_host_port
    except ImportError:
        raise InvalidInput(
            "--cluster", address, "it needs Dask: pip install 'gne-mj[cluster]'"
        ) from None
    try:
        get_address_host_port(address)
    except (ValueError, TypeError):
        raise InvalidInput("--cluster", address, "it must read tcp://HOST:PORT") from None
    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise InvalidInput("--cluster", address, f"no scheduler answers there: {reason}") from None
    with client:
        yield client


def on_cluster(
    store: Store, client: "Client", stopped: Callable[[], bool]
) -> Iterator[tuple[int, int]]:
    """Run what is missing; of each chunk its runs, and how many of them ended early."""
    from distributed import wait

    folder, manifest = str(store.folder.resolve()), json.dumps(store.plan.manifest())
    batch = uuid.uuid4().hex  # a key must not be another batch's
    futures = [
        client.submit(
            run_chunk, folder, manifest, chunk, pure=False, retries=RETRIES,
            key=f"gne-mj-{batch}-{chunk}",
        )
        for chunk in store.missing()
    ]  # fmt: skip
    waiting = set(futures)
    with client.as_current():
        while waiting and not stopped():
            try:
                finished, waiting = wait(waiting, timeout=0.5, return_when="FIRST_COMPLETED")
            except TimeoutError:
                continue
            for future in finished:
                yield future.result()
        client.cancel(list(waiting))


def run_chunk(folder: str, manifest: str, chunk: int) -> tuple[int, int]:
    """On a worker: run and store one chunk; its runs, and how many of them ended early.

    Raises:
        InvalidInput: the worker does not see the folder, or has other versions or files.
    """
    store = Store.open(Path(folder))
    if json.dumps(store.plan.manifest()) != manifest:
        raise InvalidInput(
            "--cluster", folder, "a worker's versions or files differ from those here"
        )
    variables = _runner(manifest).run(chunk)
    assert variables is not None
    store.write(chunk, variables)
    statuses = variables["status"][1]
    return len(statuses), count_early(statuses)


@lru_cache(maxsize=1)
def _runner(manifest: str) -> Runner:
    # one thread: it is the scheduler that says how much a worker does at once
    return Runner(Plan.from_manifest(json.loads(manifest)), 1)
