"""The same joints in the campaigns of a duty cycle: checks, and their status at all operating points together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis.cycles import Transitions
from tolstat.analysis.design import Design
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import FloatArray
from tolstat.common.tables import ERROR_FIELDS, Status, worst_status
from tolstat.display.text import percent
from tolstat.solver.histories import between
from tolstat.store import recorded
from tolstat.store.view import View
from tolstat.study.fatigue import Fatigue, of_text

ANY = "any of them"
"""Name of the row for all points or channels together."""
CONFIDENCE = 0.95
HOUR = 3600.0


@dataclass(frozen=True)
class Joints:
    """Joints of one campaign or of a duty cycle, and the settings of their evaluation.

    Attributes
    ----------
    status : ndarray, shape (n,)
        `tables.Status`; with several operating points the worst, see `tables.worst_status`.
    design : Design
        How the joints were drawn.
    settings : Fatigue
        Section ``[fatigue]`` of the study; of the first study if there are several. See `settings_of`.
    total : int
        Number of samples of the campaign, those not evaluated included.
    duty : tuple of (str, float)
        Operating points, or files of one point without a name, and their shares of the revolutions; one entry with
        share 1 for a single point.
    """

    status: NDArray[np.uint8]
    design: Design
    settings: Fatigue
    total: int
    duty: tuple[tuple[str, float], ...]

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Which joints settled to a motion that repeats at all operating points, (n,)."""
        return np.asarray(self.status == Status.OK)

    @property
    def settled(self) -> str:
        """Words on the number of these joints."""
        return f"{int(self.valid.sum())} of {self.status.size} joints settled"

    @property
    def duty_in_words(self) -> list[str]:
        """Sentences on the shares of a duty cycle and its sequence; none for a single operating point."""
        shares = ", ".join(f"{percent(share)} at {name}" for name, share in self.duty)
        if len(self.duty) < 2:
            return []
        reason = "the study gives no [fatigue.sequence]"
        if self.settings.visits:
            reason = "[fatigue.sequence] is of the operating points of one study"
        between = f"not counted are cycles between the points: {reason}"
        if self.visits:
            between = f"cycles between the points: {len(self.visits)} visits in {self.settings.turns:g} revolutions"
            if missed := [name for p, (name, _) in enumerate(self.duty) if p not in self.visits]:
                between += f"; no visit of {', '.join(missed)}"
        return [f"over a duty cycle: {shares}, shares of the revolutions", between]

    @property
    def visits(self) -> list[int]:
        """Points of `duty` in the order of their visits; empty where the study gives no sequence of several of them."""
        names = [name for name, _ in self.duty]
        visited = [names.index(name) for name in self.settings.visits if name in names]
        return visited if len(set(visited)) > 1 else []

    def transitions(self, low: FloatArray, high: FloatArray) -> Transitions | None:
        """Cycles that the sequence of operating points closes.

        Parameters
        ----------
        low, high : ndarray, shape (n, channels, points)
            Smallest and largest load at each point of `duty`; NaN for joints without results.

        Returns
        -------
        Transitions, optional
            None without `visits`.
        """
        if not self.visits:
            return None
        levels = (table.reshape(-1, len(self.duty)) for table in (low, high))
        tables = between(self.visits, *levels)
        ranges, means, numbers, replaced = (table.reshape(*low.shape[:2], -1) for table in tables)
        return Transitions(ranges, means, numbers / self.settings.turns, replaced / self.settings.turns)


def members(views: Sequence[View], shares: Sequence[float] | None) -> tuple[Sequence[View], list[float]]:
    """Views of a duty cycle at one operating point each, and their shares of the revolutions with the exact sum 1.

    Parameters
    ----------
    views : sequence of View
        One campaign, whose operating points are the duty cycle if it has several; or the same joints in a campaign for
        each operating point.
    shares : sequence of float, optional
        Share of the revolutions in each of several campaigns.

    Raises
    ------
    InputError
        When the shares are not shares or not known, or the campaigns have different joints.
    """
    if several := [view for view in views if len(view.parts) > 1]:
        remedy = "" if shares is None else "leave --share out: the study gives share in [[operation]]"
        remedy = "give this file alone, or files with one operating point each" if len(views) > 1 else remedy
        if remedy:
            raise InputError([Fault(str(several[0].path), "has several operating points", remedy)])
        views, shares = views[0].parts, views[0].shares_of_revolutions.tolist()
    shares = [1.0] if shares is None else shares
    if len(shares) != len(views) or min(shares, default=0.0) <= 0 or abs(sum(shares) - 1) > 1e-6:
        problem = f"{list(shares)} for {len(views)} files"
        raise InputError([Fault("--share", problem, "give a positive share for each file; their sum is 1")])
    names, first = [column.name for column in ERROR_FIELDS], views[0]
    for view in views[1:]:
        if view.n != first.n or not all(
            np.array_equal(errors[name], other[name])
            for errors, other in zip(view.error_blocks(names), first.error_blocks(names), strict=True)
            for name in names
        ):
            remedy = "run both studies with the same tolerances, sampling.n and sampling.seed"
            raise InputError([Fault(str(view.path), f"does not hold the joints of {first.path}", remedy)])
    total = sum(shares)
    return views, [share / total for share in shares]


def joints_of(views: Sequence[View], shares: Sequence[float], samples: int | None) -> Joints:
    """First samples of the `members`; all without a number."""
    first = views[0]
    return Joints(
        status=worst_status([view.status[:samples] for view in views]),
        design=first.design if samples is None else first.design.only(np.arange(min(samples, first.n))),
        settings=settings_of(views, shares),
        total=first.n,
        duty=tuple((view.points[0] or view.path.name, share) for view, share in zip(views, shares, strict=True)),
    )


def settings_of(views: Sequence[View], shares: Sequence[float]) -> Fatigue:
    """Section ``[fatigue]`` of the first of the `members`, with the service life in revolutions over the duty cycle."""
    first = views[0]
    bearing = (first.study.joint if first.study_path else recorded.joint_of(first.store, 0)).bearing
    hours = np.nan if bearing is None or bearing.required_life is None else bearing.required_life / HOUR
    turn = sum(share * 2.0 * np.pi / abs(view.store.operation.speed) for view, share in zip(views, shares, strict=True))
    return section(first).within(hours, HOUR / turn, str(first.path))


def section(view: View) -> Fatigue:
    """Section ``[fatigue]`` of the study in a file, or of the one that is read in its place.

    Of the text in the file the section alone is read, like limits: it is at hand even where the study refers to files
    that are not.
    """
    return view.study.fatigue if view.study_path else of_text(view.store.study_text, str(view.path))


def only(values: FloatArray) -> float:
    """Value of the nominal joint; NaN if there is none."""
    return float(values[0]) if values.size else np.nan
