"""Which joints are simulated again for the numerical error: at random, and those nearest to limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tolstat.common.loads import ANY_LIMIT, Limit, split
from tolstat.common.tables import Status
from tolstat.store import Reader, View

JOINTS_PER_CHECKED, MIN_CHECKED, MAX_CHECKED = 100, 29, 299
"""At the end of a run one joint in 100 is checked at random, and as many near the limits: each takes twice its
time. The largest error of 29 joints bounds that of 90 % of all with 95 % confidence, of 59 95 %, of 299 99 %."""


def few(rows: int) -> int:
    """Number of joints that are checked at random at the end of a campaign of `rows` joints, and near its limits."""
    return min(max(rows // JOINTS_PER_CHECKED, MIN_CHECKED), MAX_CHECKED)


def choose(rows: NDArray[np.intp], joints: int | None, seed: int) -> NDArray[np.intp]:
    """Choose `joints` of the `rows` at random, ascending; all if there are fewer, or if `joints` is None."""
    if joints is None:
        return rows
    rng = np.random.default_rng([seed, 4])  # 4: another random stream than that of the errors
    return np.sort(rng.choice(rows, min(joints, len(rows)), replace=False))


def settled(store: Reader) -> NDArray[np.intp]:
    """File slots of the settled joints, ascending, without the nominal one unless no other is settled."""
    slots = np.flatnonzero(store.status() == Status.OK)
    samples = slots[slots >= store.first_sample]  # the nominal joint is not in the statistics either
    return samples if samples.size else slots


def quick(store: Reader) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """File slots of the joints that are checked at the end of a run, ascending.

    Returns
    -------
    at_random, near : ndarray
        As many chosen by the study's seed as nearest to any limit among the others; without limits twice as many by the
        seed.
    """
    number, view = few(store.n), View(store)
    limits = Limit(ANY_LIMIT, tuple(store.limits), tuple(store.limits.values()), store.mechanism)
    distance = _distances(view, limits).min(axis=0, initial=np.inf)
    others = view.slots(np.argsort(distance, kind="stable")[: np.isfinite(distance).sum()])
    at_random = choose(settled(store), number if others.size else 2 * number, int(store.sampling["seed"]))
    return at_random, np.sort(others[~np.isin(others, at_random)][:number])


def nearest(store: Reader, limit: Limit, joints: int) -> NDArray[np.intp]:
    """File slots of the settled joints whose loads are nearest to a limit, ascending: so many for each load of it."""
    view, nearest_samples = View(store), set[int]()
    for distance in _distances(view, limit):
        order = np.argsort(distance, kind="stable")[:joints]
        nearest_samples |= set(order[np.isfinite(distance[order])].tolist())
    return view.slots(sorted(nearest_samples))


def _distances(view: View, limit: Limit) -> NDArray[np.float64]:
    """Distance of each settled joint from each level of a limit that holds at this point, relative to the level.

    Of loads that the file keeps, (loads, n); infinite for other joints.
    """
    distances = [np.zeros((0, view.n))]
    for name, level in zip(limit.loads, limit.levels, strict=True):
        plain, points = split(name)
        if plain in view.kept_loads and (not points or view.store.point in points.split("+")):
            relative = np.abs(view.simulated(plain) / level - 1.0)
            distances.append(np.where(view.status == Status.OK, relative, np.inf)[None])
    return np.concatenate(distances)
