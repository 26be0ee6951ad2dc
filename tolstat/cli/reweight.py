"""``tolstat reweight``: exceedance for other tolerances, by likelihood-ratio reweighting."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from tolstat.analysis.prediction import DELIVERY
from tolstat.cli._app import (
    AsJson,
    AtPoints,
    Delivery,
    ResultPath,
    StudyOption,
    Wide,
    as_text,
    output_file,
    print_table,
)
from tolstat.cli._talk import progress, say


def reweight(
    file: ResultPath,
    settings: Annotated[
        list[str],
        typer.Option(
            "--set", metavar="KEY=VALUE", help='Tolerance to change: "pin*.offset_t.plus_minus=0.05 mm"; repeatable.'
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="STUDY", help="Study file (TOML) to write, with the changed tolerances."),
    ] = None,
    delivery: Delivery = DELIVERY,
    point: AtPoints = None,
    study_file: StudyOption = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Estimate exceedances for changed tolerances.

    Simulates nothing: each joint in FILE gets a weight, the density of its errors under the changed tolerances over
    that under the tolerances of the campaign (likelihood ratio).

    Prints the share of joints above each limit, and above any limit, with its 95 % interval, and a verdict. Where the
    joints do not support a share, none is given; the verdict is then "needs new runs" and names the commands. With
    --out, writes the study with the changed tolerances and the same seed.

    Example: tolstat reweight iso2768_f.h5 --set "pin*.offset_t.plus_minus=0.1 mm"
    """
    from tolstat.common.files import check_target
    from tolstat.display import text
    from tolstat.questions.reweight import rendering
    from tolstat.questions.reweight.query import reweighted
    from tolstat.store import ResultFile, error_budget

    if out is not None:
        check_target(out, file)
    with progress("reweighting"), ResultFile.open(file) as store:
        view = store.view(study_file).at(point or "")
        found, unknown = reweighted(view, settings, delivery=delivery), error_budget.unknown(view)
    if out is not None:
        with output_file(out) as temporary:
            temporary.write_text(found.text, encoding="utf-8")
    if as_json:
        own = found.ratios
        head = {"usable": found.usable, "effective": own.effective, "needed": own.needed, "verdict": found.verdict}
        typer.echo(as_text({**head, "changed": found.changed, "loads": text.records(found.table)}))
    else:
        print_table(rendering.columns(found.table), found.table, wide)
        say(f"{len(found.changed)} errors changed; {found.verdict}")
        if unknown:
            say(unknown)
    if out is not None:
        say(f"wrote {out}\nnext: tolstat run {out}")
    elif not found.usable:
        say(f"fresh joints, same seeds: {found.remedy}")
