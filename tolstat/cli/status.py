"""``tolstat status``: number of joints by status."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import AsJson, ResultPath, Wide, as_text, print_table
from tolstat.cli._talk import progress, wrapped

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tolstat.store import Reader


def status(
    file: ResultPath,
    check: Annotated[
        bool,
        typer.Option("--check", help="Compare all that is in the file with its checksums; exit code 2 if damaged."),
    ] = False,
    wide: Wide = False,
    as_json: AsJson = False,
) -> None:
    """Print the number of joints by status.

    Prints the number of joints, why joints have no valid load and what to do, and the share of joints above each limit
    so far with its 95 % interval. During a run, prints also its rate and the remaining time; reading the file does not
    disturb the run. Of several operating points the worst status of a joint counts, and each has a line of its own.
    With --json, prints the number of every status.

    With --check, says whether all numbers in the file are as they were written: what is damaged, or that results are
    unchecked because a run is under way or was killed.

    Example: tolstat status iso2768_f.h5
    """
    from tolstat.campaign.remedy import reasons
    from tolstat.store import ResultFile

    with progress("reading the file"), ResultFile.open(file) as store:
        summary, states = _summary(store)
        if check:
            summary["checked"] = _checked(store)
        why = reasons(store, states)
    if as_json:
        causes = {
            f"{r.status.label} at {r.point}" if r.point else r.status.label: {"row": r.row, "remedy": r.remedy}
            for r in why
        }
        typer.echo(as_text(summary | {"causes": causes}))
        return
    typer.echo(_text(summary))
    for reason in why:
        typer.echo(wrapped(reason.text))
    if summary["exceedance"]:
        _print_shares(summary["exceedance"], wide)


def _text(summary: dict[str, Any]) -> str:
    """Counts and pace as lines; statuses without joints are left out."""
    from tolstat.common.tables import Status
    from tolstat.display.progress import clock

    found = {state.label: summary[state.label] for state in Status if summary[state.label]}
    lines = [f"study: {summary['study']}", f"joints: {summary['joints']}"]
    lines += [f"{name}: {count}" for name, count in found.items()]
    for point, numbers in summary.get("points", {}).items():
        lines.append(f"at {point}: {', '.join(f'{count} {name}' for name, count in numbers.items())}")
    lines += [f"{name}: {summary[name]}" for name in ("damaged", "simulated_again") if name in summary]
    if "checked" in summary:
        unchecked = "errors match; results have none while a run is under way, or after one that was killed"
        lines.append(f"checksums: {'all match' if summary['checked'] else unchecked}")
    pace = ""
    if "joints_per_s" in summary:
        pace = f", {summary['joints_per_s']:g} joints/s, {clock(summary['s_to_go'])} left"
    return "\n".join([*lines, f"running: {'yes' if summary['running'] else 'no'}{pace}"])


def _checked(store: Reader) -> bool:
    """Whether all results have checksums, which match.

    Raises
    ------
    StoreError
        With everything that does not match its checksum.
    """
    from tolstat.common.errors import Fault, StoreError
    from tolstat.store import verification, what_if

    found = store.check()
    faults = [f"{path} of rows {', '.join(rows)}" for path, rows in found.damaged.items()]
    altered = what_if.damaged(store)
    faults += [f"what_if: {altered} {'change' if altered == 1 else 'changes'}"] * bool(altered)
    if faults:
        remedy = "simulate joints with damaged results again: tolstat run STUDY; for damaged errors restore a copy"
        raise StoreError(str(Fault(str(store.path), "\n    ".join(["is damaged:", *faults]), remedy)))
    for one in store.each():
        for name in (verification.VERIFY, verification.NEAR):
            verification.read(one, name)
    return found.checked


def _print_shares(shares: list[dict[str, Any]], wide: bool) -> None:
    from tolstat.display import text
    from tolstat.display.table import Column

    unknown = float("nan")
    rows = [{key: unknown if value is None else value for key, value in row.items()} for row in shares]
    columns = (
        Column("load > limit", lambda row: text.limit({**row, "level": row["limit"]})),
        Column("above", lambda row: f"{row['above']} of {row['of']}"),
        Column("share", lambda row: text.percent(row["estimate"])),
        Column("95 % interval", lambda row: text.span(row["lower"], row["upper"])),
    )
    typer.echo()
    print_table(columns, rows, wide)


def _summary(store: Reader) -> tuple[dict[str, Any], dict[str, NDArray[np.uint8]]]:
    """Collect counts and shares, some rows at a time; blocks of pending rows are skipped. Also the states by point."""
    import numpy as np

    from tolstat.common.loads import load_of, split
    from tolstat.common.tables import Status, worst_status
    from tolstat.store import worst
    from tolstat.store.hdf5 import BLOCK
    from tolstat.study.points import names_of

    each = {one.point or "": one for one in store.each()}
    states, damaged = {point: np.full(store.n, Status.PENDING, np.uint8) for point in each}, 0
    limits = {} if store.sampling["method"] == "subset" else store.limits  # whose joints are no sample
    loads = {name: np.full((3, store.n), np.nan) for name in limits}
    worst_states = {name: np.full(store.n, Status.PENDING, np.uint8) for name in limits}
    at = {name: names_of(split(name)[1], list(each), str(store.path)) for name in limits}
    for first in range(0, store.n, BLOCK):
        slots = slice(first, first + BLOCK)
        results = {}
        for point, one in each.items():
            written = one.column("results", "status", slots)
            if (written != Status.PENDING).any():
                results[point] = one.results(slots)
                states[point][slots] = results[point]["status"]
                damaged += int(((written != Status.PENDING) & (states[point][slots] == Status.PENDING)).sum())
        for name, values in loads.items():
            if all(point in results for point in at[name]):
                own, state, inexact = worst.load_of([results[point] for point in at[name]], load_of(name))
                values[:, slots] = own.values, *inexact.of(np.arange(len(state)), own.values)
                worst_states[name][slots] = state
    found = np.bincount(worst_status(list(states.values())), minlength=max(Status) + 1)
    summary: dict[str, Any] = {"study": store.study_name, "joints": store.n}
    summary |= {state.label: int(found[state]) for state in Status}
    if len(each) > 1:
        counts = {point: np.bincount(own, minlength=max(Status) + 1) for point, own in states.items()}
        summary["points"] = {p: {s.label: int(own[s]) for s in Status if own[s]} for p, own in counts.items()}
    again = sum(int((one.attempt() > 0).sum()) for one in each.values())
    condition = {"damaged": damaged, "simulated_again": again}
    pending = sum(int((own == Status.PENDING).sum()) for own in states.values())
    summary |= {name: count for name, count in condition.items() if count} | _pace(store, len(each), pending)
    known = [name for name in loads if (worst_states[name] != Status.PENDING).any()]
    summary["exceedance"] = [_exceedance(store, worst_states[name], name, loads[name]) for name in known]
    return summary, states


def _pace(store: Reader, points: int, pending: int) -> dict[str, Any]:
    """Return rate and remaining time of the run in progress, once it has finished joints at any point."""
    session = store.session()
    if session is None:
        return {"running": False}
    done = points * store.n - pending - session.done
    if done <= 0:
        return {"running": True}
    rate = done / max(time.time() - session.started, 1e-3)
    return {"running": True, "joints_per_s": float(f"{rate:.3g}"), "s_to_go": round(pending / rate)}


def _exceedance(store: Reader, states: NDArray[np.uint8], name: str, values: NDArray[np.float64]) -> dict[str, Any]:
    """Share of the joints above a limit so far, from loads and their ends, (3, n); None without an estimate."""
    from tolstat.analysis.sample import Sample
    from tolstat.common.loads import load_of
    from tolstat.common.tables import Status
    from tolstat.store.view import design_of

    samples = slice(store.first_sample, None)
    weights = store.origin()["weight"][samples] if store.sampling["method"] == "importance" else None
    limit, unit = store.limits[name], load_of(name).unit
    own, *ends = values[:, samples]
    design = design_of(store, weights, Status.PENDING in states[samples])
    load = Sample.of(own, states[samples], design, (ends[0], ends[1]))
    share = load.above(limit)
    numbers = {key: getattr(share, key) for key in ("estimate", "lower", "upper")}
    rounded = {key: float(f"{value:.3g}") if value == value else None for key, value in numbers.items()}
    joints = {"above": share.count, "of": share.n - share.n_failed - share.n_unsettled}
    return {"load": name, "limit": limit, "unit": unit, **joints, **rounded}
