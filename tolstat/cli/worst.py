"""``tolstat worst``: the joints with the largest load."""

from __future__ import annotations

from shlex import quote
from typing import Annotated

import typer

from tolstat.cli._app import AsJson, AtPoints, ByOne, ResultPath, StudyOption, Wide, as_text, print_table
from tolstat.cli._talk import progress, say


def worst(
    file: ResultPath,
    by: ByOne = None,
    top: Annotated[int, typer.Option("--top", metavar="N", min=1, help="Number of joints to list.")] = 10,
    point: AtPoints = None,
    study_file: StudyOption = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """List the joints with the largest load and their errors.

    Prints row, load and status of each joint, and its largest errors in sigma: the standard normal score that has the
    same probability as the error in its own distribution. --by takes columns of the results too, such as revolutions.

    Example: tolstat worst iso2768_f.h5 --by cross1.F --top 20
    """
    from tolstat.questions.causes import rendering
    from tolstat.questions.causes.tail import worst_joints
    from tolstat.store import ResultFile

    with progress("worst joints"), ResultFile.open(file) as store:
        view = store.view(study_file).at(point or "")
        found = worst_joints(view, by or view.most_exceeded, top)
    if as_json:
        typer.echo(as_text(rendering.worst_values(found)))
        return
    print_table(rendering.worst_columns(found), rendering.worst_rows(found), wide)
    if found.joints:
        first = found.joints[0]
        where = f" --point {quote(first.point)}" if first.point else ""
        say(f"next: tolstat replay {quote(str(file))} --row {first.row}{where} --out trace.csv")
