"""Executor on a Dask cluster; blocks that its workers do not survive are repeated in supervised processes here.

The scheduler reassigns the blocks of a lost worker. A worker that hangs is killed by its `guard`. A block that kills
several workers, or raises, is not submitted again: at the end its pieces are processed on this machine, which shows
which of them crash or hang. If blocks fail before any has succeeded, a worker must get ready without one: if it does,
the fault is in the blocks.
"""

from __future__ import annotations

import os
import queue
import tempfile
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any

from tolstat.campaign.executors.common import (
    POLL_S,
    BlockT,
    Lost,
    ResultT,
    Work,
    WorkerDied,
    never_stop,
)
from tolstat.campaign.executors.guard import Guard
from tolstat.campaign.executors.processes import map_in_processes, one_thread_each, signals_blocked
from tolstat.common.cores import available_cores
from tolstat.common.errors import Fault, InputError

if TYPE_CHECKING:
    from distributed import Client, Future

FIRST_WORKER_S = 300.0
"""Time limit for the first worker of a cluster to appear, s: a batch queue may have to start it."""
CONNECT_S = 15.0
"""Time limit for connecting to a scheduler, s."""
FETCH_S = 60.0
"""Time limit for fetching a result, s."""
MAX_FAILURES = 3
"""Number of failed blocks, before any has succeeded, at which a worker must show that it can get ready."""
READINESS = "readiness"
"""Takes the place of a block when a worker only has to get ready."""
LOOPBACK = "127.0.0.1"
"""Address of a cluster on this machine: Dask runs what it is sent, so nothing listens to other machines."""

Fingerprint = Callable[[], Mapping[str, str]]

_ONE_AT_A_TIME = threading.Lock()
"""Lock: a simulation uses work arrays of the process, which the threads of a worker must not use at the same time."""


