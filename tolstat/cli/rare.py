"""``tolstat rare``: probability of a rare load by subset simulation."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import AsJson, AtOne, StudyOption, Wide, Workers, announce_compilation, as_text, print_table
from tolstat.cli._talk import fail, progress, say, wrapped
from tolstat.common.errors import Fault, InputError, gather

if TYPE_CHECKING:
    from tolstat.questions.rare.query import RareEvent
    from tolstat.study import Study


class Side(StrEnum):
    """Where a joint without a valid load is counted."""

    ABOVE = "above"
    BELOW = "below"


def rare(
    source: Annotated[
        Path,
        typer.Argument(metavar="STUDY|FILE", help="Study file (TOML), or result file of tolstat rare to resume."),
    ],
    limit: Annotated[
        str | None,
        typer.Option("--limit", metavar="LIMIT", help='Load and level: "cross1.F > 900 N"; required with STUDY.'),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="Result file; default: STUDY_rare.h5 in the current folder."),
    ] = None,
    n: Annotated[
        int | None, typer.Option("--n", metavar="N", min=20, help="Number of joints per level; default: 1000.")
    ] = None,
    p0: Annotated[
        float | None,
        typer.Option("--p0", metavar="P", help="Share of joints carried to the next level, up to 0.5; default: 0.1."),
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", metavar="S", min=0, help="Seed of all draws; default: that of the study.")
    ] = None,
    unresolved: Annotated[
        Side | None,
        typer.Option(
            "--unresolved",
            help="Whether failed and unsettled joints count as above or below the level; default: below.",
        ),
    ] = None,
    point: AtOne = None,
    study_file: StudyOption = None,
    workers: Workers = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Estimate a rare exceedance by subset simulation.

    Estimates P(load > level) down to 1e-9. Each level of the simulation starts from the joints of the previous level
    with the largest loads. What the interval does not cover: tolstat docs rare

    Prints threshold and share of each level, and the probability with its 95 % interval. Writes all joints to a result
    file. To resume after an interruption, run the same command again.

    Example: tolstat rare studies/iso2768_f.toml --limit "cross1.F > 5 kN"
    """
    from tolstat.campaign import run as campaign
    from tolstat.campaign.executors import WorkerDied
    from tolstat.display import text
    from tolstat.questions.rare import query as simulation
    from tolstat.questions.rare import rendering as tables

    given = {"n": n, "p0": p0, "seed": seed, "unresolved": None if unresolved is None else unresolved.value}
    given = {name: value for name, value in given.items() if value is not None}
    if source.suffix == ".toml":
        plan, path = _read_study(source, limit, point, given), out or Path(f"{source.stem}_rare.h5")
    else:
        plan, path = _recall(source, study_file, [limit, out, point, *given.values()]), source
    announce_compilation()
    try:
        with progress("levels of the subset simulation") as shown:
            found = simulation.run(plan, path, workers, shown.note, shown)
    except campaign.Interrupted as stop:
        fail(str(stop))
        raise typer.Exit(stop.exit_code) from stop
    except WorkerDied as error:
        fail(f"error: {error}")
        raise typer.Exit(1) from error
    sampling = found.sampling
    levels = tables.table(found.levels, sampling.load)
    if as_json:
        typer.echo(as_text(_summary(found) | {"levels": text.records(levels)}))
    else:
        print_table(tables.LEVELS, levels, wide)
        typer.echo(wrapped(tables.sentence(found.estimate, sampling.load, sampling.above)))
    _print_messages(found, path)


def _read_study(source: Path, limit: str | None, point: str | None, given: dict[str, Any]) -> Study:
    from tolstat import study
    from tolstat.questions.rare.query import parse_limit, subset_study

    faults: list[Fault] = []
    if limit is None:
        faults.append(Fault("--limit", "is missing", 'add --limit "cross1.F > 900 N"'))
    else:
        with gather(faults):
            parse_limit(limit)
    with gather(faults):
        plan = study.load(source).at(point or "")
    if faults or limit is None:
        raise InputError(faults)
    return subset_study(plan, limit, **given)


def _recall(source: Path, study_file: Path | None, given: list[Any]) -> Study:
    from tolstat.common.errors import StoreError
    from tolstat.store import Reader

    with Reader.open(source) as store:
        if store.sampling["method"] != "subset":
            found = "is not a result file of tolstat rare"
            remedy = 'give the study: tolstat rare STUDY --limit "cross1.F > 900 N" --out FILE'
            raise StoreError(str(Fault(str(source), found, remedy)))
        if any(value is not None for value in given):
            found = "already holds limit and settings of its simulation"
            raise InputError([Fault(str(source), found, f"resume it with: tolstat rare {source}")])
        return store.view(study_file).study


def _summary(found: RareEvent) -> dict[str, Any]:
    import math

    numbers = found.estimate._asdict() | {"as_sure_as": found.as_sure_as, "upper_if_above": found.upper_if_above}
    plain = {name: value if math.isfinite(value) else None for name, value in numbers.items()}
    head = {"load": found.sampling.load, "above": found.sampling.above, "reached": found.reached}
    return head | plain | {"joints": found.joints, "unresolved": found.unresolved}


def _print_messages(found: RareEvent, path: Path) -> None:
    say(f"{path}: {found.joints} joints, {found.unresolved} of them failed or not settled")
    if found.reached:
        say(f"the estimate is as precise as that from {found.as_sure_as:.2g} random joints")
    if found.unresolved_first and found.sampling.unresolved == "below":
        say(
            "joints without a valid load count as below the level; if all of them were above, P would be at most "
            f"{found.upper_if_above:.2g} (--unresolved above counts them as above)"
        )
