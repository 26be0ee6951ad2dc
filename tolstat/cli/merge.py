"""``tolstat merge``: slices of a campaign put together."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import say


def merge(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Result files of slices, in any order.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Result file to make; it must not exist.")],
) -> None:
    """Put slices of a campaign together.

    The slices are files that run --rows has made. They must be of one study and one version of the code, and cover the
    campaign; rows in two of them must have the same results. FILE is then the same as that of one run.
    """
    from tolstat.campaign import extend

    merged = extend.merge(files, out)
    counts = merged.counts
    pending = counts.total - counts.done
    words = [f"{out}: {counts.done} joints, {counts.shortfall}"]
    words += [f"{merged.twice} rows were there twice, with the same results"] * bool(merged.twice)
    words += [f"{pending} still pending: tolstat run STUDY --out {out} goes on with them"] * bool(pending)
    say("\n".join(words))
