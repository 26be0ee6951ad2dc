"""``tolstat capability``: process capability against the limits."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, as_text, say
from tolstat.common.errors import Fault, InputError, StoreError


def capability(
    file: ResultFile,
    one_in: Annotated[
        list[float] | None,
        typer.Option("--one-in", metavar="N", min=1, help="Print the load that one in N joints exceeds; repeatable."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Print ppm and Cpk against each limit of the study.

    Prints for each limit, and for all limits together, the share of joints above it (ppm) and the process capability
    index Cpk, each with its 95 % interval.

    With --one-in N, prints also the load that one in N joints exceeds, and the median of the largest load of N joints,
    from a generalised Pareto distribution fitted to the tail. N may exceed the number of simulated joints: the
    intervals show the uncertainty of the extrapolation.

    Example: tolstat capability iso2768_f.h5 --one-in 10000
    """
    from tolstat.common.loads import LOAD_FIELDS
    from tolstat.display import text
    from tolstat.questions.capability import rendering as tables
    from tolstat.store import ResultStore
    from tolstat.store.view import read

    with ResultStore.open(file) as store:
        campaign = read(store, LOAD_FIELDS, ())
    if not campaign.limits or campaign.method in ("sweep", "cases"):
        remedy = 'give the result file of a study with [limits] and sampling.method "random", "sobol" or "lhs"'
        raise StoreError(str(Fault(str(file), "has no limits, or its joints are no random sample", remedy)))
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
        typer.echo("\nload that one in N joints exceeds (estimate); median of the largest load of N joints (fleet)")
        typer.echo(text.plain(rare[columns]))
    say(tables.note(table))
    if rare is not None and (rare["p"] < 0.05).any():
        say("warning: a tail with p < 0.05 is not generalised Pareto; do not use its estimate")
