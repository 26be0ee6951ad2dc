"""``tolstat rare``: probability of a rare load by subset simulation."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.analysis.prediction import DELIVERY
from tolstat.cli._app import (
    AsJson,
    AtOne,
    Delivery,
    StudyOption,
    Wide,
    Workers,
    announce_compilation,
    as_text,
    print_table,
)
from tolstat.cli._talk import fail, progress, say, wrapped
from tolstat.common.errors import Fault, InputError, gather

if TYPE_CHECKING:
    from tolstat.questions.rare.query import RareEvent
    from tolstat.study import Study


REPEATS = 4
"""Seeds of a simulation, unless another number is given."""


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
        typer.Option(
            "--limit",
            metavar="LIMIT",
            help='"cross1.F > 900 N", "cross*.F > 900 N" or "any limit"; required with STUDY.',
        ),
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
    repeats: Annotated[
        int | None,
        typer.Option(
            "--repeats", metavar="K", min=1, help="Number of seeds, each with a result file of its own; default: 4."
        ),
    ] = None,
    delivery: Delivery = DELIVERY,
    point: AtOne = None,
    study_file: StudyOption = None,
    workers: Workers = None,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Estimate a rare exceedance by subset simulation.

    Estimates P(load > level) down to 1e-9. Each level of the simulation starts from the joints of the previous level
    with the largest loads. What the interval does not cover: tolstat docs rare

    Repeats the simulation with 4 seeds. Prints threshold and share of each level (of the first seed), the probability
    with its 95 % interval from all seeds, whether they agree, and from how many joints of level 0 the joints above the
    limit descend: few of these, or seeds that disagree, tell of ways to the limit that were missed. Writes the joints
    of each seed to a result file. To resume after an interruption, run the same command again.

    Example: tolstat rare studies/iso2768_f.toml --limit "cross1.F > 5 kN"
    """
    from tolstat.campaign import run as campaign
    from tolstat.campaign.pool import WorkerDied
    from tolstat.display import text
    from tolstat.questions.rare import query as simulation
    from tolstat.questions.rare import rendering as tables

    given = {"n": n, "p0": p0, "seed": seed, "unresolved": None if unresolved is None else unresolved.value}
    given = {name: value for name, value in given.items() if value is not None}
    if source.suffix == ".toml":
        plan, path = _read_study(source, limit, point, given), out or Path(f"{source.stem}_rare.h5")
    else:
        plan, path, repeats = _recall(source, study_file, [limit, out, point, repeats, *given.values()]), source, 1
    announce_compilation()
    try:
        with progress("levels of the subset simulation") as shown:
            found = simulation.repeated(plan, path, repeats or REPEATS, workers, shown.note, shown)
    except campaign.Interrupted as stop:
        fail(str(stop))
        raise typer.Exit(stop.exit_code) from stop
    except WorkerDied as error:
        fail(f"error: {error}")
        raise typer.Exit(1) from error
    levels = [tables.table(one.levels, one.sampling.limit) for one in found]
    if as_json:
        estimate, agree = tables.together([one.estimate for one in found])
        numbers = {name: value if math.isfinite(value) else None for name, value in estimate._asdict().items()}
        seeds = [_summary(one, delivery) | {"levels": text.records(t)} for one, t in zip(found, levels, strict=True)]
        typer.echo(as_text(numbers | {"agree": agree, "seeds": seeds}))
    else:
        print_table(tables.LEVELS, levels[0], wide)
        typer.echo("\n".join(wrapped(line) for line in tables.of_seeds(found, delivery).splitlines()))
    for k, one in enumerate(found):
        _print_messages(one, path.with_name(f"{path.stem}_{k + 1}{path.suffix}") if k else path)


def _read_study(source: Path, limit: str | None, point: str | None, given: dict[str, Any]) -> Study:
    from tolstat import study
    from tolstat.common.loads import ANY_LIMIT
    from tolstat.questions.rare.query import parse_limit, subset_study

    faults: list[Fault] = []
    if limit is None:
        faults.append(Fault("--limit", "is missing", 'add --limit "cross1.F > 900 N"'))
    else:
        if limit.split() != ANY_LIMIT.split():
            with gather(faults):
                parse_limit(limit, {})
    with gather(faults):
        plan = study.load(source).at(point or "")
    if faults or limit is None:
        raise InputError(faults)
    return subset_study(plan, limit, **given)


def _recall(source: Path, study_file: Path | None, given: list[Any]) -> Study:
    from tolstat.common.errors import StoreError
    from tolstat.store import ResultFile

    with ResultFile.open(source) as store:
        if store.sampling["method"] != "subset":
            found = "is not a result file of tolstat rare"
            remedy = 'give the study: tolstat rare STUDY --limit "cross1.F > 900 N" --out FILE'
            raise StoreError(str(Fault(str(source), found, remedy)))
        if any(value is not None for value in given):
            found = "already holds limit and settings of its simulation"
            raise InputError([Fault(str(source), found, f"resume it with: tolstat rare {source}")])
        return store.view(study_file).study


def _summary(found: RareEvent, delivery: int) -> dict[str, Any]:
    numbers = found.estimate._asdict() | {"as_sure_as": found.as_sure_as, "upper_if_above": found.upper_if_above}
    plain = {name: value if math.isfinite(value) else None for name, value in numbers.items()}
    head = {"load": found.sampling.load, "above": found.sampling.limit.level, "reached": found.reached}
    counts = {"joints": found.joints, "unresolved": found.unresolved, "ancestors": found.ancestors}
    return head | plain | counts | {"numerical": found.numerical, "delivery": found.delivery(delivery)}


def _print_messages(found: RareEvent, path: Path) -> None:
    from tolstat.store.error_budget import command

    if found.numerical is None:
        say(command(path, str(found.sampling.limit)))
    say(f"{path}: {found.joints} joints, {found.unresolved} of them failed or not settled")
    if found.reached:
        say(f"the estimate is as precise as that from {found.as_sure_as:.2g} random joints")
    if found.unresolved_first and found.sampling.unresolved == "below":
        say(
            "joints without a valid load count as below the level; if all of them were above, P would be at most "
            f"{found.upper_if_above:.2g} (--unresolved above counts them as above)"
        )
