"""``tolstat worst``: the joints behind the tail."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import ResultFile, as_text, say
from tolstat.cli.extend import StudyFile

if TYPE_CHECKING:
    from tolstat.questions.causes.tail import Tail

SHOWN = 5
"""Errors of a joint that the table shows; ``--json`` gives all."""


def worst(
    file: ResultFile,
    by: Annotated[str, typer.Option("--by", metavar="LOAD", help="cross1.F, pin2.contact, psi, or a result column.")],
    n: Annotated[int, typer.Option("--n", metavar="N", min=1, help="How many joints.")] = 10,
    study_file: StudyFile = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, with all errors, instead of a table.")] = False,
) -> None:
    """List the joints with the largest load and the errors that made them so.

    Errors are given in sigma: where in its own distribution each lies, as the standard score of the same probability,
    the largest first.
    """
    from tolstat.questions.causes import tail
    from tolstat.store import ResultStore

    with ResultStore.open(file) as store:
        found = tail.worst(store, by, n, study_file)
    if as_json:
        joints: list[dict[str, Any]] = [j._asdict() | {"status": j.status.label} for j in found.joints]
        typer.echo(as_text({"by": by, "unit": found.unit, "joints": joints}))
        return
    typer.echo(_table(found, by))
    say(f"replay one with: tolstat replay {file} --row ROW --out trace.csv")


def _table(found: Tail, by: str) -> str:
    from tolstat.display.text import align

    unit = f" [{found.unit}]" if found.unit != "1" else ""
    rows = [["row", f"{by}{unit}", "status", "errors in sigma, the largest first"]]
    for joint in found.joints:
        shown = [f"{name} {z:+.2f}" for name, z in list(joint.scores.items())[:SHOWN]]
        rows.append([str(joint.row), f"{joint.value:.6g}", joint.status.label, "  ".join(shown) or "-"])
    return align(rows, text_last=True)
