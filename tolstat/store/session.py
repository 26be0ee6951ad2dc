"""The run under way, as a result file records it."""

from __future__ import annotations

import time
from typing import NamedTuple

import h5py


class Session(NamedTuple):
    """A run under way: when it started (Unix time, s), and how many joints were done by then."""

    started: float
    done: int


def read(group: h5py.Group, joints: int) -> Session | None:
    """Read the group ``session``; None where no run is recorded, or the record is damaged: a rate would mean nothing.

    Parameters
    ----------
    group : h5py.Group
        The group.
    joints : int
        Number of joints of the file, at all operating points together.
    """
    started, done = (float(group[name][()]) for name in ("started", "done"))
    return Session(started, int(done)) if 0 < started <= time.time() and 0 <= done <= joints else None
