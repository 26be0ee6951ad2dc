"""``tolstat new`` and ``tolstat schema``: a study to begin with, and schemas by which editors complete keys."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from tolstat.cli._output import json_of
from tolstat.cli._talk import say
from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import did_you_mean
from tolstat.display import text
from tolstat.display.options import Opt
from tolstat.study import schema as schemas
from tolstat.study import starter


def new(
    name: Annotated[Path, Opt("NAME")] = Path("study"), *, joint: Annotated[str, Opt("JOINT")] = "cirelli2021"
) -> None:
    """Write a study with comments that runs as it stands.

    The schema by which editors complete keys is written beside it. Existing studies and joints are not replaced.

    Example: tolstat new shaft --joint own

    Parameters
    ----------
    name : Path
        Name of the study, with or without .toml; may begin with a folder.
    joint : str
        own: write a joint file, too; or a joint that comes with tolstat.
    """
    path = name if name.suffix == ".toml" else name.with_name(f"{name.name}.toml")
    for file in starter.write(path, joint):
        say(f"wrote {file}")
    say(f"next: tolstat plan {quote(str(path))}")


def schema(
    kind: Annotated[str, Opt("study|joint|case")], *, out: Annotated[Path | None, Opt("JSON", writes=True)] = None
) -> None:
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
    content = json_of(schemas.schema(kind))
    if out is None:
        typer.echo(content)
        return
    say(f"wrote {text.write(content + chr(10), out)}")
