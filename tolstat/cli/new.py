"""``tolstat new``: a study to begin with."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated

from tolstat.cli._talk import say
from tolstat.display.options import Opt
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
