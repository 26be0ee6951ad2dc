"""``tolstat verify``: numerical error of a campaign."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import Workers, announce_compilation, as_text, say, writing

if TYPE_CHECKING:
    from tolstat.store.verification import Verification


def verify(
    what: Annotated[Path, typer.Argument(metavar="STUDY|FILE", help="Study file (TOML) or result file (HDF5).")],
    joints: Annotated[
        str, typer.Option("--joints", metavar="N|all", help="Number of joints, or all that settled.")
    ] = "24",
    seed: Annotated[
        int | None, typer.Option("--seed", metavar="S", min=0, help="Chooses the joints; default the study's seed.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="CSV", help="Write every joint, check and load as a table.")
    ] = None,
    workers: Workers = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Measure the numerical error on joints of a campaign.

    They are simulated again with half the step, tighter Newton, from another start, by another method, and by a tight
    reference (scipy's Radau). Prints how far the largest loads are off, relative to the largest of the kind in the
    joint. Of a result file the joints are those that it holds, and what is found is kept in it for the report.
    """
    from tolstat.campaign import progress
    from tolstat.campaign import verify as verification
    from tolstat.campaign.executors import available_workers
    from tolstat.common.files import check_target
    from tolstat.display.table import as_text as aligned
    from tolstat.questions.accuracy import query, rendering

    if out is not None:
        check_target(out, what)
    with progress.reporter() as reporter:
        found = verification.check(
            what, joints, seed, announce_compilation, workers or available_workers(), progress=reporter
        )
    if as_json:
        typer.echo(as_text(_summary(found)))
    else:
        typer.echo(aligned(rendering.ERRORS, query.distribution(found)))
    say(rendering.note(found))
    if out is not None:
        with writing(out) as temporary:
            query.joints(found).to_csv(temporary, index=False, lineterminator="\n")
        say(f"wrote {out}")


def _summary(found: Verification) -> dict[str, Any]:
    """Distributions as plain values, None where nothing is known: by check and kind of load, and by load."""
    from tolstat.questions.accuracy import query

    facts: dict[str, Any] = {"rows": found.rows.tolist(), "seed": found.seed}
    facts["checks"] = {name: check.description for name, check in found.checks.items()}
    for key, table in (("kinds", query.distribution(found)), ("loads", query.by_observable(found))):
        errors: dict[str, Any] = {}
        for line in table.astype(object).where(table.notna(), None).to_dict("records"):
            errors.setdefault(line.pop("error"), {})[line.pop("load")] = line
        facts[key] = errors
    return facts
