"""``tolstat reweight``: exceedance for other tolerances, by likelihood-ratio reweighting."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.cli._app import AsJson, AtPoints, ResultFile, StudyOption, Wide, as_text, print_table
from tolstat.cli._talk import progress, say


def reweight(
    file: ResultFile,
    settings: Annotated[
        list[str],
        typer.Option(
            "--set", metavar="KEY=VALUE", help='Tolerance to change: "pin*.offset_t.plus_minus=0.05 mm"; repeatable.'
        ),
    ],
    point: AtPoints = None,
    study_file: StudyOption = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Estimate exceedances for changed tolerances.

    Simulates nothing: each joint in FILE gets a weight, the density of its errors under the changed tolerances over
    that under the tolerances of the campaign (likelihood ratio).

    Prints the share of joints above each limit with its 95 % interval, and a verdict. The verdict is "needs new runs"
    if few joints have most of the weight; no share is then given.

    Example: tolstat reweight iso2768_f.h5 --set "pin*.offset_t.plus_minus=0.1 mm"
    """
    from tolstat.display import text
    from tolstat.questions.reweight import rendering
    from tolstat.questions.reweight.query import reweighted
    from tolstat.store import Reader

    with progress("reweighting"), Reader.open(file) as store:
        found = reweighted(store.view(study_file).at(point or ""), settings)
    if as_json:
        w = found.weights
        head = {"usable": w.usable, "ess": w.ess, "pareto_k": w.k if abs(w.k) < 1e300 else None, "allowed_k": w.allowed}
        typer.echo(as_text({**head, "changed": found.changed, "loads": text.records(found.table)}))
        return
    print_table(rendering.columns(found.table), found.table, wide)
    say(f"{len(found.changed)} errors changed; {found.verdict}")
