"""The same joints in the campaigns of a duty cycle: checks, and their status at all operating points together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tolstat.common.errors import Fault, InputError
from tolstat.common.tables import ERROR_FIELDS, Status
from tolstat.store.view import View


def check(views: Sequence[View], shares: Sequence[float]) -> list[float]:
    """Refuse campaigns that make no duty cycle; return the shares of the revolutions with the exact sum 1.

    Raises
    ------
    InputError
        When the shares are not shares, or the campaigns have different joints.
    StoreError
        When a file holds joints that are no sample of a production.
    """
    if len(shares) != len(views) or min(shares, default=0.0) <= 0 or abs(sum(shares) - 1) > 1e-6:
        found = f"{list(shares)} for {len(views)} files"
        raise InputError([Fault("shares", found, "give a positive share for each file; their sum is 1")])
    for view in views:
        view.check_sample(allow_weights=False)
        if view is not views[0]:
            _check_same_joints(view, views[0])
    total = sum(shares)
    return [share / total for share in shares]


def status(views: Sequence[View], samples: int | None) -> NDArray[np.uint8]:
    """Status of the first samples: of several operating points the first that is not ``OK``, (n,)."""
    found = views[0].status[:samples]
    for view in views[1:]:
        found = np.where(found == Status.OK, view.status[:samples], found)
    return found


def _check_same_joints(view: View, first: View) -> None:
    names = [f.name for f in ERROR_FIELDS if not f.name.startswith("operation.")]
    if view.n == first.n and all(
        np.array_equal(own[name], other[name])
        for own, other in zip(view.error_blocks(names), first.error_blocks(names), strict=True)
        for name in names
    ):
        return
    remedy = "run both studies with the same tolerances, sampling.n and sampling.seed"
    raise InputError([Fault(str(view.path), f"does not hold the joints of {first.path}", remedy)])
