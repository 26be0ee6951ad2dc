"""Numerical error of loads in shares above a level: total intervals."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tolstat.analysis.accuracy import size
from tolstat.common.loads import LOADS

if TYPE_CHECKING:
    from tolstat.store.sample_load import SampleLoad
    from tolstat.store.view import View


def shifted(view: View, load: SampleLoad) -> tuple[SampleLoad, SampleLoad] | None:
    """Return a load reduced, and increased, by its numerical error in every joint; None if the error is unknown."""
    error = relative(view, load.name)
    if np.isnan(error):
        return None
    narrowed, name = view.narrowed(load.name)
    by = error * size(narrowed.results, name)
    return load.shifted(-by), load.shifted(by)


def relative(view: View, name: str) -> float:
    """Numerical error of a load, relative to the largest load of its kind in the joint; NaN if unknown."""
    narrowed, plain = view.narrowed(name)
    return narrowed.numerical_error.get(LOADS[plain].kind, np.nan)


def total_interval(
    load: SampleLoad, ends: tuple[SampleLoad, SampleLoad] | None, level: float, confidence: float
) -> tuple[float, float]:
    """Interval of the share above a level that covers sampling, unresolved joints and numerical error.

    Parameters
    ----------
    load : SampleLoad
        The load as simulated.
    ends : tuple of SampleLoad, optional
        The load reduced and increased by its numerical error; None if the error is unknown, which is then not covered.
    level, confidence : float
        As in `SampleLoad.above`.

    Returns
    -------
    lower, upper : float
        Shares of the joints; NaN for dependent samples.
    """
    low, high = ends or (load, load)
    return low.above(level, confidence).outer_lower, high.above(level, confidence).outer_upper
