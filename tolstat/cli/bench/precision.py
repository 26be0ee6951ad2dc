"""``tolstat bench precision``: speed against error, beside other integrators."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import announce_compilation, make_folder, tell
from tolstat.cli._talk import say

MARK = "precision"


def precision(
    file: Annotated[Path, typer.Argument(metavar="COMPARISON", help="Joints, settings and integrators (TOML).")],
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for the files; it is made if it is not there.")
    ] = Path("."),
    into: Annotated[
        Path | None,
        typer.Option(
            "--into",
            metavar="FILE",
            help=f"Markdown file; the short table replaces what its comments '{MARK}' enclose.",
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Two joints and few settings: one minute.")] = False,
) -> None:
    """Measure speed against error, beside other integrators.

    The others are those of scipy and SUNDIALS, and Exudyn where it is installed. Prints the fastest of tolstat and of
    the others at each error; writes COMPARISON.md (page), .csv (every setting), .png and .svg (figure). COMPARISON is a
    file such as studies/precision.toml, which takes four minutes. Use a machine without other load.

    Example: tolstat bench precision studies/precision.toml --quick
    """
    from tolstat.benchmarks import runs
    from tolstat.benchmarks.precision import jobs, page, setup
    from tolstat.display import marks

    asked, base = setup.load(file, quick)
    if into is not None:
        marks.split(into, MARK)
    make_folder(out)
    announce_compilation()
    found = runs.run([*jobs.jobs(asked, base, say)], say)
    tell(page.write(found, asked, base, out / file.stem))
    if into is not None:
        marks.insert(into, MARK, page.short(found))
        say(f"wrote {into}")
