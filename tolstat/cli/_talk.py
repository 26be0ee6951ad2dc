"""What commands say on standard error and in a log file: messages, warnings, errors, details."""

from __future__ import annotations

import logging
import sys
import textwrap
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, redirect_stdout
from pathlib import Path
from typing import Annotated, Any, TextIO

from tolstat import __version__
from tolstat.common.errors import Fault, InputError
from tolstat.common.files import make_parent
from tolstat.display.options import Opt
from tolstat.display.progress import Display, display
from tolstat.display.unseen import visible

WIDTH = 80
"""Maximum length of a line of prose, characters."""
LOG = logging.getLogger("tolstat")
LOG.propagate = False
say, warn, fail = LOG.info, LOG.warning, LOG.error
"""Tell a message; a warning; why the command ends early. The last two are told with --quiet, too."""


class _Stderr(logging.Handler):
    """Prints messages on the standard error of the moment: above the bar while one is shown."""

    def emit(self, record: logging.LogRecord) -> None:
        text = for_terminal(record.getMessage())
        print(wrapped(text) if record.levelno == logging.INFO else text, file=sys.stderr, flush=True)


def for_terminal(text: str) -> str:
    """Text without characters that move the cursor, change colours or the title: names of a file may hold them."""
    return visible(text).replace("\r", "[U+000D]")


class _Terminal:
    """Standard output on a terminal: what is written passes `for_terminal`. Into files and pipes goes what is there."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        return self._stream.write(for_terminal(text))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def wrapped(text: str) -> str:
    """Break lines of prose above `WIDTH` characters; those with a long path or a command to type stay whole."""
    return "\n".join(_broken(line) if len(line) > WIDTH else line for line in text.split("\n"))


def _broken(line: str) -> str:
    if ": tolstat " in line or max(map(len, line.split())) > WIDTH // 2:
        return line
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    return textwrap.fill(line, WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


@contextmanager
def session(
    *, quiet: bool = False, verbose: bool = False, log: Annotated[Path | None, Opt("FILE")] = None
) -> Iterator[None]:
    """Tell messages as the options of a command ask; every command has these options.

    Parameters
    ----------
    quiet : bool
        Print warnings and errors only on standard error.
    verbose : bool
        Print each stage and its time on standard error.
    log : Path, optional
        Append messages with times to FILE, created if missing.

    Raises
    ------
    InputError
        When it is to be quiet and verbose.
    OSError
        When the log cannot be written.
    """
    own = _Stderr()
    LOG.handlers = [own]
    LOG.setLevel(logging.DEBUG)
    own.setLevel(logging.WARNING if quiet else logging.DEBUG if verbose else logging.INFO)
    try:
        if quiet and verbose:
            raise InputError([Fault("--quiet", "cannot be combined with --verbose", "remove one of them")])
        if log is not None:
            LOG.addHandler(_log_file(log))
        LOG.debug("tolstat %s: %s", __version__, " ".join(sys.argv[1:]))
        with redirect_stdout(_Terminal(sys.stdout)) if sys.stdout.isatty() else nullcontext():
            yield
    finally:
        for handler in LOG.handlers[1:]:
            handler.close()
        LOG.handlers = [own]


def _log_file(path: Path) -> logging.Handler:
    make_parent(path)
    handler = logging.FileHandler(path, encoding="utf-8")
    form = logging.Formatter("%(asctime)s %(levelname)s %(message)s", "%Y-%m-%dT%H:%M:%SZ")
    form.converter = time.gmtime
    handler.setFormatter(form)
    return handler


@contextmanager
def progress(first: str = "") -> Iterator[Display]:
    """Show progress on standard error, with the stage `first` to begin with; see `display.progress.Display`."""
    quiet = bool(LOG.handlers) and LOG.handlers[0].level > logging.INFO
    with display(say, LOG.debug, quiet) as shown:
        if first:
            shown.stage(first)
        yield shown
