"""Progress of a campaign on stderr: a bar on a terminal, otherwise one line a minute."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType
from typing import TYPE_CHECKING, Protocol, Self, TextIO

from tolstat.store import Counts

if TYPE_CHECKING:
    from rich.progress import Progress

LINE_INTERVAL_S = 60.0
"""Time between two lines if stderr is not a terminal, s."""


class Reporter(Protocol):
    """Callback for the progress of a campaign; called once at the start, then after every block."""

    def __call__(self, counts: Counts) -> None:
        """Report the progress `counts`."""


def text(counts: Counts, begun: int, seconds: float) -> str:
    """Describe the progress of a campaign in one line.

    Parameters
    ----------
    counts : Counts
        Current counts.
    begun : int
        Joints that were done at the start.
    seconds : float
        Time since the start.

    Returns
    -------
    str
        ``"128 of 513 joints, 2.9 joints/s, 2:12 remaining, 1 failed, 0 not settled"``; without rate and remaining
        time before the first joint is done.
    """
    words = [f"{counts.done} of {counts.total} joints"]
    if counts.done > begun and seconds > 0:
        rate = (counts.done - begun) / seconds
        words += [f"{rate:.3g} joints/s", f"{_clock((counts.total - counts.done) / rate)} remaining"]
    return ", ".join([*words, counts.shortfall])


def note(text: str) -> None:
    """Print a message on stderr."""
    print(f"tolstat: {text}", file=sys.stderr, flush=True)


def _clock(seconds: float) -> str:
    minutes, s = divmod(round(seconds), 60)
    hours, m = divmod(minutes, 60)
    return f"{hours}:{m:02d}:{s:02d}" if hours else f"{m}:{s:02d}"


class Lines:
    """Progress as one line a minute, and one at the end of the campaign.

    Parameters
    ----------
    stream : file, optional
        Where the lines go; stderr without it.
    clock : callable, optional
        () -> time, s.
    """

    def __init__(self, stream: TextIO | None = None, clock: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream
        self._clock = clock
        self._start: tuple[int, float] | None = None
        self._printed_at = 0.0
        self._last = ""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._last:
            self._print()

    def __call__(self, counts: Counts) -> None:
        """Record `counts`, and print them if a minute has passed."""
        now = self._clock()
        if self._start is None:
            self._start = counts.done, now
            self._printed_at = now
        self._last = text(counts, self._start[0], now - self._start[1])
        if now - self._printed_at >= LINE_INTERVAL_S:
            self._printed_at = now
            self._print()

    def note(self, text: str) -> None:
        """Print a message."""
        print(f"tolstat: {text}", file=self._stream or sys.stderr, flush=True)

    def _print(self) -> None:
        self.note(self._last)
        self._last = ""


class Bar:
    """Progress as a bar with rate and remaining time, for a terminal."""

    def __init__(self) -> None:
        self._start: tuple[int, float] | None = None
        self._bar: Progress | None = None

    def __enter__(self) -> Self:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn

        columns = (BarColumn(), TextColumn("{task.description}"))
        self._bar = Progress(*columns, console=Console(stderr=True))
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, counts: Counts) -> None:
        """Move the bar to `counts`."""
        if self._bar is None:
            return
        now = time.monotonic()
        if self._start is None:
            self._start = counts.done, now
            self._bar.add_task("", total=counts.total)
        words = text(counts, self._start[0], now - self._start[1])
        self._bar.update(self._bar.task_ids[0], completed=counts.done, description=words)

    def note(self, text: str) -> None:
        """Print a message above the bar."""
        if self._bar is not None:
            self._bar.console.print(f"tolstat: {text}", markup=False, highlight=False)


def reporter() -> Bar | Lines:
    """Return the progress display that suits stderr: a context manager to pass to `campaign.run`."""
    return Bar() if sys.stderr.isatty() else Lines()
