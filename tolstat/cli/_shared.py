"""What commands share: messages on standard error and in a log file, answers on standard output, simulations."""

from __future__ import annotations

import json
import logging
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TextIO

import typer

from tolstat import __version__
from tolstat.cli import _library as library
from tolstat.common.errors import Fault, InputError
from tolstat.common.files import atomic_write, make_parent
from tolstat.common.late import pandas as pd
from tolstat.common.wording import AS_WRITTEN, Wording
from tolstat.display.options import Opt
from tolstat.display.progress import Display, display
from tolstat.display.unseen import visible

if TYPE_CHECKING:
    from tolstat.joint import Joint

WIDTH = 80
"""Maximum length of a line of prose, characters."""
LOG = logging.getLogger("tolstat")
LOG.propagate = False
say, warn, fail = LOG.info, LOG.warning, LOG.error
"""Tell a message; a warning; why the command ends early. The last two are told with --quiet, too."""


class _Told(logging.Filter):
    """Tells messages with the word for the rows of what a command is about, see `about`."""

    wording = AS_WRITTEN

    def filter(self, record: logging.LogRecord) -> bool:
        record.msg, record.args = self.wording(record.getMessage()), ()
        return True


_TOLD = _Told()
LOG.addFilter(_TOLD)


def about(wording: Wording) -> None:
    """Tell everything in this session with a wording."""
    _TOLD.wording = wording


def loaded(path: Path, **choices: Any) -> library.studies.Study:
    """Load the study that a command is about."""
    study = library.studies.load(path, **choices)
    about(study.wording)
    return study


def opened(path: Path) -> library.stores.ResultFile:
    """Open the result file that a command is about."""
    store = library.stores.ResultFile.open(path)
    about(library.recorded.wording_of(store))
    return store


def told(text: str) -> str:
    """Text with the word for the rows of what the command is about."""
    return _TOLD.wording(text)


def answered(answer: library.answers.Answer) -> library.answers.Answer:
    """Answer with the word for the rows of what the command is about."""
    return library.rewording.answer(answer, _TOLD.wording)


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
    terminal = _Stderr()
    LOG.handlers = [terminal]
    about(AS_WRITTEN)
    LOG.setLevel(logging.DEBUG)
    terminal.setLevel(logging.WARNING if quiet else logging.DEBUG if verbose else logging.INFO)
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
        LOG.handlers = [terminal]


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


def deliver(
    answer: library.answers.Answer,
    wide: bool,
    as_json: bool = False,
    stem: Path | None = None,
    which: Literal["all", "picture", "documents"] = "all",
) -> None:
    """Write the files of an answer, print it, and tell their names.

    On standard output it is JSON, or tables and leading sentences, with notes on standard error. With a
    `stem` its files are written, or `which` of them: see `Answer.write`, `write_picture`, `write_documents`.
    """
    files: list[Path] = []
    if stem is not None:  # first: the reader of a pipe may end early
        with progress("files"):
            write = {"all": answer.write, "picture": answer.write_picture, "documents": answer.write_documents}
            files = write[which](stem)
    if as_json:
        print_json(answer.values())
    else:
        _print_parts(answer, wide)
    for path in files:
        say(f"wrote {path}")


def _print_parts(answer: library.answers.Answer, wide: bool) -> None:
    first = True
    for part in answer.parts:
        if isinstance(part, library.answers.Table) and part.columns:
            if not first:
                echo(f"\n{part.title}")
            print_table(part.columns, part.for_people, wide)
            first = False
        elif isinstance(part, library.answers.Listing):
            echo(f"\n{part.title}\n{part.text}")
        elif isinstance(part, library.answers.Sentence):
            if part.place == "lead":
                echo(textwrap.fill(part.text, library.table.WIDE if wide else WIDTH))
                first = False
            else:
                say(part.text)


