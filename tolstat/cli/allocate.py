"""``tolstat allocate``: the cheapest tolerances that meet given exceedances."""

from __future__ import annotations

from pathlib import Path
from shlex import quote
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


def allocate(
    file: ResultPath,
    target: Annotated[
        list[str],
        typer.Option(
            "--target",
            metavar="RULE",
            help='Largest share of joints above a level: "P(cross*.F > 700 N) < 0.001"; repeatable.',
        ),
    ],
    costs: Annotated[
        Path | None,
        typer.Option(
            "--costs",
            metavar="TABLE",
            help="Cost of each tolerance, TOML or CSV (see tolstat docs allocate); default: cost inversely "
            "proportional to the tolerance.",
        ),
    ] = None,
    keep: Annotated[
        list[str] | None,
        typer.Option(
            "--keep",
            metavar="PATTERN",
            help='Errors whose tolerances do not change, such as "pin*.diameter"; repeatable; default: none.',
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="STUDY", help="Study file (TOML) to write, with the proposed tolerances."),
    ] = None,
    delivery: Delivery = DELIVERY,
    point: AtPoints = None,
    study_file: StudyOption = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Propose the cheapest tolerances that meet the targets.

    Each entry of [tolerances] is multiplied by one factor. One half of the joints in FILE, reweighted to other
    tolerances, selects the factors; the other half checks them. A joint without a valid load counts as above the level.

    Prints factor and cost of each tolerance, the share of joints above each level with its 95 % interval, the changed
    entries as TOML, and a verdict: "holds", or "needs new runs" if the joints in FILE do not suffice. With --out,
    writes a study with the proposed tolerances and another seed, to be run next.

    Example: tolstat allocate iso2768_f.h5 --target "P(any limit) < 0.1"
    """
    from tolstat.common.files import check_target
    from tolstat.display import text
    from tolstat.questions.allocate import rendering
    from tolstat.questions.allocate.query import allocated
    from tolstat.store import ResultFile, error_budget
    from tolstat.study.scaling import line

    if out is not None:
        check_target(out, file)
    with progress("search for the cheapest tolerances"), ResultFile.open(file) as store:
        found = allocated(store.view(study_file).at(point or ""), target, costs, keep or (), delivery=delivery)
        unknown = "" if found.limits["numerical"].all() else error_budget.command(file)
    if out is not None:
        content = found.text
        with output_file(out) as temporary:
            temporary.write_text(content, encoding="utf-8")
    if as_json:
        own = found.ratios
        head = {"holds": found.holds, "verdict": found.verdict, "aim": found.aim, "effective": own.effective}
        tables = {key: text.records(getattr(found, key)) for key in ("tolerances", "limits")}
        typer.echo(as_text({**head, "entries": found.entries, **tables}))
        return
    print_table(rendering.TOLERANCES, found.tolerances, wide)
    typer.echo()
    print_table(rendering.LIMITS, found.limits, wide)
    if found.entries:
        typer.echo("\n[tolerances]\n" + "\n".join(line(*item) for item in found.entries.items()))
    before, after = found.tolerances["cost_before"].sum(), found.tolerances["cost"].sum()
    say(f"total cost {before:.4g} -> {after:.4g} ({100 * (after / before - 1):+.1f} %)\n{found.verdict}")
    if unknown:
        say(unknown)
    if out is not None:
        say(f"wrote {out}\nnext: tolstat run {quote(str(out))}")
