"""``tolstat causes``: the errors behind a load."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, as_text, say
from tolstat.cli.extend import StudyFile


def causes(
    file: ResultFile,
    by: Annotated[str, typer.Option("--by", metavar="LOAD", help="cross1.F, pin2.contact, psi.")] = "cross1.F",
    n: Annotated[int, typer.Option("--n", metavar="N", min=1, help="How many errors the table shows.")] = 12,
    log: Annotated[bool, typer.Option("--log", help="Shares of the variance of the load's logarithm.")] = False,
    study_file: StudyFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with all errors, instead of a table.")] = False,
) -> None:
    """Tell which errors make a load scatter, and which make its tail.

    For each error: the share of the load's variance that it explains alone, and that it has a part in (Sobol' indices
    from the joints of the file); how the load moves with it (rank regression); and the probability that a joint above
    the limit (or the 90 % quantile) has the larger error, or the one farther from the middle, than one below.
    """
    from tolstat import causes as source
    from tolstat.report import causes as report
    from tolstat.report import text
    from tolstat.store import ResultStore

    with ResultStore.open(file) as store:
        found = source.of_store(store, by, study_file, log=log)
    if as_json:
        typer.echo(as_text(found._asdict() | {"table": text.records(found.table)}))
        return
    typer.echo(report.text(found, n))
    say(report.note(found, log))