def print_table(columns: Sequence[library.table.Column], rows: library.table.Rows, wide: bool) -> None:
    """Print a table on standard output, and on standard error the columns left out to fit the line."""
    text, missing = library.table.fitted(columns, rows, None if wide else library.table.WIDTH)
    echo(text)
    if missing:
        say(missing)


def echo(text: str = "") -> None:
    """Print on standard output, in its encoding: typer would write UTF-8 where that is ASCII."""
    print(text, flush=True)


def json_of(values: Any) -> str:
    """Format plain values as JSON."""
    return json.dumps(values, indent=2, allow_nan=False)


def print_json(values: Any) -> None:
    """Print plain values as JSON on standard output."""
    echo(json_of(values))


def write(target: str | Path, content: Callable[[TextIO], object], what: str | None = None) -> None:
    """Write a file as `content` does, or standard output where `target` is ``-``.

    With `what`, tells the name of the file, and behind it `what` it holds unless that is empty.
    """
    if target == "-":
        content(sys.stdout)
        return
    with atomic_write(Path(target)) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        content(stream)
    if what is not None:
        say(f"wrote {target}: {what}" if what else f"wrote {target}")


def write_frame(frame: pd.DataFrame, target: str | Path, what: str = "") -> None:
    """Write a table as CSV, see `write`."""
    write(target, lambda stream: frame.to_csv(stream, index=False, lineterminator="\n"), what)


@contextmanager
def work(**settings: Any) -> Iterator[library.works.Work]:
    """Work of one command with progress on standard error; `settings` are fields of `Work`.

    A simulation that is stopped, or loses its workers, says how far it came and ends with the exit code of that.
    """
    try:
        with progress() as shown:
            yield library.works.Work(display=shown, tell=say, **settings)
    except library.run.Interrupted as stop:
        fail(str(stop))
        raise typer.Exit(stop.exit_code) from stop
    except library.pool.WorkerDied as error:
        fail(f"error: {error}")
        raise typer.Exit(1) from error


def print_warnings(path: Path, joints: Iterable[Joint], variants: Iterable[library.tables.Variant] = ()) -> None:
    """Print the warnings of the joint of a case or study, or of the joints of its `variants`; see `Joint.warnings`.

    Of several joints with a warning about the same key the first is printed, and how many others there are.
    """
    places = [f"variant {variant.family!r}: joint" for variant in variants] or ["joint"]
    faults: dict[str, list[Fault]] = {}
    for place, joint in zip(places, joints, strict=True):
        for fault in joint.warnings():
            faults.setdefault(fault.place, []).append(replace(fault, place=f"{place}.{fault.place}"))
    for first, *others in faults.values():
        more = f" (and {len(others)} more joints)" if others else ""
        warn(f"warning: {path}: {replace(first, found=first.found + more)}")


def print_warnings_of_others(path: Path, study: library.studies.Study) -> None:
    """Print the warnings of joints beside that of the study, see `Study.others`."""
    for place, joint in study.others.items():
        for fault in joint.warnings():
            warn(f"warning: {path}: {replace(fault, place=f'{place}.{fault.place}')}")


def print_study_notes(path: Path, study: library.studies.Study) -> None:
    """Print what a study stands on, and its warnings.

    These are mounting and contact law; notes on measured signals and joints; warnings of its joints, of values that are
    probably not meant, and a note where rigid shafts meet errors along them.
    """
    say(f"{study.name}: {study.joint_in_words}")
    for note in study.notes:
        say(f"note: {note}")
    joint2 = study.operation.joint2
    axial = [joint.shaft.axial for joint in ([joint2] if joint2 else study.joints)]
    command = library.mounting.with_free_shaft(str(path), path.stem, study.joint)
    if note := library.mounting.note_on_shafts(study.tolerances, axial, study.mechanism, command):
        say(f"note: {note}")
    print_warnings(path, study.joints, study.variants)
    print_warnings_of_others(path, study)
    for fault in library.assumptions.warnings(study):
        warn(f"warning: {fault}")
