"""Workers of a cluster are killed when a joint hangs, by the rule of workers on this machine."""

from __future__ import annotations

import multiprocessing
import signal
import time
from typing import Any

import numpy as np
import pytest

from tolstat.campaign.executors import Work
from tolstat.campaign.executors.cluster import process_block
from tolstat.common import progress_memory

LIMIT_S = 0.3


def work_slowly(blocks: Any) -> str:
    """Count joints that take longer together than one may, then hang if the last one does."""
    counter = progress_memory.zeros(1, np.dtype(np.int64))
    for joint in blocks:
        end = time.process_time() + 0.5 * LIMIT_S
        while joint == "hangs" or time.process_time() < end:
            pass
        counter += 1
    return "done"


def serve(connection: Any, block: list[str]) -> None:
    connection.send(process_block(Work(work_slowly, size=len, limit_s=LIMIT_S), dict, {}, block))


@pytest.mark.slow
@pytest.mark.parametrize(("block", "code"), [(["ends"] * 4, 0), (["ends", "hangs", *["ends"] * 98], -signal.SIGKILL)])
def test_a_worker_is_killed_when_a_joint_hangs_and_not_before(block: list[str], code: int) -> None:
    """After the first progress a hang of one joint takes the time of one, however many joints its block has."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=serve, args=(there, block))
    process.start()
    there.close()
    process.join(60)
    assert process.exitcode == code
    assert code or here.recv() == "done"
