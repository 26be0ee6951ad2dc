"""``tolstat merge``: merge the slices of a campaign."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from tolstat.cli._talk import progress, say


def merge(
    files: Annotated[
        list[Path], typer.Argument(metavar="SLICE", help="Result files (HDF5) of the slices, in any order.")
    ],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Result file to create; must not exist.")],
) -> None:
    """Merge the slices of a campaign into one result file.

    Slices are made by tolstat run --rows. They must have the same study and version of the code, and together hold all
    rows of the campaign; a row in several slices must have identical results. FILE then equals that of a single run.

    Prints the number of joints by outcome on standard error.

    Example: tolstat merge part1.h5 part2.h5 --out whole.h5
    """
    from tolstat.campaign import extend

    with progress("merging"):
        merged = extend.merge(files, out)
    counts = merged.counts
    pending = counts.total - counts.done
    lines = [f"{out}: {counts.done} {counts.counted}, {counts.shortfall}"]
    lines += [f"{merged.twice} surplus copies of rows, with identical results"] * bool(merged.twice)
    again = f"{pending} {counts.counted} are pending; to simulate them: tolstat run STUDY --out {out}"
    lines += [again] * bool(pending)
    lines += [f"next: tolstat report {quote(str(out))} --out {quote(str(out.with_suffix('.html')))}"] * (not pending)
    say("\n".join(lines))
