"""What measured parts leave open of the process, in shares above limits; see `analysis.known_share`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tolstat.analysis import known_share, process
from tolstat.analysis.estimates import Mask
from tolstat.analysis.known_share import KnownShare, Mixture
from tolstat.analysis.process import Known, Sums
from tolstat.analysis.weighted import Split, Weighted
from tolstat.common.loads import ANY_LIMIT
from tolstat.common.tables import Status
from tolstat.store import error_budget
from tolstat.store.recorded import mentions
from tolstat.store.view import View
from tolstat.study.axes import streams_of
from tolstat.study.tolerances.distributions import score
from tolstat.study.tolerances.entry import Toleranced

KEYS = ("known_from", "law")
"""Keys of an entry of ``[tolerances]`` that is known from measured parts."""


def of(view: View) -> KnownParts | None:
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
            ends, limit = error_budget.with_error(view, load), float(load.limit or np.nan)
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
