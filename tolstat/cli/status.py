"""``tolstat status``: number of joints by status."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tolstat.cli._app import ResultFile, as_text

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from tolstat.store import Reader


def status(
    file: ResultFile,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of text.")] = False,
) -> None:
    """Print the number of joints by status.

    Prints one line per status, and the share of joints above each limit so far with its 95 % interval. During a run,
    prints also its rate and the remaining time; reading the file does not disturb the run.

    Example: tolstat status iso2768_f.h5
    """
    from tolstat.store import Reader

    with Reader.open(file) as store:
        summary = _summary(store)
    lines = [f"{name}: {value}" for name, value in summary.items() if name != "exceedance"]
    lines += [
        "P({load} > {limit:g} {unit}): {estimate} ({lower} to {upper})".format(**e) for e in summary["exceedance"]
    ]
    typer.echo(as_text(summary) if as_json else "\n".join(lines))


def _summary(store: Reader) -> dict[str, Any]:
    """Collect the counts and shares, some rows at a time; blocks of pending rows are skipped."""
    import numpy as np

    from tolstat.common.loads import LOADS
    from tolstat.common.tables import Status
    from tolstat.store.result_file import BLOCK

    states, damaged = np.full(store.n, Status.PENDING, np.uint8), 0
    limits = {} if store.sampling["method"] == "subset" else store.limits  # whose joints are no sample
    loads = {name: np.full((3, store.n), np.nan) for name in limits}
    for first in range(0, store.n, BLOCK):
        slots = slice(first, first + BLOCK)
        written = store.column("results", "status", slots)
        if (written != Status.PENDING).any():
            results = store.results(slots)
            states[slots] = results["status"]
            damaged += int(((written != Status.PENDING) & (states[slots] == Status.PENDING)).sum())
            for name, values in loads.items():
                values[:, slots] = LOADS[name].of(results), *LOADS[name].ends(results)
    found = np.bincount(states, minlength=len(Status))
    summary: dict[str, Any] = {"study": store.study_name, "joints": store.n}
    summary |= {state.label: int(found[state]) for state in Status}
    condition = {"damaged": damaged, "simulated_again": int((store.attempt() > 0).sum())}
    summary |= {name: count for name, count in condition.items() if count} | _pace(store, summary["pending"])
    done = summary["pending"] < store.n
    summary["exceedance"] = [_exceedance(store, states, name, loads[name]) for name in loads if done]
    return summary


def _pace(store: Reader, pending: int) -> dict[str, Any]:
    """Return rate and remaining time of the run in progress, once it has finished joints."""
    session = store.session()
    if session is None:
        return {"running": False}
    done = store.n - pending - session.done
    if done <= 0:
        return {"running": True}
    rate = done / max(time.time() - session.started, 1e-3)
    return {"running": True, "joints_per_s": float(f"{rate:.3g}"), "s_to_go": round(pending / rate)}


def _exceedance(store: Reader, states: NDArray[np.uint8], name: str, values: NDArray[np.float64]) -> dict[str, Any]:
    """Share of the joints above a limit so far, from loads and their ends, (3, n); None without an estimate."""
    from tolstat.common.loads import UNIT_OF_LOAD
    from tolstat.store.sample_load import SampleLoad

    samples, method = slice(store.first_sample, None), store.sampling["method"]
    weights = store.origin()["weight"][samples] if method == "importance" else None
    limit, unit = store.limits[name], UNIT_OF_LOAD[name]
    own, lower, upper = values[:, samples]
    iid = method in ("random", "importance")
    load = SampleLoad(name, unit, limit, float("nan"), own, (lower, upper), states[samples], weights, iid)
    share = load.above(limit)
    numbers = {key: getattr(share, key) for key in ("estimate", "lower", "upper")}
    rounded = {key: float(f"{value:.3g}") if value == value else None for key, value in numbers.items()}
    return {"load": name, "limit": limit, "unit": unit, **rounded}
