"""What makes shares above a level uncertain beside sampling: the numerical error of loads, in total intervals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tolstat.analysis import prediction
from tolstat.analysis.accuracy import LEAST_NEAR, corrected, corrections, observables, size
from tolstat.analysis.estimates import frozen
from tolstat.analysis.sample import Sample, largest_of
from tolstat.common.load_kinds import Kind
from tolstat.common.loads import ANY_LIMIT, FloatArray, load_of
from tolstat.store.view import View


def with_error(view: View, load: Sample) -> tuple[Sample, ...]:
    """Return a load, and the load at both ends of its numerical error if that is known."""
    return load, *(_shifted(view, load) or ())


def _shifted(view: View, load: Sample) -> tuple[Sample, Sample] | None:
    """Return the load of all joints at both ends of its numerical error, as far as that is known; None if it is not.

    With enough verified joints near the limit of the load, see `near`; otherwise the load is reduced and increased by
    the error that most joints checked at random stay below.
    """
    if load.parts:
        return _together(load, (_shifted(view, part) for part in load.each()))
    ends = near(view, load)
    if ends is not None:
        return ends
    error = relative(view, load.name)
    if np.isnan(error):
        return None
    narrowed, name = view.narrowed(load.name)
    by = error * _largest(narrowed, load_of(name, view.mechanism).kind) / load.scale
    return load.shifted(-by), load.shifted(by)


def _largest(view: View, kind: Kind) -> FloatArray:
    """Largest load that errors of a kind are relative to in each joint, (n,), see `accuracy.size`."""
    return view.kept(("largest", kind.key), lambda: frozen(size(view.results, kind)))


def near(view: View, load: Sample) -> tuple[Sample, Sample] | None:
    """Return the load of all joints corrected by what verified joints near its limit lack; see `accuracy.corrected`.

    Returns
    -------
    tuple of Sample or None
        The load at both ends of the mean correction. None if fewer than `accuracy.LEAST_NEAR` of the joints nearest to
        the limit are verified, twice as many at most; `unknown` has the command that verifies them.
    """
    if load.parts:
        return _together(load, (near(view, part) for part in load.each()))
    if load.limit is None:
        return None
    view, name = view.narrowed(load.name)
    if len(view.parts) > 1:
        return _together(load, (near(part, _at(part, name, load)) for part in view.parts))
    if (verified := view.near) is None:
        return None
    checks = {name: check.results for name, check in verified.checks.items()}
    lacking = view.kept(corrections, lambda: frozen(corrections(verified.base, checks, view.mechanism)))
    distance = np.abs(load.values - load.limit)
    nearest = view.rows(np.argsort(distance, kind="stable")[: 2 * LEAST_NEAR])
    number = observables(view.mechanism).index(name)
    missing = lacking[np.isin(verified.rows, nearest), number]
    missing = missing[np.isfinite(missing)]
    if missing.size < LEAST_NEAR:
        return None
    sizes = np.nan_to_num(_largest(view, load_of(name, view.mechanism).kind) / load.scale)
    low, high = corrected(np.zeros(load.values.size), sizes, missing)
    return load.shifted(low), load.shifted(high)


def _at(part: View, name: str, load: Sample) -> Sample:
    """A load at one operating point, with the limit, and as the ratio, of the load over several."""
    assert load.limit is not None
    at_point = replace(part.load(name), limit=load.limit * load.scale)
    return at_point if load.scale == 1.0 else at_point.of_limit()


def _together(load: Sample, pairs: Iterable[tuple[Sample, Sample] | None]) -> tuple[Sample, Sample] | None:
    """The largest of the loads at each end, taken one by one to save memory; None if one of them is not known."""
    ends: tuple[Sample, Sample] | None = None
    for pair in pairs:
        if pair is None:
            return None
        low, high = pair if ends is None else (largest_of(load.name, both) for both in zip(ends, pair, strict=True))
        ends = replace(low, name=load.name, parts=()), replace(high, name=load.name, parts=())
    return ends


def unknown(view: View) -> str:
    """Words on the numerical error near the limits of the study if it is not known; empty if it is."""
    if not view.limits or near(view, view.together) is not None:
        return ""
    return command(view.path)


def command(path: Path, limit: str = ANY_LIMIT) -> str:
    """Words on a numerical error that is not known near a limit, with the command that tells it."""
    return f'numerical error at the limit: not known; tolstat verify {path} --near "{limit}"'


def relative(view: View, name: str) -> float:
    """Numerical error of a load, relative to the largest load of its measure in the joint; NaN if unknown.

    Of all limits that of the load whose error is the largest.
    """
    if name == ANY_LIMIT:
        return float(np.max([relative(view, limit) for limit in view.limits]))
    narrowed, plain = view.narrowed(name)
    return narrowed.numerical_error.get(load_of(plain, view.mechanism).kind.key, np.nan)


def delivery(samples: Sequence[Sample], level: float, number: int, confidence: float) -> dict[str, float]:
    """Prediction interval for the number above a level among `number` further joints; see `sample.total_interval`.

    Returns
    -------
    dict
        ``next_lower``, ``next_upper``: whole numbers, ends included; NaN without an interval; ``delivery``: `number`.
    """
    intervals = [sample.delivery(level, number, confidence) for sample in samples]
    return prediction.columns((min(low for low, _ in intervals), max(high for _, high in intervals)), number)
