"""Progress of long work: a bar on a terminal or in a notebook, otherwise one line a minute on stderr."""

from __future__ import annotations

import math
import re
import sys
import threading
import time
from collections.abc import Callable
from html import escape
from importlib import import_module
from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from tolstat.common.counts import Counts

LINE_INTERVAL_S = 60.0
"""Time between two lines if stderr is not a terminal, s."""
WIDTH = 80
"""Maximum width of the bar with its words, characters."""
JOINTS = "joints"
"""Name of the stage in which the joints of a campaign are simulated."""

Tell = Callable[[str], None]
Reporter = Callable[["Counts"], None]
"""Callback for the progress of a campaign; called once at the start, then after every block."""


def text(counts: Counts, begun: int, seconds: float, budget: float = math.inf) -> str:
    """Describe the progress of a campaign in one line.

    Parameters
    ----------
    counts : Counts
        Current counts.
    begun : int
        Joints that were done at the start.
    seconds : float
        Time since the start.
    budget : float
        Largest time that may be left: the work ends after it, finished or not.

    Returns
    -------
    str
        ``"128 of 513 joints, 2.9 joints/s, 2:12 left, 1 failed, 0 not settled"``; without rate and remaining time
        before the first joint is done.
    """
    words = [f"{counts.done} of {counts.total} {counts.noun}"]
    if counts.done > begun and seconds > 0:
        rate = (counts.done - begun) / seconds
        remaining = min((counts.total - counts.done) / rate, max(budget, 0.0))
        words += [f"{rate:.3g} {counts.noun}/s", f"{clock(remaining)} left"]
    return ", ".join([*words, counts.shortfall])


def note(text: str) -> None:
    """Print a message on stderr."""
    print(f"tolstat: {text}", file=sys.stderr, flush=True)


def silent(text: str) -> None:
    """Ignore a message, or the name of a stage."""


def clock(seconds: float) -> str:
    """Format a time as ``2:12`` or ``1:02:12``."""
    minutes, s = divmod(round(seconds), 60)
    hours, m = divmod(minutes, 60)
    return f"{hours}:{m:02d}:{s:02d}" if hours else f"{m}:{s:02d}"


class Display:
    """Stages of some work, one after the other; of a campaign also its counts. Shows nothing: subclasses do.

    Parameters
    ----------
    tell : callable
        Receives messages.
    detail : callable
        Receives the time of each stage when it ends.
    now : callable
        () -> time, s.
    """

    def __init__(self, tell: Tell = note, detail: Tell = silent, now: Callable[[], float] = time.monotonic) -> None:
        self.note, self._detail, self._now = tell, detail, now
        self._name, self._begun_at, self._ends_at = "", 0.0, math.inf
        self._counts: Counts | None = None
        self._start = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._end()

    def stage(self, name: str, budget: float = math.inf) -> None:
        """Begin the stage `name`, which ends after the time `budget`, s, at the latest; that before it has ended."""
        if name != self._name:
            self._end()
            self._name, self._begun_at, self._counts = name, self._now(), None
            self._ends_at = self._begun_at + budget
            self._begin()

    def __call__(self, counts: Counts) -> None:
        """Report the counts of a campaign, or of the joints of the current stage."""
        if not self._name:
            self.stage(JOINTS)
        if self._counts is None:
            self._start, self._begun_at = counts.done, self._now()
        self._counts = counts

    @property
    def words(self) -> str:
        """State of the current stage in words."""
        seconds = self._now() - self._begun_at
        if self._counts is None:
            return f"{self._name}, {clock(seconds)}"
        counts = text(self._counts, self._start, seconds, self._ends_at - self._now())
        return counts if self._name == JOINTS else f"{self._name}: {counts}"

    def _begin(self) -> None:
        """Show that a stage has begun."""

    def _end(self) -> None:
        if self._name:
            self._detail(f"{self._name}: {self._now() - self._begun_at:.2f} s")
            self._name = ""


class Lines(Display):
    """One line a minute, and one at the end of a campaign's joints; for a stderr that is no terminal."""

    def __enter__(self) -> Self:
        self._ended = threading.Event()
        threading.Thread(target=self._every_minute, daemon=True).start()
        return self

    def __exit__(self, *error: object) -> None:
        self._ended.set()
        super().__exit__(*error)

    def _every_minute(self) -> None:
        while not self._ended.wait(LINE_INTERVAL_S):
            self.beat()

    def beat(self) -> None:
        """Print the state of the current stage; called once a minute."""
        if self._name:
            self.note(self.words)

    def _end(self) -> None:
        if self._name == JOINTS and self._counts is not None:
            self.beat()
        super()._end()


class Bar(Display):
    """A bar of the current stage on a terminal; that of the joints stays at the end."""

    _bar: Progress
    _task: TaskID | None = None

    def __enter__(self) -> Self:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn
        from rich.table import Column

        console = Console(stderr=True)
        console.width = min(console.width, WIDTH)
        words = TextColumn("{task.description}", markup=False, table_column=Column(no_wrap=True, overflow="ellipsis"))
        self._bar = Progress(BarColumn(bar_width=14), words, console=console, redirect_stdout=False)
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        super().__exit__(*error)
        self._bar.stop()

    def _begin(self) -> None:
        self._task = self._bar.add_task(self._name, total=None)

    def __call__(self, counts: Counts) -> None:
        """Move the bar to `counts`."""
        super().__call__(counts)
        if self._task is not None:
            self._bar.update(self._task, total=counts.total, completed=counts.done, description=self.words)

    def _end(self) -> None:
        if self._task is not None and self._name != JOINTS:
            self._bar.remove_task(self._task)
        self._task = None
        super()._end()


class Cell(Display):
    """A bar of the current stage in the output of a notebook's cell; that of the joints stays at the end."""

    _output: Any

    def __enter__(self) -> Self:
        self._bars: dict[str, str] = {}
        self._output = import_module("IPython.display").display({"text/plain": ""}, raw=True, display_id=True)
        return self

    def _begin(self) -> None:
        self._show("<progress></progress>", self._name)

    def __call__(self, counts: Counts) -> None:
        """Move the bar to `counts`."""
        super().__call__(counts)
        self._show(f'<progress max="{counts.total}" value="{counts.done}"></progress>', self.words)

    def _end(self) -> None:
        if self._name != JOINTS:
            self._bars.pop(self._name, None)
            self._update()
        super()._end()

    def _show(self, bar: str, words: str) -> None:
        self._bars[self._name] = f"{bar} {escape(words)}"
        self._update()

    def _update(self) -> None:
        whole = "".join(f"<div>{line}</div>" for line in self._bars.values())
        self._output.update({"text/html": whole, "text/plain": re.sub("<[^>]*>", "", whole)}, raw=True)


def _in_notebook() -> bool:
    """Whether a notebook's kernel runs this code."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    return hasattr(shell, "kernel")


def display(tell: Tell = note, detail: Tell = silent, quiet: bool = False) -> Display:
    """Return the display of progress that suits stderr, or a notebook: a context manager to pass to `campaign.run`."""
    if quiet:
        return Display(tell, detail)
    kind = Cell if _in_notebook() else Bar if sys.stderr.isatty() else Lines
    return kind(tell, detail)
