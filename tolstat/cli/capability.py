"""``tolstat capability``: process capability against the limits."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.analysis.prediction import DELIVERY
from tolstat.cli._app import AsJson, AtPoints, Delivery, ResultPath, Wide, as_text, print_table
from tolstat.cli._talk import progress, say, warn, wrapped
from tolstat.common.errors import Fault, InputError, StoreError


def capability(
    file: ResultPath,
    one_in: Annotated[
        list[float] | None,
        typer.Option("--one-in", metavar="N", min=1, help="Print the load that one in N joints exceeds; repeatable."),
    ] = None,
    delivery: Delivery = DELIVERY,
    point: AtPoints = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print yield and Cpk against each limit of the study.

    Prints for each limit, and for all limits together, the share of joints below it (yield) and the process capability
    index Cpk, each with its 95 % interval; with --wide or --json also a prediction interval for the number of joints
    above the limit in the next delivery.

    With --one-in N, prints also the load that one in N joints exceeds, and the median of the largest load of N joints,
    from a generalised Pareto distribution fitted to the tail. N may exceed the number of simulated joints: the
    intervals show the uncertainty of the extrapolation.

    Example: tolstat capability iso2768_f.h5 --one-in 1000
    """
    from tolstat.display import text
    from tolstat.questions.capability import query, rendering
    from tolstat.store import ResultFile, error_budget

    with progress("capability"), ResultFile.open(file) as store:
        view = store.view().at(point or "")
        if not view.limits or view.method in ("sweep", "cases"):
            remedy = 'give the result file of a study with [limits] and sampling.method "random", "sobol" or "lhs"'
            raise StoreError(str(Fault(str(file), "has no limits, or its joints are no random sample", remedy)))
        view.check("index")
        table, unknown = query.limits(view, delivery=delivery), error_budget.unknown(view)
        try:
            rare = query.returns(view, list(view.limits), one_in) if one_in else None
        except ValueError as error:
            found, _, remedy = str(error).partition(": ")
            raise InputError([Fault("--one-in", found, remedy)]) from error
    if as_json:
        typer.echo(as_text({"limits": text.records(table), "one_in": [] if rare is None else text.records(rare)}))
        return
    print_table(rendering.LIMITS, table, wide)
    if rare is not None:
        typer.echo("\nload that one in N joints exceeds; median of the largest load of N joints")
        print_table(rendering.RETURNS, rare, wide)
    say(rendering.note(table))
    if unknown:
        say(unknown)
    if rare is not None and (no_tail := rendering.no_tail(rare)):
        warn(wrapped(f"warning: {no_tail}; tolstat rare, a subset simulation, needs no tail"))
