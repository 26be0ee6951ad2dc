"""``tolstat worst``: the joints with the largest load."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import ResultFile, StudyOption, as_text, say

if TYPE_CHECKING:
    from tolstat.questions.causes.tail import Tail

ERRORS_SHOWN = 5
"""Number of errors per joint in the table; ``--json`` gives all."""


def worst(
    file: ResultFile,
    by: Annotated[
        str, typer.Option("--by", metavar="LOAD", help="Load (cross1.F, pin2.contact, psi) or column of the results.")
    ],
    n: Annotated[int, typer.Option("--n", metavar="N", min=1, help="Number of joints to list.")] = 10,
    study_file: StudyOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON with all errors instead of a table.")] = False,
) -> None:
    """List the joints with the largest load and their errors.

    Prints row, load and status of each joint, and its largest errors in sigma: the standard normal score that has the
    same probability as the error in its own distribution.

    Example: tolstat worst iso2768_f.h5 --by cross1.F --n 20
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
    say(f"to simulate one of them again: tolstat replay {file} --row ROW --out trace.csv")


def _table(found: Tail, by: str) -> str:
    from tolstat.display.text import align

    unit = f" [{found.unit}]" if found.unit != "1" else ""
    rows = [["row", f"{by}{unit}", "status", "errors in sigma, largest first"]]
    for joint in found.joints:
        shown = [f"{name} {z:+.2f}" for name, z in list(joint.scores.items())[:ERRORS_SHOWN]]
        rows.append([str(joint.row), f"{joint.value:.6g}", joint.status.label, "  ".join(shown) or "-"])
    return align(rows, text_last=True)
