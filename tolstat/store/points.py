"""Operating points of a view: the one at which a load matters most, and their shares of the service."""

from __future__ import annotations

import numpy as np

from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import FloatArray
from tolstat.store.view import View
from tolstat.store.worst import rank


def point_of(view: View, name: str) -> str:
    """Operating point at which a load matters most: where most joints exceed its limit, else where it is largest.

    Parameters
    ----------
    view : View
        A campaign.
    name : str
        A load, ``cross1.F`` or ``cross1.F at cruise+start``.

    Returns
    -------
    str
        Name of the point; empty if the file has one without a name.
    """
    at, plain = view.narrowed(name)
    limit = view.load(name).limit
    return max(at.parts, key=lambda part: rank(part.load(plain), limit)).points[0]


def shares_of_time(view: View) -> FloatArray:
    """Share of the service time at each operating point of a view, (points,); their sum is 1.

    Raises
    ------
    InputError
        When the study does not give the shares of several points.
    """
    shares = np.array([view.store.points[name].share for name in view.points] if len(view.parts) > 1 else [1.0])
    if np.isnan(shares).any():
        remedy = "write share = ... in each [[operation]] and run the study again, which simulates nothing anew"
        remedy += f"; or look at one point: --point {view.points[0]}"
        raise InputError([Fault(str(view.path), "has operating points without a share of the time", remedy)])
    return np.asarray(shares / shares.sum())


def shares_of_revolutions(view: View) -> FloatArray:
    """Share of the revolutions at each operating point: share of the time times speed, (points,); their sum is 1.

    Raises `InputError` as `shares_of_time`.
    """
    speeds = np.array([abs(view.store.points[name].operation.speed) for name in view.points])
    turns = shares_of_time(view) * speeds
    return np.asarray(turns / turns.sum())
