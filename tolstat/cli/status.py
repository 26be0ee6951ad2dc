"""``tolstat status``: number of joints by status."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
import typer
from numpy.typing import NDArray

from tolstat.campaign.remedy import reasons
from tolstat.cli._output import print_json, print_table
from tolstat.cli._talk import progress, wrapped
from tolstat.common.errors import Fault, StoreError
from tolstat.common.loads import load_of
from tolstat.common.tables import Status, worst_status
from tolstat.display import text
from tolstat.display.answer import plain
from tolstat.display.options import AsJson, ResultPath, Wide
from tolstat.display.progress import clock
from tolstat.display.table import Column
from tolstat.store import ResultFile, verification, what_if

SHARES = (
    Column("load > limit", lambda row: text.limit({**row, "level": row["limit"]})),
    Column("above", lambda row: f"{row['above']} of {row['of']}"),
    Column("share", lambda row: text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["lower"], row["upper"])),
)
"""Columns of the shares above the limits so far."""


def status(file: ResultPath, *, check: bool = False, wide: Wide = False, as_json: AsJson = False) -> None:
    """Print the number of joints by status.

    Prints the number of joints, why joints have no valid load and what to do, and the share of joints above each limit
    so far with its 95 % interval. During a run, prints also its rate and the remaining time; reading the file does not
    disturb the run. Of several operating points the worst status of a joint counts, and each has a line of its own.
    With --json, prints the number of every status.

    With --check, says whether all numbers in the file are as they were written: what is damaged, or that results are
    unchecked because a run is under way or was killed.

    Example: tolstat status iso2768_f.h5

    Parameters
    ----------
    check : bool
        Compare all that is in the file with its checksums; exit code 2 if damaged.
    """
    with progress("reading the file"), ResultFile.open(file) as store:
        states = {one.point or "": one.status() for one in store.each()}
        facts, shares = _facts(store, states), _shares(store)
        if check:
            facts["checked"] = _checked(store)
        why = reasons(store, states)
    if as_json:
        causes = {
            f"{r.status.label} at {r.point}" if r.point else r.status.label: {"row": r.row, "remedy": r.remedy}
            for r in why
        }
        checked = {"checked": facts.pop("checked")} if check else {}
        print_json(plain(facts | {"exceedance": shares} | checked | {"causes": causes}))
        return
    typer.echo(_text(facts))
    for reason in why:
        typer.echo(wrapped(reason.text))
    if shares:
        typer.echo()
        print_table(SHARES, shares, wide)


def _facts(store: ResultFile, states: dict[str, NDArray[np.uint8]]) -> dict[str, Any]:
    """Study, counts by status, in all and by point, and the pace of the run under way; `states` by point."""
    counts = {point: _counts(own) for point, own in states.items()}
    facts: dict[str, Any] = {"study": store.study_name, "joints": store.n}
    facts |= _counts(worst_status(list(states.values())))
    if len(states) > 1:
        facts["points"] = {point: {label: n for label, n in own.items() if n} for point, own in counts.items()}
    pending = sum(own[Status.PENDING.label] for own in counts.values())
    written = sum(int((one.column("results", "status", slice(None)) == Status.PENDING).sum()) for one in store.each())
    again = sum(int((one.attempt() > 0).sum()) for one in store.each())
    condition = {"damaged": pending - written, "simulated_again": again}
    facts |= {name: number for name, number in condition.items() if number}
    session = store.session()
    facts["running"] = session is not None
    if session is not None and (done := len(states) * store.n - pending - session.done) > 0:
        rate = done / max(time.time() - session.started, 1e-3)
        facts |= {"joints_per_s": float(f"{rate:.3g}"), "s_to_go": round(pending / rate)}
    return facts


def _counts(states: NDArray[np.uint8]) -> dict[str, int]:
    numbers = np.bincount(states, minlength=max(Status) + 1)
    return {state.label: int(numbers[state]) for state in Status}


def _shares(store: ResultFile) -> list[dict[str, Any]]:
    """Share of the joints above each limit so far; joints of a subset simulation are no sample."""
    view = store.view()
    rows: list[dict[str, Any]] = []
    for name, limit in view.limits.items() if view.method != "subset" else ():
        load = view.load(name)
        share = load.above(limit)
        if share.n:
            above = {"above": share.count, "of": share.n - share.n_failed - share.n_unsettled}
            numbers = {key: _rounded(getattr(share, key)) for key in ("estimate", "lower", "upper")}
            rows.append({"load": name, "limit": limit, "unit": load_of(name).unit} | above | numbers)
    return rows


def _rounded(share: float) -> float:
    return share if math.isnan(share) else float(f"{share:.3g}")


def _text(facts: dict[str, Any]) -> str:
    """Counts and pace as lines; statuses without joints are left out."""
    lines = [f"study: {facts['study']}", f"joints: {facts['joints']}"]
    lines += [f"{state.label}: {facts[state.label]}" for state in Status if facts[state.label]]
    for point, counts in facts.get("points", {}).items():
        lines.append(f"at {point}: {', '.join(f'{count} {label}' for label, count in counts.items())}")
    lines += [f"{name}: {facts[name]}" for name in ("damaged", "simulated_again") if name in facts]
    if "checked" in facts:
        unchecked = "errors match; results have none while a run is under way, or after one that was killed"
        lines.append(f"checksums: {'all match' if facts['checked'] else unchecked}")
    pace = ""
    if "joints_per_s" in facts:
        pace = f", {facts['joints_per_s']:g} joints/s, {clock(facts['s_to_go'])} left"
    return "\n".join([*lines, f"running: {'yes' if facts['running'] else 'no'}{pace}"])


def _checked(store: ResultFile) -> bool:
    """Whether all results have checksums, which match.

    Raises
    ------
    StoreError
        With everything that does not match its checksum.
    """
    integrity = store.check()
    faults = [f"{path} of rows {', '.join(rows)}" for path, rows in integrity.damaged.items()]
    altered = what_if.damaged(store)
    faults += [f"what_if: {altered} {'change' if altered == 1 else 'changes'}"] * bool(altered)
    if faults:
        remedy = "simulate joints with damaged results again: tolstat run STUDY; for damaged errors restore a copy"
        raise StoreError(str(Fault(str(store.path), "\n    ".join(["is damaged:", *faults]), remedy)))
    for one in store.each():
        for name in (verification.VERIFY, verification.NEAR):
            verification.read(one, name)
    return integrity.checked
