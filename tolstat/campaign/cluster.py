"""Blocks through a Dask cluster; those that end with their workers, or raise, are repeated in the pool on this machine.

The scheduler gives the blocks of a lost worker to others. A block that has cost four workers is not tried on the
cluster again. A cluster of this machine whose workers do not come back leaves all blocks to the pool.
"""

from __future__ import annotations

import queue
import tempfile
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tolstat.campaign import pool
from tolstat.campaign.pool import BlockT, Lost, ResultT, Work, WorkerDied
from tolstat.common.cores import one_thread_each
from tolstat.common.errors import InputError, input_error
from tolstat.common.late import filelock
from tolstat.kernel.simd.cache_folder import user
from tolstat.store.metadata import differing, versions

if TYPE_CHECKING:
    from distributed import Client, Future

FIRST_WORKER_S = 300.0
"""Time limit for the first worker of a cluster to appear, s: a batch queue may have to start it."""
GONE_S = 30.0
"""Time after which workers of this machine that are gone are not expected back, s."""
NO_WORKER = "the Dask cluster has no worker\n  hint: start workers with: dask worker tcp://HOST:PORT"
CONNECT_S = 15.0
"""Time limit for connecting to a scheduler, s."""
FETCH_S = 60.0
"""Time limit for fetching a result, s."""
LOOPBACK = "127.0.0.1"
"""Address of a cluster on this machine: Dask runs what it is sent, so nothing listens to other machines."""


def map_on_cluster(
    work: Work[BlockT, ResultT], blocks: Iterable[BlockT], scheduler: str | None, workers: int, stop: Callable[[], bool]
) -> Generator[tuple[BlockT, ResultT | Lost], None, None]:
    """Apply the function to every block on a Dask cluster and yield the results as they arrive.

    Close the generator (`contextlib.closing`) when leaving it early.

    Parameters
    ----------
    work : Work
        Function to apply, and how.
    blocks : iterable
        Blocks; consumed only as they are needed.
    scheduler : str, optional
        Address of the scheduler; without it a cluster is started on this machine.
    workers : int
        Number of processes of a cluster on this machine, and of the pool.
    stop : callable
        Called often; once it returns True no further block is started, and blocks in work are finished.

    Yields
    ------
    tuple
        As `pool.map_blocks`.

    Raises
    ------
    InputError
        When Dask is not installed, the scheduler does not answer, or a worker's software versions differ.
    WorkerDied
        When the scheduler is lost or has no workers; otherwise as `pool.map_blocks`.
    """
    from distributed import KilledWorker

    running: dict[Future, BlockT] = {}
    ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
    failed: list[BlockT] = []
    todo, failures, succeeded, seen = iter(blocks), 0, False, time.monotonic()
    with _client(scheduler, workers) as client:
        expected = _checked(client)
        while True:
            threads = sum(client.nthreads().values())
            seen = time.monotonic() if threads or scheduler else seen
            while len(running) < 2 * max(1, threads) and not stop() and (block := next(todo, None)) is not None:
                future = client.submit(_process_block, work, expected, block, pure=False)
                running[future] = block
                future.add_done_callback(ended.put)
            if not running:
                break
            try:
                future = ended.get(timeout=pool.POLL_S)
            except queue.Empty:
                if client.status != "running":
                    found = "the Dask scheduler has ended\n  hint: start it again with: dask scheduler"
                    raise WorkerDied(found) from None
                if time.monotonic() - seen > GONE_S:
                    failed += running.values()
                    break
                continue
            block = running.pop(future)
            try:
                result = future.result(timeout=FETCH_S)  # one lost with its worker is computed again
            except InputError:
                raise
            except Exception as error:  # it cost too many workers, or raised this
                failed.append(block)
                failures += 1
                failure = str(error) if isinstance(error, KilledWorker) else error
                if ending := pool.too_many_failures(failures, max(1, threads), failure, succeeded):
                    raise ending from error
            else:
                failures, succeeded = 0, True
                yield block, result
    yield from pool.map_blocks(work, chain(failed, todo), workers, stop)


def _process_block(work: Work[Any, Any], expected: Mapping[str, str], block: Any) -> Any:
    """Process a block in a worker."""
    check(expected, _versions(), "a Dask worker")
    _prepare(work.prepare)
    return work.function(block)


_versions = cache(versions)


@cache
def _prepare(prepare: Callable[[], object]) -> None:
    """Prepare this process once; processes of a machine take turns, since they may compile into one cache."""
    with filelock.FileLock(Path(tempfile.gettempdir(), f"tolstat-{user()}.lock")):
        prepare()


def check(expected: Mapping[str, str], actual: Mapping[str, str], where: str) -> None:
    """Reject a process whose results could differ because its versions differ.

    Raises
    ------
    InputError
        With all differences.
    """
    if lines := differing(actual, expected, "on the worker", "here"):
        text = "\n    ".join([f"{where} has other software versions", *lines])
        raise input_error("--executor dask", text, "install the same versions there, and restart the workers")


def _checked(client: Client) -> dict[str, str]:
    """Return the software versions of this process, which all workers have."""
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER_S)
    except TimeoutError as error:
        raise WorkerDied(NO_WORKER) from error
    expected = versions()
    for address, actual in client.run(versions, on_error="return").items():
        if isinstance(actual, BaseException):
            remedy = "install tolstat there, and restart the workers"
            raise input_error("--executor dask", f"the worker {address} cannot run tolstat: {actual!r}", remedy)
        check(expected, actual, f"the worker {address}")
    return expected


@contextmanager
def _client(scheduler: str | None, workers: int) -> Iterator[Client]:
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        found = "Dask's distributed is not installed"
        raise input_error("--executor dask", found, "install it with: pip install 'tolstat[dask]'") from error
    if scheduler is None:
        with one_thread_each(), pool.signals_blocked():
            cluster = LocalCluster(workers, threads_per_worker=1, dashboard_address=None, host=LOOPBACK)
        with cluster, Client(cluster) as client:
            yield client
        return
    try:
        client = Client(scheduler, timeout=CONNECT_S)
    except (OSError, ValueError, TypeError, RuntimeError) as error:
        found = f"{scheduler} does not answer: {error}"
        remedy = "give the address that dask scheduler prints: --scheduler tcp://HOST:PORT"
        if scheduler.startswith("tls:"):
            remedy = "check the certificates: docs/cluster.md names the variables that Dask reads them from"
        raise input_error("--scheduler", found, remedy) from error
    with client:
        yield client
