"""What commands print on standard output."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from typing import Any

import typer

from tolstat.cli._talk import WIDTH, say, warn, wrapped
from tolstat.display import table
from tolstat.display.answer import Answer, Column, Listing, Rows, Sentence, Table


def deliver(answer: Answer, wide: bool, as_json: bool) -> None:
    """Print an answer as text or as JSON."""
    if as_json:
        print_json(answer.values())
    else:
        show(answer, wide)


def show(answer: Answer, wide: bool) -> None:
    """Print an answer: tables and leading sentences on standard output, notes and warnings on standard error."""
    first = True
    for part in answer.parts:
        if isinstance(part, Table) and part.columns:
            if not first:
                typer.echo(f"\n{part.title}")
            print_table(part.columns, part.for_people, wide)
            first = False
        elif isinstance(part, Listing):
            typer.echo(f"\n{part.title}\n{part.text}")
        elif isinstance(part, Sentence) and part.place == "lead":
            typer.echo(part.text if wide else textwrap.fill(part.text, WIDTH))
            first = False
        elif isinstance(part, Sentence) and part.place == "warning":
            warn(wrapped(f"warning: {part.text}"))
        elif isinstance(part, Sentence):
            say(part.text)


def print_table(columns: Sequence[Column], rows: Rows, wide: bool) -> None:
    """Print a table on standard output, and on standard error the columns left out to fit the line."""
    text, missing = table.fitted(columns, rows, None if wide else table.WIDTH)
    typer.echo(text)
    if missing:
        say(missing)


def json_of(values: Any) -> str:
    """Format plain values as JSON."""
    return json.dumps(values, indent=2, allow_nan=False)


def print_json(values: Any) -> None:
    """Print plain values as JSON on standard output."""
    typer.echo(json_of(values))
