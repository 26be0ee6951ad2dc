"""``tolstat bench coverage``: how often intervals contain the truth, on problems with known answers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import Workers, as_text
from tolstat.cli._talk import fail, say

MARK = "coverage"


def coverage(
    seeds: Annotated[
        int | None,
        typer.Option(
            "--seeds", metavar="N", min=20, help="Number of samples of each case; by default 2000.", show_default=False
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="200 seeds: ten minutes on two cores.")] = False,
    only: Annotated[
        str, typer.Option("--only", metavar="WORD", help="Statistics whose name has this word.", show_default=False)
    ] = "",
    workers: Workers = None,
    every: Annotated[bool, typer.Option("--cases", help="Also print every case.")] = False,
    into: Annotated[
        Path | None,
        typer.Option(
            "--into",
            metavar="FILE",
            help=f"Markdown file; tables replace what its comments '{MARK}' enclose, after every 50 seeds.",
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Measure how often intervals contain the truth.

    Samples are drawn from laws with known answers, and every interval that a command shows is computed from them. The
    result is the share of intervals that contain the truth, with its own interval; of those that do not, how many are
    above the truth, and below it; how often an estimator refuses; the width over that of fresh joints. An estimator
    that is wrong on purpose must be found. Exit code 1: an interval misses on one side in more than 3.5 %, where that
    is not known. With 2000 seeds an hour on two cores; a run that is interrupted leaves the table of the seeds done.

    Example: tolstat bench coverage --only band --seeds 200
    """
    from tolstat.benchmarks.coverage import page, run
    from tolstat.common.cores import available_cores
    from tolstat.display import marks

    if into is not None:
        marks.split(into, MARK)
    number = seeds if seeds is not None else run.QUICK if quick else run.FULL

    def keep(part: run.Coverage) -> None:
        if into is not None:
            marks.insert(into, MARK, page.markdown(part))

    found = run.measure(number, only, available_cores() if workers is None else workers, say, keep=keep)
    typer.echo(as_text({"cases": found.plain()}) if as_json else page.text(found, every))
    if into is not None:
        say(f"wrote {into}")
    for row in found.failed:
        fail(f"{row.asked.statistic}, {row.asked.case}: misses more often than it claims")
    for row in found.controls_pass:
        fail(f"{row.asked.statistic}, {row.asked.case}: the bench does not find it")
    if found.failed or found.controls_pass:
        raise typer.Exit(1)
