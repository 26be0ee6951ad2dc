"""Share of parts with a given value that a gauge with an error accepts."""

from __future__ import annotations

import numpy as np

from tolstat.common.loads import FloatArray


def accepted(values: FloatArray, lower: float, upper: float, deviation: float) -> FloatArray:
    """Probability that a measured value lies in a band.

    Parameters
    ----------
    values : ndarray, (n,)
        Values of parts.
    lower, upper : float
        Ends of the band, which may be infinite.
    deviation : float
        Standard deviation of the gauge's error, which is normal with mean zero; 0 for a gauge without error.

    Returns
    -------
    ndarray, (n,)
        Between 0 and 1.

    Examples
    --------
    >>> accepted(np.array([-3.0, 0.0, 1.0]), -1.0, 1.0, 0.5).round(3).tolist()
    [0.0, 0.954, 0.5]
    """
    from scipy.special import ndtr

    if deviation == 0.0:
        return ((values >= lower) & (values <= upper)).astype(float)
    low, high = (lower - values) / deviation, (upper - values) / deviation
    # from the tail that is nearer, where a difference keeps its digits
    return np.where(low > 0.0, ndtr(-low) - ndtr(-high), ndtr(high) - ndtr(low))
