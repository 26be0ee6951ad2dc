"""``tolstat worst``: the joints with the largest load."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, StudyOption, as_text, say


def worst(
    file: ResultFile,
    by: Annotated[
        str, typer.Option("--by", metavar="LOAD", help="Load (cross1.F, pin2.contact, psi) or column of the results.")
    ],
    n: Annotated[int, typer.Option("--n", metavar="N", min=1, help="Number of joints to list.")] = 10,
    study_file: StudyOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON with all errors instead of a table.")] = False,
) -> None:
    """List the joints with the largest load and their errors.

    Prints row, load and status of each joint, and its largest errors in sigma: the standard normal score that has the
    same probability as the error in its own distribution.

    Example: tolstat worst iso2768_f.h5 --by cross1.F --n 20
    """
    from tolstat.questions.causes import rendering
    from tolstat.questions.causes.tail import worst_joints
    from tolstat.store import Reader

    with Reader.open(file) as store:
        found = worst_joints(store.view(study_file), by, n)
    if as_json:
        typer.echo(as_text(rendering.worst_values(found)))
        return
    typer.echo(rendering.worst_text(found))
    say(f"to simulate one of them again: tolstat replay {file} --row ROW --out trace.csv")
