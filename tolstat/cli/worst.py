"""``tolstat worst``: the joints behind the tail."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, as_text, say
from tolstat.cli.extend import StudyFile


def worst(
    file: ResultFile,
    by: Annotated[str, typer.Option("--by", metavar="LOAD", help="cross1.F, pin2.contact, psi, or a result column.")],
    n: Annotated[int, typer.Option("--n", metavar="N", min=1, help="Number of joints.")] = 10,
    study_file: StudyFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with all errors, instead of a table.")] = False,
) -> None:
    """List the joints with the largest load and their errors.

    Errors are given in sigma, the largest first: each as the standard normal number that has the same probability as
    the error in its own distribution.
    """
    from tolstat.questions.causes import rendering
    from tolstat.questions.causes.tail import worst_joints
    from tolstat.store import ResultStore

    with ResultStore.open(file) as store:
        found = worst_joints(store.view(study_file), by, n)
    if as_json:
        typer.echo(as_text(rendering.worst_values(found)))
        return
    typer.echo(rendering.worst_text(found))
    say(f"simulate one again with: tolstat replay {file} --row ROW --out trace.csv")
