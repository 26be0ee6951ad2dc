"""``tolstat rare``: the probability of a rare load by subset simulation."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import Workers, announce_compilation, as_text, say
from tolstat.cli.extend import StudyFile
from tolstat.common.errors import Fault, InputError, gather

if TYPE_CHECKING:
    from tolstat.questions.rare.query import Found
    from tolstat.study import Study


class Side(StrEnum):
    """Where a joint without a valid load is counted."""

    ABOVE = "above"
    BELOW = "below"


def rare(
    source: Annotated[
        Path, typer.Argument(metavar="STUDY|FILE", help="Study (TOML); or a file of tolstat rare, to go on with.")
    ],
    limit: Annotated[
        str | None, typer.Option("--limit", metavar="LIMIT", help='Load and level: "cross1.F > 900 N".')
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Result file; default STUDY_rare.h5 in this folder.")
    ] = None,
    n: Annotated[int | None, typer.Option("--n", metavar="N", min=20, help="Joints a level; default 1000.")] = None,
    p0: Annotated[
        float | None, typer.Option("--p0", metavar="P", help="Share of them carried to the next level; default 0.1.")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", metavar="S", min=0, help="Instead of the study's.")] = None,
    unresolved: Annotated[
        Side | None,
        typer.Option("--unresolved", help="Where joints that fail or do not settle are counted; default below."),
    ] = None,
    study_file: StudyFile = None,
    workers: Workers = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")] = False,
) -> None:
    """Estimate a probability down to 1e-9 by subset simulation: some thousand joints a level, level after level.

    Each level starts from the joints of the one before with the largest loads. All joints are kept in a result file;
    stopped with Ctrl-C or killed, the same command goes on where it was. For what the interval does not cover, see
    docs/questions/rare.md.
    """
    from tolstat.campaign import run as campaign
    from tolstat.campaign.executors import WorkerDied
    from tolstat.display import text
    from tolstat.questions.rare import query as simulation
    from tolstat.questions.rare import rendering as tables

    given = {"n": n, "p0": p0, "seed": seed, "unresolved": None if unresolved is None else unresolved.value}
    given = {name: value for name, value in given.items() if value is not None}
    if source.suffix == ".toml":
        plan, path = _plan(source, limit, given), out or Path(f"{source.stem}_rare.h5")
    else:
        plan, path = _recalled(source, study_file, [limit, out, *given.values()]), source
    announce_compilation()
    try:
        found = simulation.run(plan, path, workers, say)
    except campaign.Interrupted as stop:
        say(str(stop))
        raise typer.Exit(stop.exit_code) from stop
    except WorkerDied as error:
        say(f"error: {error}")
        raise typer.Exit(1) from error
    asked = found.sampling
    levels = tables.table(found.levels, asked.load)
    if as_json:
        typer.echo(as_text(_summary(found) | {"levels": text.records(levels)}))
    else:
        typer.echo(text.plain(levels))
        typer.echo(tables.sentence(found.estimate, asked.load, asked.above))
    _talk(found, path)


def _plan(source: Path, limit: str | None, given: dict[str, Any]) -> Study:
    from tolstat import study
    from tolstat.questions.rare.query import asked, parse

    faults: list[Fault] = []
    if limit is None:
        faults.append(Fault("--limit", "is missing", 'write --limit "cross1.F > 900 N"'))
    else:
        with gather(faults):
            parse(limit)
    with gather(faults):
        plan = study.load(source)
    if faults or limit is None:
        raise InputError(faults)
    return asked(plan, limit, **given)


def _recalled(source: Path, study_file: Path | None, given: list[Any]) -> Study:
    from tolstat.common.errors import StoreError
    from tolstat.store import ResultStore
    from tolstat.store.recall import recall

    with ResultStore.open(source) as store:
        if store.sampling["method"] != "subset":
            found = "is no file of tolstat rare"
            raise StoreError(str(Fault(str(source), found, "give the study, with --limit and --out")))
        if any(value is not None for value in given):
            raise InputError([Fault(str(source), "has its question in it", "give no option but --workers and --json")])
        return recall(store, path=study_file)


def _summary(found: Found) -> dict[str, Any]:
    import math

    numbers = found.estimate._asdict() | {"as_sure_as": found.as_sure_as, "upper_if_above": found.upper_if_above}
    plain = {name: value if math.isfinite(value) else None for name, value in numbers.items()}
    head = {"load": found.sampling.load, "above": found.sampling.above, "reached": found.reached}
    return head | plain | {"joints": found.joints, "unresolved": found.unresolved}


def _talk(found: Found, path: Path) -> None:
    say(f"{path}: {found.joints} joints, {found.unresolved} of them failed or not settled")
    if found.reached:
        say(f"as sure as {found.as_sure_as:.2g} joints drawn at random")
    if found.unresolved_first and found.sampling.unresolved == "below":
        say(
            f"joints without a valid load are counted below the limit; with all of them above, P is at most "
            f"{found.upper_if_above:.2g}. --unresolved above counts them there"
        )
