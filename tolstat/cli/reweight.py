"""``tolstat reweight``: other tolerances without new runs."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.cli._app import ResultFile, as_text, say
from tolstat.cli.extend import StudyFile


def reweight(
    file: ResultFile,
    settings: Annotated[
        list[str],
        typer.Option("--set", metavar="KEY=VALUE", help='As "pin*.offset_t.plus_minus=0.05 mm"; repeat for more.'),
    ],
    study_file: StudyFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Estimate the shares above the limits for other tolerances, from the joints of the file.

    Each joint is weighted by how much more often the new tolerances make it. Where few joints have most of the weight
    the verdict is "needs new runs", and the table is not to be trusted.
    """
    from tolstat.display import text
    from tolstat.questions.reweight.query import reweighted
    from tolstat.store import ResultStore

    with ResultStore.open(file) as store:
        found = reweighted(store.view(study_file), settings)
    if as_json:
        w = found.weights
        head = {"usable": w.usable, "ess": w.ess, "pareto_k": w.k if abs(w.k) < 1e300 else None, "allowed_k": w.allowed}
        typer.echo(as_text({**head, "changed": found.changed, "loads": text.records(found.table)}))
        return
    typer.echo(text.plain(found.table))
    say(f"{len(found.changed)} errors changed; {found.verdict}")
