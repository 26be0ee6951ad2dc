"""``tolstat replay``: simulate one joint of a campaign again."""

from __future__ import annotations

from typing import Annotated

import typer

from tolstat.campaign import replay as replays
from tolstat.campaign.replay import Replay
from tolstat.cli._talk import progress, say
from tolstat.cli.simulate import deliver
from tolstat.common.files import check_target
from tolstat.display.options import AsJson, Opt, Point, ResultPath, Trace
from tolstat.solver import compilation
from tolstat.store import ResultFile


def replay(
    file: ResultPath,
    *,
    row: Annotated[int, Opt("I", least=0)],
    out: Trace = None,
    point: Point = None,
    as_json: AsJson = False,
) -> None:
    """Simulate one joint again and compare with the file.

    Uses the joint, errors and settings stored in FILE. Prints the largest value of each load, and whether all stored
    values are identical to the last bit, as they must be on the same machine with the same versions. If they
    differ, prints the versions that differ and ends with exit code 1.

    Example: tolstat replay iso2768_f.h5 --row 17 --out trace.csv

    Parameters
    ----------
    row : int
        Row of the joint in the campaign, from 0.
    point : str, optional
        Operating point, such as cruise; needed if FILE has several.
    """
    if out is not None:
        check_target(out, file)
    compilation.announce()
    with progress("simulation"), ResultFile.open(file) as store:
        again = replays.replay(store.at(point) if point else store, row)
    facts = {"row": row, "equal": not again.differences, "differing": [d.name for d in again.differences]}
    deliver(again.result, facts, out, as_json)
    say(_verdict(again))
    if again.differences:
        raise typer.Exit(1)


def _verdict(again: Replay) -> str:
    if not again.differences:
        return f"row {again.row}: identical to the stored results, bit for bit"
    now = again.result.summary()["status"]
    if again.stored.label != now:
        line = f"row {again.row}: status {again.stored.label} in the campaign, {now} now"
    else:
        d = max(again.differences, key=lambda d: d.relative)
        line = (
            f"row {again.row}: {len(again.differences)} values differ, largest relative difference {d.relative:.2g}: "
        )
        line += f"{d.name} {d.stored!r} stored, {d.now!r} now"
    reason = "all versions are those that made the file: the machine is of another type, or the file is damaged"
    return "\n  ".join([line, *(again.code or [reason])])
