"""``tolstat capability``: how a production stands against its limits."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, as_text, say
from tolstat.common.errors import Fault, InputError, StoreError


def capability(
    file: ResultFile,
    one_in: Annotated[
        list[float] | None,
        typer.Option("--one-in", metavar="N", min=1, help="Load that one in N joints exceeds; repeat for more."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Print ppm and Cpk against each limit of the study, and of the joint against all of them.

    With --one-in also the loads that one in N joints exceeds, and the median of the largest of N joints, from a
    generalised Pareto tail; N may be more than the joints simulated, and the intervals tell what that is worth.
    """
    from tolstat.common.loads import LOAD_FIELDS
    from tolstat.display import text
    from tolstat.questions.capability import rendering as tables
    from tolstat.store import ResultStore
    from tolstat.store.view import read

    with ResultStore.open(file) as store:
        campaign = read(store, LOAD_FIELDS, ())
    if not campaign.limits or campaign.method in ("sweep", "cases"):
        remedy = 'give the file of a study with [limits] and sampling.method "random", "sobol" or "lhs"'
        raise StoreError(str(Fault(str(file), "has no joints judged by limits", remedy)))
    table = tables.limits(campaign)
    try:
        rare = tables.returns(campaign, list(campaign.limits), one_in) if one_in else None
    except ValueError as error:
        found, _, remedy = str(error).partition(": ")
        raise InputError([Fault("--one-in", found, remedy)]) from error
    if as_json:
        typer.echo(as_text({"limits": text.records(table), "one_in": [] if rare is None else text.records(rare)}))
        return
    typer.echo(tables.text(table))
    if rare is not None:
        columns = ["load", "unit", "one_in", "estimate", "lower", "upper", "fleet", "fleet_lower", "fleet_upper", "p"]
        typer.echo("\nload that one in N joints exceeds; median of the largest of N (fleet)")
        typer.echo(text.plain(rare[columns]))
    say(tables.note(table))
    if rare is not None and (rare["p"] < 0.05).any():
        say("a tail with p < 0.05 is not generalised Pareto: do not extrapolate it")
