"""View of a result file for questions: study, errors, loads by name, limits; each part is read once."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tolstat.analysis import accuracy
from tolstat.analysis.design import SAMPLE, Design
from tolstat.analysis.estimates import frozen
from tolstat.analysis.sample import Sample, largest_of
from tolstat.common.columns import METHODS, holds
from tolstat.common.counts import Counts
from tolstat.common.errors import input_error
from tolstat.common.loads import ANY_LIMIT, FloatArray, Limit, load_of, loads_of, shown_loads, split
from tolstat.common.mechanism import Mechanism
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import Status, tables
from tolstat.store import verification, what_if, worst
from tolstat.store.hdf5 import BLOCK, pick, store_error
from tolstat.store.reader import Reader
from tolstat.store.recorded import design_of, misfits, recall
from tolstat.store.verification import Verification
from tolstat.store.what_if import Altered
from tolstat.study import Study
from tolstat.study.points import limits_at, names_of

T = TypeVar("T")


class View:
    """A result file as questions read it. Element i of every array is sample i; the nominal joint is not among them.

    Of several operating points a load is the largest over them, and a joint is valid only if it is at all of them.
    What cannot be told of several points raises the error of a `store` that is at no point.

    Each part is read and checked when it is first used, and kept; arrays that are kept cannot be written to. Tables of
    errors are kept for the first `BLOCK` samples; those of larger campaigns are read in blocks.

    Attributes
    ----------
    store : Reader
        The open file.
    name, method : str
        Name of the study, and its sampling method.
    limits : dict of str to float
        Allowed load in SI units by name (``"cross1.F"``, ``"cross1.F at cruise"``).
    parts : list of View
        Views of each operating point; the view itself if there is one.
    points : tuple of str
        Names of the operating points.
    columns : tuple of Column
        Columns of the results that the study keeps; the others are NaN.
    n : int
        Number of samples.
    study_path : Path, optional
        Study file that is read in place of the text in the result file.
    """

    def __repr__(self) -> str:
        at = f" at {', '.join(self.points)}" if any(self.points) else ""
        return f"<view of {self.path.name!r}: {self.n} samples{at}>"

    def __init__(self, store: Reader, study_path: Path | None = None, parts: Sequence[View] = ()) -> None:
        self.store = store
        if not parts and store.point is None:
            parts = [View(store.at(name), study_path) for name in store.points]
        self.parts = list(parts) or [self]
        self.points = tuple(part.store.point or "" for part in self.parts)
        self.path = store.path
        self.name = store.study_name
        self.method = str(store.sampling["method"])
        self.limits = limits_at(store.limits, self.points, list(store.points))
        self.columns = store.columns
        self.n = store.n - store.first_sample
        self.study_path = study_path
        self._loads: dict[str, Sample] = {}
        self._kept: dict[Hashable, Any] = {}
        self._at: dict[tuple[str, ...], View] = {self.points: self}

    def kept(self, key: Hashable, compute: Callable[[], T]) -> T:
        """Result of a function of this view that several ask for, computed once for each key; nobody may change it."""
        if key not in self._kept:
            self._kept[key] = compute()
        result: T = self._kept[key]
        return result

    def at(self, selection: str) -> View:
        """View of one operating point, ``"cruise"``, or the worst of several, ``"cruise+start"``; ``""`` for all."""
        chosen = names_of(selection, self.points, str(self.path))
        if chosen not in self._at:
            parts = [self.parts[self.points.index(name)] for name in chosen]
            self._at[chosen] = parts[0] if len(parts) == 1 else View(self.store, self.study_path, parts)
        return self._at[chosen]

    def narrowed(self, name: str) -> tuple[View, str]:
        """View of the points that a load or column names, and its plain name: ``"cross1.F at cruise"``."""
        plain, where = split(name)
        return (self.at(where), plain) if where else (self, plain)

    @property
    def mechanism(self) -> Mechanism:
        """What was simulated."""
        return self.store.mechanism

    @cached_property
    def study(self) -> Study:
        """The study that the file was made from, with its distributions; see `recall` for exceptions."""
        return recall(self.store, path=self.study_path)

    @cached_property
    def verification(self) -> Verification | None:
        """The verification that the file holds, if any."""
        return self._verified(verification.VERIFY)

    @cached_property
    def near(self) -> Verification | None:
        """The verification of joints near limits that the file holds, if any."""
        return self._verified(verification.NEAR)

    def _verified(self, group: str) -> Verification | None:
        """Verifications of all operating points; None if one of them has none."""
        found = verification.read_each([part.store for part in self.parts], group)
        return verification.together(found) if len(found) == len(self.parts) else None

    @cached_property
    def altered(self) -> dict[str, Altered]:
        """Loads of joints with other tolerances that the file holds, by the digest of the change."""
        return what_if.read(self.store)

    @cached_property
    def numerical_error(self) -> dict[str, float]:
        """95 % quantile of the checked joints' relative numerical error, by kind of load; empty without checks."""
        if self.verification is None:
            return {}
        checks = {name: check.results for name, check in self.verification.checks.items()}
        return accuracy.usual(self.verification.base, checks, self.mechanism)

    @cached_property
    def results(self) -> worst.Columns:
        """Columns `loads.load_fields` of the results, (n, ...) each."""
        if len(self.parts) > 1:
            return worst.together([part.results for part in self.parts])
        return worst.columns_of(self.store)

    def read_results(self, fields: Sequence[str]) -> NDArray[np.void]:
        """Read other fields of the results, (n,) table; they are not kept."""
        return self.store.results(slice(self.store.first_sample, None), fields)

    @property
    def status(self) -> NDArray[np.uint8]:
        """Status of the joints, (n,)."""
        return self.results["status"]

    @cached_property
    def nominal(self) -> NDArray[np.void]:
        """The nominal joint, RESULT (1,); (0,) if the file has none or its results are not valid."""
        return worst.nominal([part.store for part in self.parts])

    @property
    def nominal_slots(self) -> NDArray[np.intp]:
        """File slots of `nominal`, (1,) or (0,)."""
        return np.zeros(len(self.nominal), dtype=np.intp)

    @cached_property
    def first_without_load(self) -> NDArray[np.void]:
        """Complete results of the first `worst.MAX_LISTED` joints that failed or did not settle, RESULT (m,)."""
        return worst.without_load([part.status for part in self.parts], [part.store for part in self.parts])

    @cached_property
    def mode_share(self) -> FloatArray:
        """Mean share of the revolution by pin and contact mode, (pins, modes), over the valid joints; NaN if not kept.

        Several operating points have none.
        """
        if len(self.parts) > 1:
            return np.full(tables(self.mechanism).RESULT["mode_share"].shape, np.nan)
        return worst.mode_share(self.store)

    def load(self, name: str) -> Sample:
        """Largest load over the revolution of every joint, by its name; ``"cross1.F at cruise"`` at that point only.

        ``"any limit"`` is the largest ratio of load to limit of each joint, see `together`.

        Its limit is the one of that name or, without it, the one that holds at these points. Raises an `InputError` if
        there is no such load or the study does not keep it, a `StoreError` for levels of a subset simulation.
        """
        if name not in self._loads:
            if self.method == "subset":
                self.check()
            if name == ANY_LIMIT and self.limits:
                return self._loads.setdefault(name, self.together)
            view, plain = self.narrowed(name)
            if view is not self:
                at_points = view.load(plain)
                self._loads[name] = replace(at_points, name=name, limit=self.limits.get(name, at_points.limit))
                return self._loads[name]
            every = loads_of(self.mechanism)
            if name not in every:
                raise input_error(name, "is not a load", did_you_mean(name, list(every)))
            if name not in self.kept_loads:
                found = f"is not kept in {self.path}, see [output] results of its study"
                raise input_error(name, found, f"give one of: {', '.join(self.kept_loads)}")
            load, limit = every[name], self.limits.get(name)
            nominal = float(load.of(self.nominal)[0]) if len(self.nominal) else np.nan
            values, _, inexact = worst.load_of([part.results for part in self.parts], load)
            self._loads[name] = Sample(name, load.unit, limit, nominal, values, inexact, self.status, self.design)
        return self._loads[name]

    def simulated(self, name: str) -> FloatArray:
        """Largest load of each joint that has results, those of unsettled joints included, SI; NaN without, (n,)."""
        view, plain = self.narrowed(name)
        load = loads_of(self.mechanism)[plain]
        return np.asarray(np.maximum.reduce([load.of(part.results) for part in view.parts]))

    def loads(self, names: Sequence[str]) -> list[Sample]:
        """Several loads; see `load`."""
        return [self.load(name) for name in names]

    @cached_property
    def kept_loads(self) -> tuple[str, ...]:
        """Loads that the study keeps."""
        return tuple(name for name, load in loads_of(self.mechanism).items() if holds(self.columns, load))

    @cached_property
    def bushing_loads(self) -> tuple[str, ...]:
        """Loads of `loads.shown_loads` that the study keeps."""
        return tuple(name for name in shown_loads(self.mechanism) if name in self.kept_loads)

    @property
    def shown_loads(self) -> tuple[str, ...]:
        """Loads that tables show: the bushing loads or, if the study keeps none, all others that it keeps."""
        return self.bushing_loads or self.kept_loads

    def load_of(self, limit: Limit) -> Sample:
        """Load that a limit is about; of several loads their maximum, or the maximum of load/level if levels differ.

        Its limit is the level. Raises as `load`.
        """
        levels = zip(limit.loads, limit.levels, strict=True)
        loads = [replace(self.load(name), limit=level) for name, level in levels]
        return loads[0] if limit.loads == (limit.name,) else largest_of(limit.name, loads, not limit.has_one_level)

    @property
    def together(self) -> Sample:
        """Largest ratio of load to limit of each joint over all limits of the study; above 1, a limit is exceeded."""
        return self.load_of(Limit(ANY_LIMIT, tuple(self.limits), tuple(self.limits.values()), self.mechanism))

    @cached_property
    def leading(self) -> tuple[str, ...]:
        """Leading load of each kind (force, torque, ...).

        Candidates are the loads with limits or, without limits, those of `loads.shown_loads` kept. The leading load is
        the one whose limit the largest share of the joints exceeds; ties are decided by the 99 % quantile over the
        limit (without limits by the 99 % quantile).
        """
        by_kind: dict[str, tuple[tuple[float, float], str]] = {}
        for load in self.loads(list(self.limits) or self.bushing_loads):
            if load.valid.size:
                kind = load_of(load.name, self.mechanism).kind.key
                candidate = worst.rank(load, load.limit), load.name
                by_kind[kind] = max(by_kind.get(kind, candidate), candidate, key=lambda item: item[0])
        return tuple(name for _, name in by_kind.values())

    @property
    def decisive(self) -> str:
        """What a verdict is about: of several limits all together, ``"any limit"``; else `most_exceeded`."""
        return ANY_LIMIT if len(self.limits) > 1 else self.most_exceeded

    @property
    def most_exceeded(self) -> str:
        """The leading load whose limit the largest share of the joints exceeds; see `leading`."""
        shares = {load.name: load.above(load.limit).estimate for load in self.loads(self.leading) if load.limit}
        known = {name: share for name, share in shares.items() if share == share}
        if known:
            return max(known, key=lambda name: known[name])
        return (*self.leading, *shown_loads(self.mechanism))[0]

    def point_of(self, name: str) -> str:
        """Operating point at which a load matters most: where most joints exceed its limit, else where it is largest.

        Empty if the file has one point without a name.
        """
        at, plain = self.narrowed(name)
        limit = self.load(name).limit
        return max(at.parts, key=lambda part: worst.rank(part.load(plain), limit)).points[0]

    @property
    def shares_of_time(self) -> FloatArray:
        """Share of the service time at each operating point, (points,), their sum is 1.

        `InputError` when the study does not give the shares of several points.
        """
        shares = np.array([self.store.points[name].share for name in self.points] if len(self.parts) > 1 else [1.0])
        if np.isnan(shares).any():
            remedy = "write share = ... in each [[operation]] and run the study again, which simulates nothing anew"
            remedy += f"; or look at one point: --point {self.points[0]}"
            raise input_error(self.path, "has operating points without a share of the time", remedy)
        return np.asarray(shares / shares.sum())

    @property
    def shares_of_revolutions(self) -> FloatArray:
        """Share of the revolutions at each operating point: share of the time times speed; see `shares_of_time`."""
        speeds = np.array([abs(self.store.points[name].operation.speed) for name in self.points])
        turns = self.shares_of_time * speeds
        return np.asarray(turns / turns.sum())

    @cached_property
    def design(self) -> Design:
        """How the joints were drawn, and what they allow to conclude."""
        return design_of(self.store)

    @property
    def sampled(self) -> bool:
        """Whether the joints are a sample of a production, not a grid or a design."""
        return self.design.is_sample

    def check(self) -> None:
        """Raise a `StoreError` if the joints give no estimate."""
        refusal = self.design.refuses()
        if refusal is not None:
            found, remedy = refusal
            raise store_error(self.path, found, remedy.format(path=self.path))

    def check_drawn(self) -> None:
        """Raise a StoreError for joints that were not drawn from tolerances."""
        if not self.study.tolerances:
            raise store_error(self.path, "holds joints that are not drawn from tolerances", SAMPLE)

    def rows(self, samples: ArrayLike) -> NDArray[np.intp]:
        """Rows of the campaign of samples."""
        return self.store.row(self.slots(samples))

    @cached_property
    def misfits(self) -> NDArray[np.bool_]:
        """Which joints have no result since they cannot be assembled, (n,)."""
        outside = self.status == Status.OUTSIDE_MODEL
        outside[outside] = misfits(self.parts[0].store, self.slots(np.flatnonzero(outside)))
        return frozen(outside)

    def slots(self, samples: ArrayLike) -> NDArray[np.intp]:
        """File slots of samples."""
        return np.asarray(samples, dtype=np.intp) + self.store.first_sample

    @property
    def campaign_samples(self) -> range:
        """Number of each sample among the random joints of the campaign, (n,): the sample itself but for a slice."""
        return self.store.samples

    def errors(self, samples: NDArray[np.intp], columns: Sequence[str] | None = None) -> NDArray[np.void]:
        """Errors of samples, given in ascending order, (m,) table ERROR.

        Parameters
        ----------
        samples : ndarray of int, shape (m,)
            Samples.
        columns : sequence of str, optional
            Columns to read of samples beyond the first `BLOCK`; all without it. The result has at least these.
        """
        if not samples.size or samples[-1] < len(self._first_errors):
            return self._first_errors[samples]
        return pick(lambda slots: self.store.errors(slots, columns), self.slots(samples), BLOCK)

    def error_blocks(self, columns: Sequence[str]) -> Iterator[NDArray[np.void]]:
        """Yield the errors of all samples in consecutive blocks, with at least these columns."""
        yield self._first_errors
        for first in range(len(self._first_errors), self.n, BLOCK):
            yield self._errors(first, min(first + BLOCK, self.n), columns)

    @cached_property
    def _first_errors(self) -> NDArray[np.void]:
        return frozen(self._errors(0, min(BLOCK, self.n), None))

    def _errors(self, first: int, last: int, columns: Sequence[str] | None) -> NDArray[np.void]:
        skip = self.store.first_sample
        return self.store.errors(slice(first + skip, last + skip), columns)

    @cached_property
    def counts(self) -> Counts:
        """Numbers of samples by status."""
        return Counts.of(self.status)

    def count(self, *states: Status) -> int:
        """Number of samples in any of the given states."""
        return int(np.isin(self.status, [int(state) for state in states]).sum())

    def head(self) -> str:
        """Sentence with the number of joints and of those without a valid result."""
        pending = self.counts.total - self.counts.done
        text = f"{self.counts.done} joint{'s' * (self.counts.done != 1)} ({METHODS.get(self.method, self.method)})"
        if all(self.points):
            *others, last = self.points
            text += f", each at {', '.join(others)} and {last}" if others else f" at {last}"
        return f"{text}, {self.counts.shortfall}" + (f", {pending} still pending" if pending else "")
