"""Main loop of a worker process: take work and its blocks from a pipe until the other end is closed."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any

from tolstat.campaign.executors.common import Work
from tolstat.common import progress_memory

READY, RESULT, RAISED = "ready", "result", "raised"
"""Kinds of messages from a worker."""
F_SETSIG = 10
"""Command of Linux's fcntl that says which signal a file sends; the standard library has no name for it."""


def serve(connection: Connection, memory: Any, ahead: Callable[[], object]) -> None:
    """Process blocks until the parent closes the pipe or ends; signals are ignored, the parent decides when to stop.

    A message is either `Work`, which all blocks after it are for, or a block. `ahead` is called before the first one.
    `memory`, shared with the parent, shows it that the worker makes progress, see `progress_memory`.
    """
    progress_memory.attach(memory)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    _kill_with_parent()
    threading.Thread(target=_end_with_parent, daemon=True).start()
    ahead()
    work: Work[Any, Any] | None = None
    while True:
        try:
            message = connection.recv()
        except (EOFError, OSError):
            return
        if isinstance(message, Work):
            work = message
            work.prepare()
            connection.send((READY, None))
        else:
            assert work is not None
            connection.send(_answer(work, message))


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


def _kill_with_parent() -> None:
    """Let the operating system kill this process when its parent ends (Linux).

    Compiled code blocks Python's threads and signal handlers, so that a joint in an endless loop would outlive its
    parent. The pipe that ends with the parent then sends a signal, which needs neither.
    """
    parent = multiprocessing.parent_process()
    if parent is None or not sys.platform.startswith("linux"):
        return
    import fcntl

    fcntl.fcntl(parent.sentinel, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(parent.sentinel, F_SETSIG, signal.SIGKILL)
    fcntl.fcntl(parent.sentinel, fcntl.F_SETFL, fcntl.fcntl(parent.sentinel, fcntl.F_GETFL) | os.O_ASYNC)


def _end_with_parent() -> None:
    """End this process when its parent ends, between two calls of compiled code."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
