"""``tolstat replay``: one joint of a campaign again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tolstat.cli._app import ResultFile, announce_compilation, as_text, say
from tolstat.cli.simulate import case_text, judge, write_trace

if TYPE_CHECKING:
    from tolstat.campaign.replay import Replay


def replay(
    file: ResultFile,
    row: Annotated[int, typer.Option("--row", metavar="I", min=0, help="Row of the campaign: the joint's number.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="CSV", help="Write the trace of the last revolution.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
) -> None:
    """Simulate one joint of a campaign again.

    Its joint, errors and settings are those in FILE. Says whether every stored value comes out the same to the
    last bit, as on the machine and with the versions that made the file it must; exit code 1 if not.
    """
    from tolstat.campaign import replay as replays
    from tolstat.common.files import check_target
    from tolstat.store import ResultStore

    if out is not None:
        check_target(out, file)
    announce_compilation()
    with ResultStore.open(file) as store:
        again = replays.replay(store, row)
    summary = {"row": row, "equal": not again.differences, "differing": [d.name for d in again.differences]}
    summary |= again.result.summary()
    typer.echo(as_text(summary) if as_json else case_text(summary))
    judge(summary, again.result.remedy())
    if out is not None:
        write_trace(again.result, out)
    say(_verdict(again))
    if again.differences:
        raise typer.Exit(1)


def _verdict(again: Replay) -> str:
    if not again.differences:
        return f"row {again.row}: equal to what is stored, bit for bit"
    now = again.result.summary()["status"]
    if again.stored.label != now:
        line = f"row {again.row}: ended as {again.stored.label} in the campaign, as {now} now"
    else:
        d = max(again.differences, key=lambda d: d.relative)
        line = (
            f"row {again.row}: {len(again.differences)} stored values differ, by a relative {d.relative:.2g} at most: "
        )
        line += f"{d.name} {d.stored!r} stored, {d.now!r} now"
    reason = "the versions are those that made the file: another type of machine, or a damaged file"
    return "\n  ".join([line, *(again.code or [reason])])
