"""``tolstat schema``: the JSON schema of a study, joint or case file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import as_text, output_file, say


def schema(
    kind: Annotated[str, typer.Argument(metavar="study|joint|case", help="File that the schema is for.")],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="JSON", help="Write the schema to a file instead of standard output."),
    ] = None,
) -> None:
    """Print the JSON schema of a file, for editors.

    Editors with Taplo or Tombi complete and check keys by the schema that a TOML file names in its first line:
    #:schema ./study.schema.json

    Example: tolstat schema study --out study.schema.json
    """
    from tolstat.common.errors import Fault, InputError
    from tolstat.common.strict import did_you_mean
    from tolstat.study import schema as schemas

    if kind not in schemas.KINDS:
        remedy = did_you_mean(kind, list(schemas.KINDS))
        raise InputError([Fault("tolstat schema", f"no file is called {kind!r}", remedy)])
    text = as_text(schemas.schema(kind))
    if out is None:
        typer.echo(text)
        return
    with output_file(out) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    say(f"wrote {out}")