def map_on_cluster(
    work: Work[BlockT, ResultT],
    blocks: Iterable[BlockT],
    scheduler: str | None,
    workers: int,
    fingerprint: Fingerprint,
    stop: Callable[[], bool] = never_stop,
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
        Number of processes of a cluster on this machine.
    fingerprint : callable
        () -> values by name, such as versions, that must be equal here and in every worker.
    stop : callable, optional
        Called often; once it returns True no further block is started, and blocks in work are finished.

    Yields
    ------
    tuple
        As `map_in_processes`.

    Raises
    ------
    InputError
        When Dask is not installed, the scheduler does not answer, or a worker's fingerprint differs.
    WorkerDied
        When the scheduler is lost or has no workers, or its workers cannot get ready; otherwise as `map_in_processes`.
    """
    with _client(scheduler, workers) as client:
        _check_fingerprints(client, fingerprint)
        cluster = _Cluster(client, work, iter(blocks), fingerprint)
        yield from cluster.run(stop)
    pieces = [piece for block in cluster.suspects for piece in work.split(block)]
    if pieces:
        yield from map_in_processes(work, pieces, min(len(pieces), available_cores()), stop)


class _Cluster:
    """Blocks in work on a cluster, at most twice as many as it has threads."""

    def __init__(self, client: Client, work: Work[Any, Any], blocks: Iterator[Any], fingerprint: Fingerprint) -> None:
        self.client = client
        self.work = work
        self.blocks = blocks
        self.fingerprint = fingerprint
        self.expected = dict(fingerprint())
        self.running: dict[Future, Any] = {}
        self.ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self.suspects: list[Any] = []
        self.proven = self.asked = False

    def run(self, stop: Callable[[], bool]) -> Iterator[tuple[Any, Any]]:
        more = True
        while more or self.running:
            if stop():
                self.suspects.clear()
                more = False
            more = more and self._hand_out()
            try:
                future = self.ended.get(timeout=POLL_S)
            except queue.Empty:
                if self.client.status != "running":
                    raise WorkerDied(
                        "the Dask scheduler has ended\n  hint: start it again with: dask scheduler"
                    ) from None
                continue
            yield from self._take(future)

    def _hand_out(self) -> bool:
        """Submit blocks; return whether there may be more."""
        room = 2 * max(1, sum(self.client.nthreads().values())) - len(self.running)
        for _ in range(room):
            block = next(self.blocks, None)
            if block is None:
                return False
            self._submit(process_block, block)
        return True

    def _submit(self, function: Callable[..., Any], block: Any) -> None:
        future = self.client.submit(function, self.work, self.fingerprint, self.expected, block, pure=False)
        self._watch(future, block)

    def _watch(self, future: Future, block: Any) -> None:
        self.running[future] = block
        future.add_done_callback(self.ended.put)

    def _take(self, future: Future) -> Iterator[tuple[Any, Any]]:
        block = self.running.pop(future)
        if future.status in ("lost", "pending"):  # lost with its worker; the scheduler runs it again
            self._watch(future, block)
            return
        if future.status not in ("finished", "error"):
            raise WorkerDied("the Dask scheduler has dropped a block\n  hint: check whether it was restarted")
        try:
            result = future.result(timeout=FETCH_S)
        except InputError:
            raise
        except Exception as error:  # workers died on the block or with its result, or it raised this
            if block is READINESS:
                found = f"the first {len(self.suspects)} blocks failed on the Dask cluster, and no worker gets ready"
                raise WorkerDied(f"{found}: {error!r}\n  hint: read the logs of its workers") from error
            self.suspects.append(block)
            if not (self.proven or self.asked) and len(self.suspects) >= MAX_FAILURES:
                self.asked = True
                self._submit(make_ready, READINESS)
            return
        self.proven = True
        if block is not READINESS:
            yield block, result


def process_block(work: Work[Any, Any], fingerprint: Fingerprint, expected: Mapping[str, str], block: Any) -> Any:
    """Process a block in a worker, one block at a time."""
    with _ready(work, fingerprint, expected) as guard:
        guard.begin(work.limit_s, work.size(block))
        try:
            return work.function(block)
        finally:
            guard.end()


def make_ready(work: Work[Any, Any], fingerprint: Fingerprint, expected: Mapping[str, str], _: Any) -> None:
    """Get a worker ready as for a block."""
    with _ready(work, fingerprint, expected):
        pass


@contextmanager
def _ready(work: Work[Any, Any], fingerprint: Fingerprint, expected: Mapping[str, str]) -> Iterator[Guard]:
    check(expected, _own(fingerprint), "a Dask worker")
    with _ONE_AT_A_TIME:
        guard = _guard()
        _prepare(work.prepare)
        yield guard


@cache
def _guard() -> Guard:
    return Guard()


@cache
def _own(fingerprint: Fingerprint) -> Mapping[str, str]:
    return fingerprint()


@cache
def _prepare(prepare: Callable[[], object]) -> None:
    """Prepare this process once; processes of a machine take turns, since they may compile into one cache."""
    with open(os.path.join(tempfile.gettempdir(), f"tolstat-{os.getuid()}.lock"), "w") as lock:
        import fcntl

        fcntl.flock(lock, fcntl.LOCK_EX)
        prepare()


def check(expected: Mapping[str, str], found: Mapping[str, str], where: str) -> None:
    """Reject a process whose results could differ because its versions differ.

    Raises
    ------
    InputError
        With all differences.
    """
    lines = [
        f"{name}: {value} here, {found.get(name)} on the worker"
        for name, value in expected.items()
        if found.get(name) != value
    ]
    if lines:
        differing = "\n    ".join([f"{where} has other software versions", *lines])
        raise InputError(
            [Fault("--executor dask", differing, "install the same versions there, and restart the workers")]
        )


def _check_fingerprints(client: Client, fingerprint: Fingerprint) -> None:
    try:
        client.wait_for_workers(1, timeout=FIRST_WORKER_S)
    except TimeoutError as error:
        found = f"the Dask cluster has no worker after {FIRST_WORKER_S:g} s"
        raise WorkerDied(f"{found}\n  hint: start workers with: dask worker tcp://HOST:PORT") from error
    for address, found in client.run(fingerprint, on_error="return").items():
        if isinstance(found, BaseException):
            remedy = "install tolstat there, and restart the workers"
            raise InputError([Fault("--executor dask", f"the worker {address} cannot run tolstat: {found!r}", remedy)])
        check(dict(fingerprint()), found, f"the worker {address}")


@contextmanager
def _client(scheduler: str | None, workers: int) -> Iterator[Client]:
    try:
        from distributed import Client, LocalCluster
    except ImportError as error:
        remedy = "install it with: pip install 'tolstat[dask]'"
        raise InputError([Fault("--executor dask", "Dask's distributed is not installed", remedy)]) from error
    if scheduler is None:
        with one_thread_each(), signals_blocked():
            cluster = LocalCluster(
                n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None, host=LOOPBACK
            )
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
        raise InputError([Fault("--scheduler", found, remedy)]) from error
    with client:
        yield client
