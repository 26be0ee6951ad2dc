"""``tolstat merge``: merge the slices of a campaign."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
from typing import Annotated

from tolstat.campaign import extend as campaign
from tolstat.cli._talk import progress, say
from tolstat.display.options import Opt


def merge(files: Annotated[list[Path], Opt("SLICE")], *, out: Annotated[Path, Opt("FILE")]) -> None:
    """Merge the slices of a campaign into one result file.

    Slices are made by tolstat run --rows. They must have the same study and version of the code, and together hold all
    rows of the campaign; a row in several slices must have identical results. FILE then equals that of a single run.
    Joints with other tolerances (what_if) are kept, unless the slices hold different results of them.

    Prints the number of joints by outcome on standard error.

    Example: tolstat merge part1.h5 part2.h5 --out whole.h5

    Parameters
    ----------
    files : list of Path
        Result files (HDF5) of the slices, in any order.
    out : Path
        Result file to create; must not exist.
    """
    with progress("merging"):
        merged = campaign.merge(files, out)
    counts = merged.counts
    pending = counts.total - counts.done
    lines = [f"{out}: {counts.done} {counts.counted}, {counts.shortfall}"]
    lines += [f"{merged.twice} surplus copies of rows, with identical results"] * bool(merged.twice)
    dropped = f"left out: joints of {merged.dropped} changes of what_if, of which the slices hold different results"
    lines += [dropped] * bool(merged.dropped)
    again = f"{pending} {counts.counted} are pending; to simulate them: tolstat run STUDY --out {out}"
    lines += [again] * bool(pending)
    lines += [f"next: tolstat report {quote(str(out))} --out {quote(str(out.with_suffix('.html')))}"] * (not pending)
    say("\n".join(lines))
