"""Main loop of a worker process: take blocks from a pipe until the other end is closed."""

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
"""Time beyond the time limit after which a worker kills itself, s; a living parent kills it earlier."""


def serve(connection: Connection, work: Work[Any, Any]) -> None:
    """Process blocks until the parent closes the pipe or ends; signals are ignored, the parent decides when to stop."""
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
    """Let the operating system kill this process after some time; None cancels the timer.

    Compiled code blocks Python's threads and signal handlers, so a joint in an endless loop would outlive a parent
    that was killed. The operating system's timer needs neither.
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
