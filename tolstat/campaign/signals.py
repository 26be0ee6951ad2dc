"""Ctrl-C, termination and hang-up as requests: finish what is in work, then stop."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

CAUGHT = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Stop:
    """Whether a signal has asked to stop, and which one.

    Attributes
    ----------
    number : signal.Signals
        The signal; SIGINT until one has come.
    """

    def __init__(self) -> None:
        self.number = signal.SIGINT
        self._asked = False
        self._patient = False

    def __call__(self) -> bool:
        """Whether to stop."""
        return self._asked

    @contextmanager
    def patiently(self) -> Iterator[None]:
        """Have the first signal inside only ask; so none lands in the middle of writing. The second interrupts."""
        self._patient = True
        try:
            yield
        finally:
            self._patient = False

    def take(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal."""
        again, self._asked, self.number = self._asked, True, signal.Signals(number)
        if again:  # nothing shall hinder the clearing up that follows
            for caught in CAUGHT:
                signal.signal(caught, signal.SIG_IGN)
        if again or not self._patient:
            raise KeyboardInterrupt


@contextmanager
def caught() -> Iterator[Stop]:
    """Catch SIGINT, SIGTERM and SIGHUP; the handlers that were there before come back at the end.

    A hang-up that is ignored already (nohup) stays so. Only the main thread can catch signals; elsewhere they are the
    caller's affair.
    """
    stop = Stop()
    before: dict[int, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for number in CAUGHT:
            if number.name != "SIGHUP" or signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, stop.take)
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
