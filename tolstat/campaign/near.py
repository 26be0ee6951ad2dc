"""Verify the joints nearest to a limit: their numerical error decides how far the share above it moves."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.accuracy import LEAST_NEAR
from tolstat.campaign import verify
from tolstat.campaign.checks import QUICK_CHECKS, Progress, no_progress
from tolstat.common import selected_results
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.loads import LOADS, Limit, load_of, split
from tolstat.common.tables import Status
from tolstat.store import Reader, Writer, recorded, verification, worst
from tolstat.store.verification import Check, Verification
from tolstat.study import rule

EXAMPLE = 'write --near "cross1.F > 700 N", or --near "any limit"'


def nearest(store: Reader, limit: Limit, joints: int) -> NDArray[np.intp]:
    """File slots of the settled joints whose loads are nearest to a limit, ascending: so many for each load of it."""
    slots = np.arange(store.first_sample, store.n)
    results = store.results(slice(store.first_sample, None))
    settled = results["status"] == Status.OK
    found: set[int] = set()
    for name, level in zip(limit.loads, limit.levels, strict=True):
        plain, points = split(name)
        if points and store.point not in points.split("+"):
            continue
        distance = np.where(settled, np.abs(LOADS[plain].of(results) - level), np.inf)
        order = np.argsort(distance, kind="stable")[:joints]
        found |= set(slots[order[np.isfinite(distance[order])]].tolist())
    return np.array(sorted(found), dtype=np.intp)


def check_near(
    path: Path,
    text: str,
    joints: int | str = LEAST_NEAR,
    names: Iterable[str] = QUICK_CHECKS,
    on_start: Callable[[], None] = lambda: None,
    workers: int = 1,
    progress: Progress = no_progress,
) -> Verification:
    """Check the joints of a result file nearest to a limit, and add the checks to those that the file holds.

    Parameters
    ----------
    path : Path
        The file.
    text : str
        ``"cross*.F > 700 N"``, or ``"any limit"``.
    joints : int
        Number of joints for each load of the limit, at least `LEAST_NEAR`.
    names : iterable of str
        As in `checks.run_checks`, the same at each call.
    on_start, workers, progress
        As in `verify.check_file`.

    Returns
    -------
    Verification
        All verified joints near limits of the file.

    Raises
    ------
    InputError
        With every fault of limit and number.
    StoreError
        As `verify.check_file`, or when too few joints are settled.
    """
    number = verify.parse_joints(joints)
    if number is None or number < LEAST_NEAR:
        found = f"{joints} joints do not tell the numerical error near a limit"
        raise InputError([Fault("--joints", found, f"give {LEAST_NEAR} or more")])
    with Writer.open(path) as store:
        limit = rule.limit_of(text, store.limits, "--near", EXAMPLE)
        lacking = [name for name in limit.loads if not selected_results.holds(store.columns, load_of(name).name)]
        if lacking:
            remedy = "give loads that it keeps, see tolstat status"
            raise InputError([Fault("--near", f"the file does not keep {', '.join(lacking)}", remedy)])
        verify.check_version(store)
        chosen = [nearest(one, limit, number) for one in store.each()]
        fewest = min(slots.size for slots in chosen if slots.size) if any(slots.size for slots in chosen) else 0
        if fewest < LEAST_NEAR:
            found = f"has {fewest} settled joints; {LEAST_NEAR} are needed"
            raise StoreError(str(Fault(str(path), found, f"add joints: tolstat extend {path}")))
        on_start()
        for one, slots in zip(store.each(), chosen, strict=True):
            before = verification.read(one, verification.NEAR)
            new = slots if before is None else slots[~np.isin(one.row(slots), before.rows)]
            if new.size:
                params = partial(recorded.parameters, one)
                made = verify.check_slots(one, params, new, names, workers=workers, progress=progress)
                verification.write(one, made if before is None else _merged(before, made), verification.NEAR)
        held = [verification.read(one, verification.NEAR) for one in store.each()]
        checked = worst.checks([one for one in held if one is not None])
    assert checked is not None
    return checked


def _merged(one: Verification, other: Verification) -> Verification:
    """Joints of both, ascending."""
    rows = np.concatenate([one.rows, other.rows])
    order = np.argsort(rows)
    checks = {
        name: Check(
            check.description, check.options, np.concatenate([check.results, other.checks[name].results])[order]
        )
        for name, check in one.checks.items()
    }
    return Verification(one.seed, rows[order], np.concatenate([one.base, other.base])[order], checks)
