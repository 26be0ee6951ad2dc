"""``tolstat sorting``: yield and cost before and after parts are scrapped and joints are rejected."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.cli._app import AsJson, AtPoints, ResultPath, StudyOption, Wide, as_text, print_table
from tolstat.cli._talk import progress


def sorting(
    file: ResultPath,
    costs: Annotated[
        Path | None,
        typer.Option(
            "--costs",
            metavar="TABLE",
            help="Cost of each tolerance, TOML or CSV (see tolstat docs allocate); default: 1 for each error.",
        ),
    ] = None,
    point: AtPoints = None,
    study_file: StudyOption = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print yield and cost before and after parts are sorted.

    Parts are scrapped by the gauge of their entry in [tolerances], joints rejected by [reject]. No joint is simulated:
    each counts by the probability that it is kept.

    Prints the share of parts scrapped and the cost of a part, then for each limit, and for all together, the share
    above it with its 95 % interval and the cost of a good joint, at each stage.

    Example: tolstat sorting sorting.h5
    """
    from tolstat.display import text
    from tolstat.questions.sorting import rendering
    from tolstat.questions.sorting.query import sorted_joints
    from tolstat.store import ResultFile

    with progress("yield and cost"), ResultFile.open(file) as store:
        found = sorted_joints(store.view(study_file).at(point or ""), costs)
    if as_json:
        typer.echo(as_text({"parts": text.records(found.parts), "stages": text.records(found.stages)}))
        return
    print_table(rendering.PARTS, found.parts, wide)
    typer.echo()
    print_table(rendering.STAGES, found.stages, wide)
