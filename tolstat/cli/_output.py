"""What commands print on standard output."""

from __future__ import annotations

import json
import sys
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import typer

from tolstat.cli._library import answers, tables
from tolstat.cli._talk import WIDTH, say, warn, wrapped
from tolstat.common.files import atomic_write

if TYPE_CHECKING:
    from tolstat.display.answer import Answer, Column, Rows


def deliver(answer: Answer, wide: bool, as_json: bool = False) -> None:
    """Print an answer as JSON, or its tables and leading sentences, and on standard error its notes and warnings."""
    if as_json:
        print_json(answer.values())
        return
    first = True
    for part in answer.parts:
        if isinstance(part, answers.Table) and part.columns:
            if not first:
                typer.echo(f"\n{part.title}")
            print_table(part.columns, part.for_people, wide)
            first = False
        elif isinstance(part, answers.Listing):
            typer.echo(f"\n{part.title}\n{part.text}")
        elif isinstance(part, answers.Sentence):
            if part.place == "lead":
                typer.echo(part.text if wide else textwrap.fill(part.text, WIDTH))
                first = False
            elif part.place == "warning":
                warn(wrapped(f"warning: {part.text}"))
            else:
                say(part.text)


def print_table(columns: Sequence[Column], rows: Rows, wide: bool) -> None:
    """Print a table on standard output, and on standard error the columns left out to fit the line."""
    text, missing = tables.fitted(columns, rows, None if wide else tables.WIDTH)
    typer.echo(text)
    if missing:
        say(missing)


def json_of(values: Any) -> str:
    """Format plain values as JSON."""
    return json.dumps(values, indent=2, allow_nan=False)


def print_json(values: Any) -> None:
    """Print plain values as JSON on standard output."""
    typer.echo(json_of(values))


def write(target: str, content: Callable[[TextIO], object]) -> None:
    """Write a file as `content` does, or standard output where `target` is ``-``."""
    if target == "-":
        content(sys.stdout)
        return
    with atomic_write(Path(target)) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        content(stream)
