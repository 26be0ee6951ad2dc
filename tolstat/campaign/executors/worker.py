"""What runs in a worker process: it takes blocks from a pipe until the other end is closed."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import traceback
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

from tolstat.campaign.executors.common import Work

READY, RESULT, RAISED = "ready", "result", "raised"
"""Kinds of messages from a worker."""

ORPHAN_GRACE_S = 10.0
"""How much longer than the time limit a worker lets itself run: the parent, if there is one, ends it before."""


def serve(connection: Connection, work: Work[Any, Any]) -> None:
    """Do blocks until the parent closes the pipe or is gone; whether to stop is for the parent to decide."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    work.prepare()
    connection.send((READY, None))
    while True:
        try:
            block = connection.recv()
        except (EOFError, OSError):
            return
        alarm(work.limit_s and work.limit_s + ORPHAN_GRACE_S)
        message = _answer(work, block)
        alarm(None)
        connection.send(message)


def alarm(seconds: float | None) -> None:
    """Have the system end this process after some time, None for never.

    Compiled code keeps Python's threads and signal handlers waiting, so a joint that loops for ever would outlive a
    parent that was killed. The system's own timer needs neither.
    """
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, seconds or 0.0)


def _answer(work: Work[Any, Any], block: Any) -> tuple[str, Any]:
    try:
        return RESULT, work.function(block)
    except Exception as error:
        error.add_note(traceback.format_exc())
        try:
            ForkingPickler.loads(ForkingPickler.dumps(error))
        except Exception:
            return RAISED, RuntimeError(f"{type(error).__name__}: {error}\n{traceback.format_exc()}")
        return RAISED, error


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
