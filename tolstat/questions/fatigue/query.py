"""Load cycles of the joints of one campaign, or of several campaigns that make up a duty cycle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.cycles import Cycles, duty_cycle
from tolstat.common.draw_records import check_equal_weights
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import CHANNELS, ERROR_FIELDS, SIMULATED, Status
from tolstat.solver import rainflow
from tolstat.store import ResultStore
from tolstat.store.revolutions import JOINTS_PER_READ, loads
from tolstat.study.fatigue import Fatigue, of_text
from tolstat.study.selection import select


@dataclass(frozen=True)
class Loading:
    """Load cycles of the joints of one campaign or of a duty cycle, and the settings of their evaluation.

    Attributes
    ----------
    name : str
        Name of the study, or of the studies.
    cycles : Cycles
        Cycles of the n joints, without the nominal joint.
    status : ndarray, shape (n,)
        `tables.Status`; with several operating points the first that is not ``OK``.
    nominal : Cycles
        Cycles of the nominal joint; no rows if there is none that settled.
    iid : bool
        Whether the joints are independent samples.
    judged : Fatigue
        Section ``[fatigue]`` of the study; of the first study if there are several.
    """

    name: str
    cycles: Cycles
    status: NDArray[np.uint8]
    nominal: Cycles
    iid: bool
    judged: Fatigue


def channels(patterns: Sequence[str] = ("*.*",)) -> tuple[str, ...]:
    """Names of the channels that any of the patterns selects, in the order of `tables.CHANNELS`.

    Raises
    ------
    InputError
        With every pattern that selects nothing.
    """
    found = {pattern: select(pattern, CHANNELS) for pattern in patterns}
    faults = [
        Fault(f"channel {pattern!r}", "selects nothing", did_you_mean(pattern, list(CHANNELS)[:8]))
        for pattern, names in found.items()
        if not names
    ]
    if faults:
        raise InputError(faults)
    return tuple(name for name in CHANNELS if any(name in names for names in found.values()))


def cycles(store: ResultStore, names: Sequence[str] | None = None, most: int | None = None) -> Cycles:
    """Rainflow cycles of every joint of a campaign.

    Cycles stored by the workers (``histories = "cycles"``) are read. Otherwise they are counted now from the load
    histories, or from the loads restored from harmonics.

    Parameters
    ----------
    store : ResultStore
        The campaign.
    names : sequence of str, optional
        Channels to keep; by default all 64: some 8 kB per joint.
    most : int, optional
        Number of rows to read, from the first; by default all.

    Returns
    -------
    Cycles
        Row i is file slot i; NaN for joints without results.

    Raises
    ------
    StoreError
        When the file holds no histories.
    """
    names = tuple(CHANNELS) if names is None else tuple(names)
    place = [list(CHANNELS).index(name) for name in names]
    n = store.n if most is None else min(most, store.n)
    table = np.empty((n, len(names), rainflow.KEPT, 2), np.float32)
    number = np.empty((n, len(names)))
    simulated = np.isin(store.status(slice(n)), SIMULATED)
    for rows, counted in _counted(store, n):
        table[rows], number[rows] = counted["cycles"][:, place], counted["cycle_count"][:, place]
    table[~simulated], number[~simulated] = np.nan, np.nan
    used = max(1, int(np.max(number, initial=0.0, where=np.isfinite(number))))
    table = table[..., :used, :]
    return Cycles(names, table[..., 0], table[..., 1], number, np.ones(table.shape[2]))


def read(
    paths: Sequence[str | Path],
    shares: Sequence[float] = (1.0,),
    names: Sequence[str] | None = None,
    most: int | None = None,
) -> Loading:
    """Read the cycles of a campaign, or of the same joints in several campaigns that make up a duty cycle.

    Parameters
    ----------
    paths : sequence of str or Path
        Result files, one for each operating point; their joints differ in ``operation.*`` only.
    shares : sequence of float
        Share of the revolutions at each operating point; the sum is 1.
    names : sequence of str, optional
        Channels to keep.
    most : int, optional
        Number of rows of each file to read, from the first; by default all.

    Raises
    ------
    InputError
        When the shares are not shares, or the files hold different joints.
    StoreError
        When a file cannot be read, holds no histories, or lists its joints.
    """
    if len(shares) != len(paths) or min(shares, default=0.0) <= 0 or abs(sum(shares) - 1) > 1e-6:
        found = f"{list(shares)} for {len(paths)} files"
        raise InputError([Fault("shares", found, "give a positive share for each file; their sum is 1")])
    total = sum(shares)
    parts: list[Cycles] = []
    status = np.zeros(0, np.uint8)
    for path in paths:
        with ResultStore.open(path) as store:
            check_equal_weights(store.sampling, store.path)
            if store.sampling["method"] in ("cases", "sweep"):
                remedy = 'give the file of a study with sampling.method "random", "sobol" or "lhs"'
                raise StoreError(str(Fault(str(path), "holds joints that are no sample of a production", remedy)))
            errors, own = store.errors(slice(most)), store.status(slice(most))
            if not parts:
                first, status, sampling = errors, own, store.sampling
                name, judged = store.study_name, of_text(store.study_text, str(path))
            else:
                _check_same_joints(path, errors, paths[0], first)
                status = np.where(status == Status.OK, own, status)
                name += f" + {store.study_name}"
            parts.append(cycles(store, names, most))
    whole = duty_cycle(parts, [share / total for share in shares])
    skip = int(sampling["nominal_first"])
    has_nominal = skip and status[0] == Status.OK
    nominal = _rows(whole, slice(0, 1 if has_nominal else 0))
    return Loading(
        name, _rows(whole, slice(skip, None)), status[skip:], nominal, sampling["method"] == "random", judged
    )


def _rows(whole: Cycles, rows: slice) -> Cycles:
    return whole._replace(ranges=whole.ranges[rows], means=whole.means[rows], number=whole.number[rows])


def _check_same_joints(path: str | Path, errors: NDArray[np.void], other: str | Path, held: NDArray[np.void]) -> None:
    names = [f.name for f in ERROR_FIELDS if not f.name.startswith("operation.")]
    if len(errors) != len(held) or any(not np.array_equal(errors[name], held[name]) for name in names):
        remedy = "run both studies with the same tolerances, sampling.n and sampling.seed"
        raise InputError([Fault(str(path), f"does not hold the joints of {other}", remedy)])


def _counted(store: ResultStore, n: int) -> Iterator[tuple[NDArray[np.intp], dict[str, NDArray[Any]]]]:
    """Yield blocks of file slots below `n` and their cycles, by name of `rainflow.SPECS`."""
    held = store.history_specs
    if not held:
        remedy = 'set histories = "cycles" in [output] of the study and run it anew'
        raise StoreError(str(Fault(str(store.path), "holds neither cycles nor load histories", remedy)))
    for first in range(0, n, JOINTS_PER_READ):
        rows = np.arange(first, min(first + JOINTS_PER_READ, n))
        if "cycles" in held:
            yield rows, {name: store.histories(name, rows) for name in rainflow.SPECS}
            continue
        joints = [rainflow.count(load) for load in loads(store, rows)]
        yield rows, {name: np.stack([joint[name] for joint in joints]) for name in rainflow.SPECS}
