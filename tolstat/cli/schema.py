"""``tolstat schema``: the JSON schema of a study, joint or case file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._output import as_json
from tolstat.cli._talk import say
from tolstat.common.errors import Fault, InputError
from tolstat.common.files import check_target
from tolstat.common.strict import did_you_mean
from tolstat.display import text
from tolstat.display.options import Opt
from tolstat.study import schema as schemas


def schema(kind: Annotated[str, Opt("study|joint|case")], *, out: Annotated[Path | None, Opt("JSON")] = None) -> None:
    """Print the JSON schema of a file, for editors.

    Editors with Taplo or Tombi complete and check keys by the schema that a TOML file names in its first line:
    #:schema ./study.schema.json

    Example: tolstat schema study --out study.schema.json

    Parameters
    ----------
    kind : str
        File that the schema is for.
    out : Path, optional
        Write the schema to a file instead of standard output.
    """
    if kind not in schemas.KINDS:
        remedy = did_you_mean(kind, list(schemas.KINDS))
        raise InputError([Fault("tolstat schema", f"no file is called {kind!r}", remedy)])
    content = as_json(schemas.schema(kind))
    if out is None:
        typer.echo(content)
        return
    check_target(out)
    say(f"wrote {text.write(content + chr(10), out)}")
