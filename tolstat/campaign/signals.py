"""Handle Ctrl-C, termination and hang-up as requests to stop once the work in progress is finished."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

CAUGHT = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Stop:
    """Whether a signal has requested a stop, and which one.

    Attributes
    ----------
    number : signal.Signals
        The last signal received; SIGINT before any.
    """

    def __init__(self) -> None:
        self.number = signal.SIGINT
        self._asked = False
        self._deferred = False

    def __call__(self) -> bool:
        """Whether to stop."""
        return self._asked

    @contextmanager
    def deferred(self) -> Iterator[None]:
        """Inside, the first signal only requests a stop, so that no write is interrupted; a second one interrupts."""
        self._deferred = True
        try:
            yield
        finally:
            self._deferred = False

    def handle(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal."""
        again, self._asked, self.number = self._asked, True, signal.Signals(number)
        if again:  # no signal may interrupt the cleanup that follows
            for caught in CAUGHT:
                signal.signal(caught, signal.SIG_IGN)
        if again or not self._deferred:
            raise KeyboardInterrupt


@contextmanager
def caught() -> Iterator[Stop]:
    """Catch SIGINT, SIGTERM and SIGHUP; the previous handlers are restored at the end.

    A SIGHUP that is already ignored (nohup) stays ignored. Only the main thread can catch signals; in other threads
    the caller has to handle them.
    """
    stop = Stop()
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for number in CAUGHT:
            if number.name != "SIGHUP" or signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop.handle)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
