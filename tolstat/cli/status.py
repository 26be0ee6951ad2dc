"""``tolstat status``: number of joints by status."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import ResultFile, as_text

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tolstat.store import ResultStore


def status(
    file: ResultFile,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
) -> None:
    """Print the number of joints by status.

    Prints one line per status, and the share of joints above each limit so far with its 95 % interval. During a run,
    prints also its rate and the remaining time; reading the file does not disturb the run.

    Example: tolstat status iso2768_f.h5
    """
    from tolstat.store import ResultStore

    with ResultStore.open(file) as store:
        summary = _summary(store)
    lines = [f"{name}: {value}" for name, value in summary.items() if name != "exceedance"]
    lines += [
        "P({load} > {limit:g} {unit}): {estimate} ({lower} to {upper})".format(**e) for e in summary["exceedance"]
    ]
    typer.echo(as_text(summary) if as_json else "\n".join(lines))


def _summary(store: ResultStore) -> dict[str, Any]:
    """Collect the counts and shares, some rows at a time; blocks of pending rows are skipped."""
    import numpy as np

    from tolstat.common.tables import Status
    from tolstat.store import view
    from tolstat.store.reader import BLOCK

    states = np.full(store.n, Status.PENDING, np.uint8)
    loads, units, damaged = {name: np.zeros(store.n) for name in store.limits}, {}, 0
    for first in range(0, store.n, BLOCK):
        rows = slice(first, first + BLOCK)
        written = store.column("results", "status", rows)
        if (written != Status.PENDING).any():
            results = store.results(rows)
            states[rows] = results["status"]
            damaged += int(((written != Status.PENDING) & (states[rows] == Status.PENDING)).sum())
            for name, values in loads.items():
                values[rows], units[name] = view.load(results, name)
    found = np.bincount(states, minlength=len(Status))
    summary: dict[str, Any] = {"study": store.study_name, "joints": store.n}
    summary |= {state.label: int(found[state]) for state in Status}
    condition = {"damaged": damaged, "simulated_again": int((store.attempt() > 0).sum())}
    summary |= {name: count for name, count in condition.items() if count} | _pace(store, summary["pending"])
    judged = {} if store.sampling["method"] == "subset" else units  # joints of its levels are no sample
    summary["exceedance"] = [_exceedance(store, states, name, loads[name], unit) for name, unit in judged.items()]
    return summary


def _pace(store: ResultStore, pending: int) -> dict[str, Any]:
    """Return rate and remaining time of the run in progress, once it has finished joints."""
    session = store.session()
    if session is None:
        return {"running": False}
    done = store.n - pending - session.done
    if done <= 0:
        return {"running": True}
    rate = done / max(time.time() - session.started, 1e-3)
    return {"running": True, "joints_per_s": float(f"{rate:.3g}"), "s_to_go": round(pending / rate)}


def _exceedance(
    store: ResultStore, states: NDArray[np.uint8], name: str, values: NDArray[np.float64], unit: str
) -> dict[str, Any]:
    """Return the share of joints above a limit so far; None for values that are unknown."""
    from tolstat.analysis import exceedance, weighted

    counting = slice(int(store.sampling["nominal_first"] and store.rows.start == 0), None)
    level, iid = store.limits[name], store.sampling["method"] == "random"
    if store.sampling["method"] == "importance":
        share = weighted.at(values[counting], states[counting], store.origin()["weight"][counting], level)
    else:
        share = exceedance.at(values[counting], states[counting], level, 0.95, iid)
    numbers = {key: getattr(share, key) for key in ("estimate", "lower", "upper")}
    rounded = {key: float(f"{value:.3g}") if value == value else None for key, value in numbers.items()}
    return {"load": name, "limit": level, "unit": unit, **rounded}
