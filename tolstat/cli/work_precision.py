"""``tolstat work-precision``: speed against error, beside other integrators."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import announce_compilation, make_folder, say, tell

MARK = "work and precision"


def work_precision(
    file: Annotated[Path, typer.Argument(metavar="COMPARISON", help="Work-precision study (TOML).")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the files, made if need be.")] = Path(
        "."
    ),
    into: Annotated[
        Path | None,
        typer.Option("--into", metavar="FILE", help="Markdown file with a marked place that gets the short table too."),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Two joints and few settings: one minute.")] = False,
) -> None:
    """Measure core time against error of the solver and of scipy's and SUNDIALS' integrators.

    Prints who is ahead at a given error; writes COMPARISON.md, .csv, .png and .svg: page, every setting, figure. Use a
    quiet machine.
    """
    from tolstat.benchmarks.work_precision import measure, page, setup
    from tolstat.display import marks

    asked, base = setup.load(file, quick)
    if into is not None:
        marks.split(into, MARK)
    make_folder(out)
    announce_compilation()
    params = setup.parameters(asked, base)
    runs = measure.run(asked, base, params, say)
    tell(page.write(runs, asked, base, out / file.stem))
    if into is not None:
        marks.insert(into, MARK, page.short(runs))
        say(f"wrote {into}")
