"""Campaigns on a Dask cluster: real scheduler and workers on this machine, one of which is killed."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.campaign.test_campaign import datasets
from tests.support import fakes
from tests.support.blocks import die
from tests.support.systems import needs_posix
from tolstat.campaign import pool
from tolstat.campaign import run as campaign
from tolstat.campaign.pool import Work, WorkerDied
from tolstat.common.counts import Counts
from tolstat.common.errors import InputError
from tolstat.common.tables import Options, Simulation, Status
from tolstat.store import ResultFile
from tolstat.study import load

pytest.importorskip("distributed")

from tolstat.campaign import cluster as cluster_module
from tolstat.campaign.cluster import check, map_on_cluster

psutil = pytest.importorskip("psutil", reason="distributed requires it")
pytestmark = pytest.mark.usefixtures("in_workers")


class Cluster(NamedTuple):
    """A scheduler and two workers."""

    address: str
    workers: list[subprocess.Popen[bytes]]


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    """Start ``dask scheduler`` and two ``dask worker``."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tcp://127.0.0.1:{port}"
    dask = [sys.executable, "-m", "dask"]
    place = {"env": fakes.environment(), "cwd": tmp_path, "stderr": subprocess.DEVNULL}
    options = ["--host", "127.0.0.1", "--port", str(port), "--no-dashboard"]
    scheduler = subprocess.Popen([*dask, "scheduler", *options], **place)
    options = ["--nthreads", "1", "--no-dashboard", "--no-nanny"]
    workers = [subprocess.Popen([*dask, "worker", address, *options], **place) for _ in range(2)]
    yield Cluster(address, workers)
    for process in (*workers, scheduler):
        process.kill()
        process.wait()


def reference(path: Path) -> dict[str, bytes]:
    fakes.run(fakes.Study(), path, check=True)
    return datasets(path)


@needs_posix
@pytest.mark.slow
def test_a_killed_dask_worker_changes_no_byte(tmp_path: Path, cluster: Cluster) -> None:
    path = tmp_path / "a.h5"

    def kill(counts: Counts) -> None:
        if counts.done == 10:
            cluster.workers[0].kill()

    slow = partial(fakes.simulate, seconds=0.02)
    where = {"executor": "dask", "block": 2, "scheduler": cluster.address}
    counts = fakes.run(fakes.Study(), path, check=True, simulate_rows=slow, **where, progress=kill)
    assert counts.done == 40
    assert cluster.workers[0].poll() == -signal.SIGKILL
    assert datasets(path) == reference(tmp_path / "b.h5")


@pytest.mark.slow
def test_linkages_on_a_cluster_have_the_bytes_of_processes(tmp_path: Path) -> None:
    """Their kernels are compiled for the mechanism in each worker."""
    text = (Path(__file__).parents[2] / "studies" / "four_bar.toml").read_text(encoding="utf-8")
    assert "n = 1000" in text
    linkages = load(Path("four_bar.toml"), text=text.replace("n = 1000", "n = 24"))
    here, there = tmp_path / "a.h5", tmp_path / "b.h5"
    campaign.run(linkages, here, 2, 7)
    counts = campaign.run(linkages, there, 2, 5, executor="dask")
    assert (counts.done, counts.unsettled, counts.failed) == (25, 0, 0), "the nominal one is added"
    assert datasets(there) == datasets(here)


@needs_posix
@pytest.mark.slow
def test_a_cluster_of_this_machine_finds_bad_joints(tmp_path: Path) -> None:
    study, path = fakes.Study(), tmp_path / "a.h5"
    values = fakes.draw(study)["pin1.offset_t"]
    bad = partial(fakes.simulate_badly, kills=values[17], raises=values[30])
    assert fakes.run(study, path, simulate_rows=bad, executor="dask", workers=2, block=5).done == 40
    with ResultFile.open(path) as store:
        assert np.flatnonzero(store.status() == Status.CRASHED).tolist() == [17, 30]


@pytest.mark.slow
def test_the_first_blocks_that_fail_are_no_fault_of_the_cluster(tmp_path: Path) -> None:
    """A block comes through before there are too many; this machine shows which joints crash."""
    study, path, bad = fakes.Study(n=12), tmp_path / "a.h5", [0, 4, 8]
    simulate = partial(simulate_or_raise, bad=fakes.draw(study)["pin1.offset_t"][bad])
    fakes.run(study, path, simulate_rows=simulate, executor="dask", workers=1, block=3)
    with ResultFile.open(path) as store:
        assert np.flatnonzero(store.status() == Status.CRASHED).tolist() == bad


def simulate_or_raise(params: np.ndarray, options: Options, bad: np.ndarray, **kept: Any) -> Simulation:
    if np.isin(params["R"], bad).any():
        raise ZeroDivisionError("a bug of this joint")
    return fakes.simulate(params, options, **kept)


@pytest.mark.slow
def test_a_cluster_whose_workers_cannot_get_ready_ends() -> None:
    with pytest.raises(MemoryError):
        list(map_on_cluster(Work(abs, prepare=cannot), range(20), None, 1, lambda: False))


