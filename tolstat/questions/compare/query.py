"""Comparison of two campaigns: differences between their studies and between their loads."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tolstat.analysis import difference
from tolstat.analysis.design import Claim
from tolstat.analysis.sample import Sample
from tolstat.common.counts import Counts
from tolstat.common.draw_records import DRAWN
from tolstat.common.errors import Fault, InputError, StoreError
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.shown import shown
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import Status
from tolstat.store.view import View

SHARES = (0.5, 0.9, 0.99)
"""Quantiles that are compared."""


class Change(NamedTuple):
    """What differs between two studies.

    Attributes
    ----------
    keys : list of str
        Dotted keys of their identity; all change from value `a` to value `b`.
    a, b : object
        The values, JSON; None where the study has no such key.
    """

    keys: list[str]
    a: Any
    b: Any


class Side(NamedTuple):
    """The joints of one campaign that are compared.

    Attributes
    ----------
    view : View
        The campaign.
    samples : ndarray of int, shape (n,)
        Samples of it, ascending.
    """

    view: View
    samples: NDArray[np.intp]

    @property
    def unresolved(self) -> int:
        """Number of these joints that failed or did not settle."""
        counts = Counts.of(self.view.status[self.samples])
        return counts.failed + counts.unsettled

    def load(self, name: str) -> Sample:
        """Load of these joints."""
        load = self.view.load(name)
        return load if len(self.samples) == self.view.n else load.only(self.samples)  # a million joints are not copied


class Sides(NamedTuple):
    """The joints of two campaigns A and B.

    Attributes
    ----------
    a, b : Side
        The joints that are compared; if paired, both sides have as many.
    paired : bool
        Whether joint i of both was drawn with the same random numbers.
    """

    a: Side
    b: Side
    paired: bool

    @property
    def has_intervals(self) -> bool:
        """Whether differences of shares have intervals."""
        claim: Claim = "difference" if self.paired else "share"
        return self.a.view.design.has_interval(claim) and self.b.view.design.has_interval(claim)

    @property
    def rows(self) -> NDArray[np.intp]:
        """Row of each joint of A in its campaign, (n,)."""
        return self.a.view.rows(self.a.samples)

    def load(self, name: str) -> tuple[Sample, Sample]:
        """Load of the joints of A and of B."""
        return self.a.load(name), self.b.load(name)


@shown
class Comparison(NamedTuple):
    """Differences between two campaigns.

    Attributes
    ----------
    sides : Sides
        The joints.
    changes : list of Change
        What differs between the studies.
    shares : DataFrame
        One row per limit of either study, and `ANY_LIMIT` if both have some (each side against its own): ``load``,
        ``unit``, ``level`` (SI), fields of `difference.ShareDifference`.
    loads : DataFrame
        One row per load and ``statistic`` (``mean``, ``50 %`` ...): ``load``, ``unit``, ``statistic``, then the fields
        of `analysis.difference.Difference`.
    switched : DataFrame
        One row per pair and limit if only one joint of the pair is above the limit: ``row`` (of A), ``load``, ``unit``,
        ``level``, ``a``, ``b``. Empty without pairs.
    """

    sides: Sides
    changes: list[Change]
    shares: pd.DataFrame
    loads: pd.DataFrame
    switched: pd.DataFrame


def compared(a: View, b: View, by: Sequence[str] = (), confidence: float = 0.95) -> Comparison:
    """Compare two campaigns.

    Parameters
    ----------
    a, b : View
        Campaigns. Joints are paired if both studies draw them by the same method from the same seed: an error then
        has the same random number in both, whatever its tolerance. Joints without a partner are then left out.
    by : sequence of str
        Loads whose quantiles and means are compared; by default those with a limit or, without limits, all kept.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    Comparison
        Differences are B minus A.

    Raises
    ------
    InputError
        When a name is not a load, or a load is not kept by both files.
    StoreError
        When a file holds joints that are not drawn from tolerances, or no joint with a valid load.

    Examples
    --------
    >>> with tolstat.open(path) as a, tolstat.open(other) as b:
    ...     found = tolstat.compared(a.view(), b.view(), ["cross1.F"])
    >>> found.sides.paired, [change.keys[0] for change in found.changes]
    (True, ['sampling.n'])
    >>> int(found.shares["only_a"].iloc[0]), int(found.shares["only_b"].iloc[0])
    (0, 0)
    """
    for view in (a, b):
        if view.method not in DRAWN:
            remedy = 'compare files of studies with sampling.method "random", "sobol" or "lhs"'
            raise StoreError(str(Fault(str(view.path), "holds joints that are not drawn from tolerances", remedy)))
    limits = [*a.limits.items(), *(limit for limit in b.limits.items() if limit not in a.limits.items())]
    names = _names(a, b, by, [name for name, _ in limits])
    sides = _sides(a, b)
    try:
        shares = [_share(sides, name, level, confidence) for name, level in limits]
        shares += [_together(sides, confidence)] if a.limits and b.limits else []
        loads = [row for name in names for row in _load(sides, name, confidence)]
    except ValueError as error:
        raise StoreError(str(Fault(f"{a.path}, {b.path}", str(error), "resume both campaigns"))) from error
    switched = [_switched(sides, name, level) for name, level in limits] if sides.paired else []
    empty = pd.DataFrame(columns=["row", "load", "unit", "level", "a", "b"])
    return Comparison(
        sides,
        changes(a, b),
        pd.DataFrame(shares),
        pd.DataFrame(loads),
        pd.concat(switched, ignore_index=True) if switched else empty,
    )


def changes(a: View, b: View) -> list[Change]:
    """List what differs between the studies of two files, limits and code included; equal changes are grouped."""
    one, other = (_identity(view) for view in (a, b))
    found: dict[str, Change] = {}
    for key in sorted(one.keys() | other.keys()):
        pair = (one.get(key), other.get(key))
        if pair[0] != pair[1]:
            found.setdefault(json.dumps(pair), Change([], *pair)).keys.append(key)
    return list(found.values())


def _identity(view: View) -> dict[str, Any]:
    limits = {f"limits.{name}": level for name, level in view.limits.items()}
    return view.store.identity | limits | {key: view.store.versions.get(key) for key in ("tolstat", "sources")}


def _sides(a: View, b: View) -> Sides:
    """Simulated joints of both campaigns; those with the same random numbers if there are any."""
    done_a, done_b = (view.status != Status.PENDING for view in (a, b))
    first = max(a.campaign_samples.start, b.campaign_samples.start)
    common = range(first, min(a.campaign_samples.stop, b.campaign_samples.stop))
    if not (common and _same_random_numbers(a, b)):
        return Sides(Side(a, np.flatnonzero(done_a)), Side(b, np.flatnonzero(done_b)), paired=False)
    samples_a, samples_b = (np.arange(len(common)) + view.campaign_samples.index(first) for view in (a, b))
    both = done_a[samples_a] & done_b[samples_b]
    return Sides(Side(a, samples_a[both]), Side(b, samples_b[both]), paired=True)


def _same_random_numbers(a: View, b: View) -> bool:
    """Whether samples of one number in both campaigns are drawn with the same random numbers."""
    keys = {"sobol": ("dimensions",), "lhs": ("n",)}.get(a.method, ())
    return all(a.store.sampling[key] == b.store.sampling[key] for key in ("method", "seed", *keys))


def _names(a: View, b: View, by: Sequence[str], limited: Sequence[str]) -> list[str]:
    """Loads whose quantiles and means are compared; checks that both files keep them and the loads with limits."""
    kept = [name for name in a.kept_loads if name in b.kept_loads]
    places = {**dict.fromkeys(by, "--by"), **{name: f"limits.{name}" for name in limited}}
    faults = [
        Fault(place, f"{name!r} is not a load that both files keep", did_you_mean(name, kept))
        for name, place in places.items()
        if name not in kept
    ]
    if faults:
        raise InputError(faults)
    return list(by) or list(dict.fromkeys(limited)) or [name for name in a.shown_loads if name in kept]


def _share(sides: Sides, name: str, level: float, confidence: float) -> dict[str, object]:
    return _shares(*sides.load(name), level, sides.paired, confidence) | {"load": name, "level": level}


def _together(sides: Sides, confidence: float) -> dict[str, object]:
    """Joints above any limit of their own study: one less the yields."""
    a, b = (side.view.together.only(side.samples) for side in (sides.a, sides.b))
    return _shares(a, b, 1.0, sides.paired, confidence) | {"load": ANY_LIMIT, "level": 1.0}


def _shares(a: Sample, b: Sample, level: float, paired: bool, confidence: float) -> dict[str, object]:
    found = difference.shares(a, b, [level], paired, confidence)
    values = {key: value if key == "n" else value[0] for key, value in found._asdict().items()}
    return {"load": "", "unit": a.unit, "level": level, **values}


def _load(sides: Sides, name: str, confidence: float) -> list[dict[str, object]]:
    a, b = sides.load(name)
    found = {"mean": difference.means(a, b, sides.paired, confidence)}
    for share in SHARES:
        found[f"{100 * share:g} %"] = difference.quantiles(a, b, share, sides.paired, confidence)
    return [{"load": name, "unit": a.unit, "statistic": key, **value._asdict()} for key, value in found.items()]


def _switched(sides: Sides, name: str, level: float) -> pd.DataFrame:
    of_a, of_b = sides.load(name)
    a, b = of_a.values, of_b.values
    here = np.isfinite(a) & np.isfinite(b) & ((a > level) != (b > level))
    table = pd.DataFrame({"row": sides.rows[here], "load": name, "unit": of_a.unit, "level": level})
    return table.assign(a=a[here], b=b[here])
