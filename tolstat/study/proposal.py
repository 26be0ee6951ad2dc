"""Importance sampling: joints drawn from a mixture of the tolerances and of distributions with more joints of interest.

The mixture is defined for the independent standard normal scores from which the errors are computed: a proposal gives
some scores another mean and standard deviation. Whatever the tolerance's distribution, a proposal reaches no value
outside its support; a normal error gets exactly this mean and deviation, in units of its own deviation; and ratios of
densities are those of normal distributions, with or without correlation.

One component of the mixture is the tolerances themselves (Owen and Zhou 2000, defensive mixture). The weight of a joint
has the density of the whole mixture as denominator, whichever component it was drawn from (balance heuristic), so that
no weight exceeds one over the share of the tolerances.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tolstat.analysis import process
from tolstat.analysis.process import LEAST_PARTS, MOST_PARTS, Known, Sums
from tolstat.common.errors import Fault, collected, gather, input_error
from tolstat.common.strict import Strict, did_you_mean, dotted
from tolstat.common.units import Number
from tolstat.study.axes import streams_of
from tolstat.study.selection import Reading, entries, select

Array = NDArray[np.float64]

MIN_NOMINAL_SHARE = 0.05
"""Minimum share of joints drawn from the tolerances themselves: it limits weights to twenty."""
MAX_SHIFT, MAX_WIDEN = 10.0, 10.0
"""Largest shift, in standard deviations, and largest factor `widen` (its reciprocal is the smallest)."""


class ProposalEntry(Strict):
    """A component of the mixture that importance sampling draws joints from."""

    share: Annotated[Number, Field(gt=0, lt=1)] = Field(examples=[0.3])
    """share of the joints drawn from it"""
    widen: float | dict[str, Any] = Field(default=1.0, json_schema_extra={"x-table": "widen"}, examples=[1.5])
    """factor on the standard deviation of all scores, or of those by name or pattern of errors, from 0.1 to 10"""
    shift: dict[str, Any] = Field(
        default_factory=dict, json_schema_extra={"x-table": "shift"}, examples=[{"pin1.tilt_z": 2.0}]
    )
    """mean of the scores in standard deviations, by name or pattern of errors, from -10 to 10"""
    parts: dict[str, Any] = Field(
        default_factory=dict, json_schema_extra={"x-table": "parts"}, examples=[{"pin*.tilt_[tz]": 30}]
    )
    """draws mean and deviation of the scores for each joint anew, as so many parts leave them open, by name or pattern
    of errors, from 5 to 100000; those of one entry share them"""


@dataclass(frozen=True)
class Process:
    """Errors whose scores have one unknown mean and deviation in each joint; see `analysis.process`.

    Attributes
    ----------
    parts : int
        Number of measured parts that would leave them as open.
    streams : tuple of str
        Columns of the errors.
    """

    parts: int
    streams: tuple[str, ...]

    @property
    def known(self) -> Known:
        """The same without names."""
        return Known(self.parts, len(self.streams))


@dataclass(frozen=True)
class Proposal:
    """A component of the mixture: share, and how the scores are distributed that are not standard normal in it.

    Attributes
    ----------
    share : float
        Its share of the joints.
    scores : dict of str to (float, float)
        Mean and standard deviation by column of the errors.
    processes : tuple of Process
        Errors with a mean and deviation that are drawn for each joint; none of them is among `scores`.
    """

    share: float
    scores: dict[str, tuple[float, float]]
    processes: tuple[Process, ...] = ()

    def identity(self) -> list[Any]:
        """JSON values: everything that determines the joints drawn."""
        drawn: dict[str, Any] = {name: list(pair) for name, pair in self.scores.items()}
        if self.processes:
            drawn["parts"] = [[process.parts, list(process.streams)] for process in self.processes]
        return [self.share, drawn]

    def log_ratio(self, scores: Mapping[str, Array]) -> Array:
        """Logarithm of the density under the proposal over that under the tolerances, (n,)."""
        logs: Array = np.zeros(len(next(iter(scores.values()))))
        for name, (mean, deviation) in self.scores.items():
            z = scores[name]
            logs += 0.5 * z**2 - 0.5 * ((z - mean) / deviation) ** 2 - math.log(deviation)
        for drawn in self.processes:
            stacked = np.stack([scores[name] for name in drawn.streams])
            logs += process.log_student(Sums(stacked.sum(axis=0), np.square(stacked).sum(axis=0)), drawn.known)
        return logs


def weights(proposals: Sequence[Proposal], scores: Mapping[str, Array]) -> Array:
    """Density of each joint under the tolerances over that under the mixture (balance heuristic), (n,).

    Parameters
    ----------
    proposals : sequence of Proposal
        Components of the mixture; the tolerances have the remaining share.
    scores : mapping of str to ndarray, (n,)
        Standard normal scores by column of the errors.
    """
    density = np.full(len(next(iter(scores.values()))), 1.0 - math.fsum(p.share for p in proposals))
    with np.errstate(over="ignore"):  # a joint of negligible density under the tolerances has weight 0
        for proposal in proposals:
            density += proposal.share * np.exp(proposal.log_ratio(scores))
    return 1.0 / density


def component(proposals: Sequence[Proposal], u: Array) -> NDArray[np.intp]:
    """Component of the mixture that each uniform number selects, (n,): 0 the tolerances, k proposal k."""
    ends = np.cumsum([1.0 - math.fsum(p.share for p in proposals), *(p.share for p in proposals)])
    return np.minimum(np.searchsorted(ends, u, side="right"), len(proposals))


def read(file: Reading) -> tuple[Proposal, ...]:
    """Read ``[[proposal]]``: distributions of importance sampling beside the tolerances."""
    proposals = []
    for number, entry in enumerate(file.models("proposal", ProposalEntry)):
        with gather(file.faults):
            proposals.append(_resolved(entry, file, number))
    nominal_share = 1.0 - math.fsum(p.share for p in proposals)
    if nominal_share < MIN_NOMINAL_SHARE - 1e-12:
        found = f"shares leave {nominal_share:.3g} of the joints to the tolerances"
        file.fault("proposal.share", found, f"give shares with a sum of at most {1.0 - MIN_NOMINAL_SHARE:g}")
    return tuple(proposals)


def _resolved(entry: ProposalEntry, file: Reading, number: int) -> Proposal:
    """Expand the patterns of an entry; of a zone it applies to the scores of the radii."""
    toleranced, whole = file.scatter.drawn, f"{file.place}: proposal[{number}]"
    means = dict.fromkeys(toleranced, 0.0)
    widths = dict.fromkeys(toleranced, 1.0)
    widen = entry.widen if isinstance(entry.widen, dict) else {}
    with collected() as faults:
        if not widen:
            with gather(faults):
                widths = dict.fromkeys(toleranced, _number(entry.widen, "widen", f"{whole}.widen"))
        parts: dict[str, float] = {}
        tables = (("widen", widen, widths), ("shift", entry.shift, means), ("parts", entry.parts, parts))
        for key, table, numbers in tables:
            for item in entries(table, "proposal", number, key):
                where = f"{file.place}: {dotted(item.path)}"
                with gather(faults):
                    value = _number(item.value, key, where)
                    names = select(item.pattern, toleranced)
                    if not names:
                        raise input_error(where, "has no tolerance", did_you_mean(item.pattern, toleranced))
                    numbers |= dict.fromkeys(names, value)
        pairs = {name: (means[name], widths[name]) for name in toleranced}
        scores = {streams_of(name)[0]: pair for name, pair in pairs.items() if pair != (0.0, 1.0)}
        if scores and parts:
            faults.append(Fault(whole, "has parts beside widen or shift", "write a [[proposal]] for each"))
        if not (scores or parts) and not faults:
            faults.append(Fault(whole, "does not differ from the tolerances", "add widen, shift or parts"))
    together = [of_entry.names for of_entry in file.scatter.entries]
    return Proposal(entry.share, scores, tuple(_processes(together, parts)))


def _processes(together: Sequence[Sequence[str]], parts: Mapping[str, float]) -> Iterator[Process]:
    """Errors of one entry of the tolerances with one number of parts are of one process."""
    for names in together:
        for number in dict.fromkeys(parts[name] for name in names if name in parts):
            yield Process(int(number), tuple(streams_of(name)[0] for name in names if parts.get(name) == number))


RANGES = {
    "widen": (1.0 / MAX_WIDEN, MAX_WIDEN),
    "shift": (-MAX_SHIFT, MAX_SHIFT),
    "parts": (LEAST_PARTS, MOST_PARTS),
}
"""Smallest and largest number of each key."""


def _number(value: object, key: str, where: str) -> float:
    (low, high), kinds = RANGES[key], int if key == "parts" else (int, float)
    number = float(value) if isinstance(value, kinds) and not isinstance(value, bool) else math.nan
    if not low <= number <= high:
        whole = "whole " if key == "parts" else ""
        raise input_error(where, f"{value!r} is not a valid {key}", f"give a {whole}number from {low:g} to {high:g}")
    return number