@needs_posix
@pytest.mark.slow
def test_a_cluster_whose_workers_die_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Dask does not always start workers again."""
    monkeypatch.setattr(cluster_module, "GONE_S", 10.0)
    monkeypatch.setattr(pool, "MAX_FAILURES", 3)
    with pytest.raises(WorkerDied, match=r"[34] times in a row .* (all those workers died|killed by SIGKILL)"):
        list(map_on_cluster(Work(die), range(20), None, 1, lambda: False))


def cannot() -> None:
    raise MemoryError


def test_other_versions_are_refused() -> None:
    with pytest.raises(
        InputError, match=r"a worker has other software versions\n    numba: 2 on the worker, 1 here\n  hint: install"
    ):
        check({"numpy": "1", "numba": "1"}, {"numpy": "1", "numba": "2"}, "a worker")
    check({"numpy": "1"}, {"numpy": "1", "scipy": "3"}, "a worker")


@pytest.mark.slow
def test_a_worker_with_other_versions_is_refused(cluster: Cluster, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster_module, "versions", process_number)
    with pytest.raises(
        InputError, match=r"the worker tcp.* has other software versions\n    process: \d+ on the worker, \d+"
    ):
        list(map_on_cluster(Work(abs), range(9), cluster.address, 2, lambda: False))


def process_number() -> dict[str, str]:
    return {"process": str(os.getpid())}


def test_a_scheduler_that_is_not_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tolstat.campaign.cluster.CONNECT_S", 0.5)
    with pytest.raises(InputError, match=r"--scheduler: tcp://127.0.0.1:1 does not answer"):
        list(map_on_cluster(Work(abs), range(9), "tcp://127.0.0.1:1", 2, lambda: False))


@pytest.mark.slow
def test_stop_finishes_what_is_begun(cluster: Cluster) -> None:
    seen: list[int] = []
    begin = time.monotonic()
    for block, result in map_on_cluster(Work(abs), iter(range(10**6)), cluster.address, 2, lambda: len(seen) > 9):
        seen.append(block)
        assert result == block
    assert 10 <= len(seen) < 40
    assert time.monotonic() - begin < 60


def certificate(folder: Path, name: str, signed_by: str | None) -> None:
    """Make a key and a certificate, signed by itself or by another."""
    subject = ["-subj", f"/CN={name}", "-keyout", f"{name}.key", "-nodes", "-newkey", "rsa:2048"]
    if signed_by is None:
        commands = [["req", "-x509", "-days", "2", *subject, "-out", f"{name}.pem"]]
    else:
        sign = ["-CA", f"{signed_by}.pem", "-CAkey", f"{signed_by}.key", "-CAcreateserial", "-days", "2"]
        commands = [
            ["req", *subject, "-out", f"{name}.csr"],
            ["x509", "-req", "-in", f"{name}.csr", *sign, "-out", f"{name}.pem"],
        ]
    for command in commands:
        subprocess.run(["openssl", *command], cwd=folder, check=True, capture_output=True)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("openssl") is None, reason="needs openssl for certificates")
def test_a_cluster_with_certificates_takes_those_only(tmp_path: Path) -> None:
    """The campaign runs in a process of its own: Dask reads its settings once."""
    certificate(tmp_path, "own", None)
    certificate(tmp_path, "node", "own")
    certificate(tmp_path, "stranger", None)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"tls://127.0.0.1:{port}"

    def settings(authority: str, name: str) -> dict[str, str]:
        held = {"CA_FILE": tmp_path / f"{authority}.pem"}
        for role in ("SCHEDULER", "WORKER", "CLIENT"):
            held |= {f"{role}__CERT": tmp_path / f"{name}.pem", f"{role}__KEY": tmp_path / f"{name}.key"}
        return fakes.environment() | {f"DASK_DISTRIBUTED__COMM__TLS__{key}": str(path) for key, path in held.items()}

    place = {"env": settings("own", "node"), "cwd": tmp_path, "stderr": subprocess.DEVNULL}
    dask = [sys.executable, "-m", "dask"]
    options = ["--host", address, "--no-dashboard"]
    processes = [subprocess.Popen([*dask, "scheduler", *options], **place)]
    options = ["--nthreads", "1", "--no-dashboard", "--no-nanny"]
    processes.append(subprocess.Popen([*dask, "worker", address, *options], **place))
    try:
        done = {
            name: subprocess.run(
                [sys.executable, "-c", OVER_TLS, str(tmp_path / f"{name}.h5"), address],
                env=settings(authority, name), cwd=tmp_path, capture_output=True, text=True, check=False,
            )
            for authority, name in (("own", "node"), ("stranger", "stranger"))
        }  # fmt: skip
    finally:
        for process in processes:
            process.kill()
            process.wait()
    assert done["node"].returncode == 0, done["node"].stderr[-2000:]
    assert datasets(tmp_path / "node.h5") == reference(tmp_path / "b.h5")
    assert "does not answer" in done["stranger"].stderr
    assert "check the certificates" in done["stranger"].stderr


OVER_TLS = """
import sys
from pathlib import Path
from tests.support import fakes
if __name__ == "__main__":
    where = {"executor": "dask", "block": 10, "scheduler": sys.argv[2]}
    fakes.run(fakes.Study(), Path(sys.argv[1]), check=True, **where)
"""


@pytest.mark.slow
def test_a_cluster_of_this_machine_listens_on_the_loopback_only() -> None:
    here = psutil.Process()
    before = {one.laddr for one in here.net_connections("tcp")}
    with cluster_module._client(None, 1):
        sockets = [one for process in (here, *here.children(recursive=True)) for one in process.net_connections("tcp")]
    listening = {one.laddr for one in sockets if one.status == psutil.CONN_LISTEN} - before
    assert len(listening) >= 3, "scheduler, nanny and worker"
    assert {address.ip for address in listening} == {"127.0.0.1"}
