"""Simulate one joint of a campaign again from its result file alone, and compare with the stored results."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.campaign.trace import CaseResult
from tolstat.common.columns import Column
from tolstat.common.errors import Fault, InputError
from tolstat.common.shown import shown
from tolstat.common.tables import Options, Status
from tolstat.solver.compilation import warm_up
from tolstat.solver.simulation import simulate_rows
from tolstat.store import Reader
from tolstat.store.provenance import versions
from tolstat.store.recorded import options_of, parameters


@shown
class Difference(NamedTuple):
    """A value that differs from the stored one.

    Attributes
    ----------
    name : str
        Column of the results, or ``histories/`` and the name of a history.
    stored, now : float
        Stored and new value; for a history those of the sample with the largest difference.
    """

    name: str
    stored: float
    now: float

    @property
    def relative(self) -> float:
        """Difference relative to the larger magnitude of the two; infinite if one is not finite."""
        if not np.isfinite([self.stored, self.now]).all():
            return np.inf
        return abs(self.now - self.stored) / max(abs(self.now), abs(self.stored))


@shown
class Replay(NamedTuple):
    """A joint simulated again.

    Attributes
    ----------
    row : int
        Row of the campaign.
    result : CaseResult
        The joint, with full histories.
    stored : Status
        Status of the joint in the campaign.
    differences : list of Difference
        Values that are not the same to the last bit.
    code : list of str
        Software versions that differ from those that made the file: ``"numpy: 2.1.0 in the file, 2.4.6 now"``.
    """

    row: int
    result: CaseResult
    stored: Status
    differences: list[Difference]
    code: list[str]


def replay(store: Reader, row: int) -> Replay:
    """Simulate a joint of a campaign again and compare with the stored results.

    Parameters
    ----------
    store : Reader
        The result file.
    row : int
        Row of the campaign.

    Returns
    -------
    Replay

    Raises
    ------
    InputError
        When the file has no such row, the row is pending, or this version cannot read the file's joint or options.
    """
    place = str(store.path)
    if row not in store.rows:
        found = f"has rows {store.rows[0]} to {store.rows[-1]}, not {row}"
        raise InputError([Fault(place, found, f"give one of these rows, for example --row {store.rows[0]}")])
    here = slice(store.slot(row), store.slot(row) + 1)
    stored = store.results(here)
    if stored["status"][0] == Status.PENDING:
        raise InputError([Fault(place, f"row {row} is pending", f"simulate it first: tolstat run STUDY --out {place}")])
    params = parameters(store, np.array([here.start]))
    options = options_of(store, here.start)
    warm_up()
    begin = time.perf_counter()
    simulation = simulate_rows(params, options, "full")
    result = CaseResult(simulation, float(params["alpha"][0]), time.perf_counter() - begin, options)
    differences = _different_results(store.columns, stored, simulation.results)
    if store.history_specs:
        differences += _different_histories(store, here.start, params, options)
    now = versions()
    code = [f"{name}: {store.versions.get(name)} in the file, {new} now" for name, new in now.items()]
    changed = [line for line, name in zip(code, now, strict=True) if store.versions.get(name) != now[name]]
    return Replay(row, result, Status(stored["status"][0]), differences, changed)


def _different_results(
    columns: tuple[Column, ...], stored: NDArray[np.void], now: NDArray[np.void]
) -> list[Difference]:
    found = []
    for c in columns:
        before, after = (np.ascontiguousarray(c.of(table)) for table in (stored, now))
        if before.tobytes() != after.tobytes():
            found.append(Difference(c.name, float(before[0]), float(after[0])))
    return found


def _different_histories(store: Reader, row: int, params: NDArray[np.void], options: Options) -> list[Difference]:
    kind: Any = store.identity["output.histories"]
    now = simulate_rows(params, options, kind, store.identity["output.harmonics"]).histories
    found = []
    for name in store.history_specs:
        before = store.histories(name, np.array([row]))
        if before.tobytes() != now[name].tobytes():
            apart = np.nan_to_num(np.abs(before.astype(float) - now[name]), nan=np.inf)
            at = np.unravel_index(np.argmax(apart), apart.shape)
            found.append(Difference(f"histories/{name}", float(before[at]), float(now[name][at])))
    return found
