"""What makes shares above a level uncertain beside sampling: numerical error, and measured parts.

The numerical error of loads is in total intervals; what measured parts leave open of the process, see
`analysis.known_share`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from tolstat.analysis import known_share, prediction, process
from tolstat.analysis.accuracy import LEAST_NEAR, OBSERVABLES, corrected, corrections, size
from tolstat.analysis.estimates import Mask, frozen
from tolstat.analysis.known_share import KnownShare, Mixture
from tolstat.analysis.process import Known, Sums
from tolstat.analysis.sample import Sample, largest_of
from tolstat.analysis.weighted import Split, Weighted
from tolstat.common.load_kinds import Kind
from tolstat.common.loads import ANY_LIMIT, LOADS, FloatArray
from tolstat.common.tables import Status
from tolstat.store.recorded import mentions
from tolstat.store.view import View
from tolstat.study.axes import streams_of
from tolstat.study.tolerances.distributions import score
from tolstat.study.tolerances.entry import Toleranced

KEYS = ("known_from", "law")
"""Keys of an entry of ``[tolerances]`` that is known from measured parts."""


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
    by = error * _largest(narrowed, LOADS[name].kind) / load.scale
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
    if view.near is None:
        return None
    checks = {name: check.results for name, check in view.near.checks.items()}
    distance = np.abs(load.values - load.limit)
    nearest = view.rows(np.argsort(distance, kind="stable")[: 2 * LEAST_NEAR])
    missing = corrections(view.near.base, checks)[np.isin(view.near.rows, nearest), OBSERVABLES.index(name)]
    missing = missing[np.isfinite(missing)]
    if missing.size < LEAST_NEAR:
        return None
    sizes = np.nan_to_num(_largest(view, LOADS[name].kind) / load.scale)
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
    return narrowed.numerical_error.get(LOADS[plain].kind.key, np.nan)


def delivery(samples: Sequence[Sample], level: float, number: int, confidence: float) -> dict[str, float]:
    """Prediction interval for the number above a level among `number` further joints; see `sample.total_interval`.

    Returns
    -------
    dict
        ``next_lower``, ``next_upper``: whole numbers, ends included; NaN without an interval; ``delivery``: `number`.
    """
    intervals = [sample.delivery(level, number, confidence) for sample in samples]
    return prediction.columns((min(low for low, _ in intervals), max(high for _, high in intervals)), number)


def known_parts(view: View) -> KnownParts | None:
    """Read what a file's study knows of its processes; None if it takes its tolerances as exact."""
    return view.kept("known_parts", lambda: _of(view))


def _of(view: View) -> KnownParts | None:
    if not (view.sampled and view.limits and mentions(view.store, KEYS, "tolerances")):
        return None
    entries = view.study.known
    return KnownParts(view, entries) if entries else None


@dataclass(frozen=True, eq=False)
class KnownParts:
    """Shares of the joints of a file above its limits, for each likely process.

    Attributes
    ----------
    view : View
        The file.
    entries : tuple of Toleranced
        Entries of its study that are known from measured parts.
    """

    view: View
    entries: tuple[Toleranced, ...]

    def share(self, name: str, confidence: float) -> KnownShare:
        """Share above the limit of a load, or above at least one limit (`ANY_LIMIT`).

        Numbers are NaN where so many likely processes are not supported that the upper end would be 1.
        """
        none = KnownShare(np.nan, np.nan, np.nan, np.nan, np.nan, 1.0)
        if not self._done.any():
            return none
        estimate = known_share.intervals(*self._tallies[name], self.supported, confidence)
        refused = estimate.unsupported >= 0.5 * (1.0 - confidence)
        return none._replace(unsupported=estimate.unsupported) if refused else estimate

    @cached_property
    def supported(self) -> Mask:
        """Which of the likely processes the joints support, (K,)."""
        done = int(self._done.sum())
        return known_share.supported(done, self._drawn, self._known, self._mixture)

    @property
    def remedy(self) -> str:
        """Sentence on what lets a campaign support the likely processes."""
        parts = ", ".join(f'"{entry.pattern}" = {entry.parts}' for entry in self.entries)
        if any(number is not None for part in self._mixture for number in part.parts):
            return f"Simulate more joints, or draw them anew with parts = {{ {parts} }} in [[proposal]]"
        return f'Draw them with method = "importance" and [[proposal]] share = 0.8, parts = {{ {parts} }}'

    @property
    def _known(self) -> tuple[Known, ...]:
        return tuple(Known(entry.parts, len(entry.names)) for entry in self.entries)

    @property
    def _drawn(self) -> process.Draws:
        return process.draws(tuple(entry.parts for entry in self.entries))

    @property
    def _mixture(self) -> list[Mixture]:
        """Parts of the distribution that joints were drawn from which differ from the tolerances in no other way."""
        proposals = self.view.study.proposals
        tolerances = 1.0 - sum(proposal.share for proposal in proposals)
        mixtures = [Mixture(tolerances, (None,) * len(self.entries))]
        for proposal in proposals:
            of = {frozenset(drawn.streams): drawn.parts for drawn in reversed(proposal.processes)}
            parts = [of.get(frozenset(streams_of(name)[0] for name in entry.names)) for entry in self.entries]
            others = len(proposal.scores) + len(proposal.processes) - sum(number is not None for number in parts)
            if not others:
                mixtures.append(Mixture(proposal.share, tuple(parts)))
        return mixtures

    @cached_property
    def _done(self) -> Mask:
        return np.asarray(self.view.status != Status.PENDING)

    @cached_property
    def _tallies(self) -> dict[str, tuple[Split, list[Split], list[Split]]]:
        """Weights above each limit: of joints with a valid load; for the lower end; and for the upper end."""
        view, done = self.view, self._done
        names = [*view.limits, ANY_LIMIT]
        events: list[tuple[Mask, Mask]] = []
        places = []
        for load in view.loads(names):
            ends, limit = with_error(view, load), float(load.limit or np.nan)
            above_level = [(load.values > limit, load.is_valid)]
            above_level += [(end.lower.values > limit, done) for end in ends]
            above_level += [(end.upper.values > limit, done) for end in ends]
            places.append((len(events), len(ends)))
            events += above_level
        events = [(above[done], counted[done]) for above, counted in events]
        weights, heaviest = view.design.counts_as(view.n)[done], 0.0
        if isinstance(view.design, Weighted) and np.isfinite(view.design.heaviest):
            heaviest = view.design.heaviest
        each = known_share.tallies(self._sums(), self._known, self._drawn, weights, events, heaviest)
        return {
            name: (each[k], each[k + 1 : k + 1 + m], each[k + 1 + m : k + 1 + 2 * m])
            for name, (k, m) in zip(names, places, strict=True)
        }

    def _sums(self) -> list[Sums]:
        """Sums of the scores of each entry's errors, in the joints that have been simulated."""
        view = self.view
        names = [name for entry in self.entries for name in entry.names]
        parts = []
        for errors in view.error_blocks(names):
            scores = {name: score(view.study.tolerances[name], np.asarray(errors[name])) for name in names}
            stacked = (np.stack([scores[name] for name in entry.names]) for entry in self.entries)
            parts.append([(of_entry.sum(axis=0), np.square(of_entry).sum(axis=0)) for of_entry in stacked])
        each = zip(*parts, strict=True)
        return [Sums(*(np.concatenate(blocks)[self._done] for blocks in zip(*entry, strict=True))) for entry in each]
