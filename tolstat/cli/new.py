"""``tolstat new``: a study to begin with."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from tolstat.cli._talk import say


def new(
    name: Annotated[
        Path,
        typer.Argument(metavar="NAME", help="Name of the study, with or without .toml; may begin with a folder."),
    ] = Path("study"),
    joint: Annotated[
        str,
        typer.Option(
            "--joint", metavar="JOINT", help="own: write a joint file, too; or a joint that comes with tolstat."
        ),
    ] = "cirelli2021",
) -> None:
    """Write a study with comments that runs as it stands.

    The schema by which editors complete keys is written beside it. Existing studies and joints are not replaced.

    Example: tolstat new shaft --joint own
    """
    from tolstat.study import starter

    path = name if name.suffix == ".toml" else name.with_name(f"{name.name}.toml")
    for file in starter.write(path, joint):
        say(f"wrote {file}")
    say(f"next: tolstat plan {quote(str(path))}")
