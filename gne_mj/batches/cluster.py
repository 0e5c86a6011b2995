"""Chunks of a batch on the workers of an existing Dask scheduler, each writing its own."""

import json
import logging
import uuid
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from gne_mj.batches.chunk import Runner
from gne_mj.batches.plan import Plan
from gne_mj.batches.progress import count_early
from gne_mj.batches.store import Store
from gne_mj.errors import ClusterError, InvalidInput

if TYPE_CHECKING:
    from distributed import Client

RETRIES = 5  # of a chunk that failed; one whose worker was lost is run elsewhere besides
PATIENCE = 10.0  # s for a scheduler to answer
POLL = 0.5  # s between looks at the user's wishes


class Finished(NamedTuple):
    """What has happened on a cluster since the last look.

    Attributes:
        runs: that were stored.
        early: how many of them ended early.
        workers: that the scheduler has now.
    """

    runs: int
    early: int
    workers: int


@contextmanager
def connected(address: str | None) -> Iterator["Client | None"]:
    """A client of the scheduler at an address; none without one. Dask's own log is silent.

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
            "address", address, "it needs Dask: pip install 'gne-mj[cluster]'"
        ) from None
    try:
        get_address_host_port(address)
    except (ValueError, TypeError):
        raise InvalidInput("address", address, "it must read tcp://HOST:PORT") from None
    with _silent():
        try:
            client = Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError) as error:
            reason = " ".join(str(error).split())
            raise InvalidInput(
                "address", address, f"no scheduler answers there: {reason}"
            ) from None
        with client:
            yield client


@contextmanager
def _silent() -> Iterator[None]:
    """Keep Dask's log quiet: what it would tell in pages is told in a sentence."""
    names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    before = {name: logging.getLogger(name).level for name in names}
    for name in names:
        logging.getLogger(name).setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


def on_cluster(store: Store, client: "Client", stopped: Callable[[], bool]) -> Iterator[Finished]:
    """Run what is missing; says now and then what workers have finished.

    Raises:
        ClusterError: the scheduler no longer answers, or a chunk ended several workers.
    """
    from distributed import wait
    from distributed.scheduler import KilledWorker

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
    try:
        with client.as_current():
            while waiting and not stopped():
                try:
                    finished, waiting = wait(waiting, timeout=POLL, return_when="FIRST_COMPLETED")
                except TimeoutError:
                    finished = set()
                done = [future.result() for future in finished]
                workers = client.sync(client.scheduler.ncores, callback_timeout=PATIENCE)
                yield Finished(sum(n for n, _ in done), sum(n for _, n in done), len(workers))
            client.cancel(list(waiting))
    except (CancelledError, OSError, TimeoutError) as error:
        raise _lost(store, "the scheduler no longer answers") from error
    except KilledWorker as error:
        raise _lost(store, "one chunk of runs ended several workers") from error


def _lost(store: Store, what: str) -> ClusterError:
    return ClusterError(
        f"{store.folder}: {what}; the runs stored so far are readable, and `gne-mj batch --resume"
        f" --out {store.folder}` goes on from there, with or without --cluster"
    )


def run_chunk(folder: str, manifest: str, chunk: int) -> tuple[int, int]:
    """On a worker: run and store one chunk; its runs, and how many of them ended early.

    Raises:
        InvalidInput: the worker does not see the folder, or has other versions or files.
    """
    store = Store.open(Path(folder))
    if json.dumps(store.plan.manifest()) != manifest:
        raise InvalidInput("folder", folder, "a worker's versions or files differ from those here")
    variables = _runner(manifest).run(chunk)
    assert variables is not None
    store.write(chunk, variables)
    statuses = variables["status"][1]
    return len(statuses), count_early(statuses)


@lru_cache(maxsize=1)
def _runner(manifest: str) -> Runner:
    # one thread: it is the scheduler that says how much a worker does at once
    return Runner(Plan.from_manifest(json.loads(manifest)), 1)
