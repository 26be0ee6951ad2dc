"""``tolstat reweight``: exceedance for other tolerances, by likelihood-ratio reweighting."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, StudyOption, as_text, say


def reweight(
    file: ResultFile,
    settings: Annotated[
        list[str],
        typer.Option(
            "--set", metavar="KEY=VALUE", help='Tolerance to change: "pin*.offset_t.plus_minus=0.05 mm"; repeatable.'
        ),
    ],
    study_file: StudyOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Estimate exceedances for changed tolerances.

    Simulates nothing: each joint in FILE gets a weight, the density of its errors under the changed tolerances over
    that under the tolerances of the campaign (likelihood ratio).

    Prints the share of joints above each limit with its 95 % interval, and a verdict. The verdict is "needs new runs"
    if few joints have most of the weight; the table is then unreliable.

    Example: tolstat reweight a.h5 --set "pin*.offset_t.plus_minus=0.05 mm"
    """
    from tolstat.display import text
    from tolstat.questions.reweight.query import reweighted
    from tolstat.store import Reader

    with Reader.open(file) as store:
        found = reweighted(store.view(study_file), settings)
    if as_json:
        w = found.weights
        head = {"usable": w.usable, "ess": w.ess, "pareto_k": w.k if abs(w.k) < 1e300 else None, "allowed_k": w.allowed}
        typer.echo(as_text({**head, "changed": found.changed, "loads": text.records(found.table)}))
        return
    typer.echo(text.plain(found.table))
    say(f"{len(found.changed)} errors changed; {found.verdict}")
