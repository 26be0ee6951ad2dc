"""Reading a study or case file section by section, so that all of its faults are reported at once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from tolstat import joint
from tolstat.common import strict
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.files import read_input
from tolstat.common.loads import UNIT_OF_LOAD, load_of, split
from tolstat.common.strict import read_toml
from tolstat.common.tables import FINEST_STEPS
from tolstat.joint import Joint, Operation
from tolstat.joint.derived import BEARING
from tolstat.joint.model import Assumed
from tolstat.joint.overrides import leaves, merged
from tolstat.joint.reading import faults_of_assumed, is_joint
from tolstat.study import fatigue, known, listing, points, proposal, selection, selective, signals, sorting, swept
from tolstat.study.axes import is_zone, zone_of
from tolstat.study.design import Design
from tolstat.study.model import MAX_ROWS, Output, Sampling, Solver, SweepAxis, SweepEntry
from tolstat.study.points import Point
from tolstat.study.proposal import Proposal, ProposalEntry
from tolstat.study.selection import TOLERANCED, UNITS, Assignments, Entry
from tolstat.study.sorting import Gauge
from tolstat.study.swept import KEYS, Swept
from tolstat.study.tolerances import fits, reading
from tolstat.study.tolerances.correlation import Copula, Correlation, assemble
from tolstat.study.tolerances.entry import Site
from tolstat.study.tolerances.fits import Fit
from tolstat.study.tolerances.lots import Lot, correlated
from tolstat.study.tolerances.reading import Nominal, Tolerances

ModelT = TypeVar("ModelT", bound=strict.Strict)

OF_CASE = ("joint", "operation", "solver", "errors")
"""Sections that a case may have, too."""
SECTIONS = (
    *OF_CASE,
    *("tolerances", "correlation", "sampling", "proposal", "sweep", "grid", "case", "variant", "assumed", "reject"),
    *("limits", "fatigue", "output"),
)
"""Sections of a study, in the order of the reference."""
SCATTER = ("tolerances", "correlation", "errors", "reject")
"""Sections that define the joints of most sampling methods; the first is required."""
SECTIONS_OF = {
    "sweep": ("sweep", "errors"),
    "cases": ("case", "grid", "variant"),
    "importance": (*SCATTER, "proposal"),
}
"""Sections that define the joints of the other sampling methods; the first is required."""


class StudyFile:
    """A TOML file and the faults found in it so far.

    Each method reads one section, notes its faults and returns what could be read; `finish` raises if there was any.
    `text` has mean and orders in place of measured signals.

    Parameters
    ----------
    path : Path
        The file.
    sections : iterable of str
        Top-level keys that it may have.
    text : str, optional
        TOML to read instead of the file's content.

    Raises
    ------
    InputError
        When the file is not readable TOML, or a joint file.
    """

    def __init__(self, path: Path, sections: Iterable[str], text: str | None = None) -> None:
        self.path = path
        self.place = str(path)
        self.data = read_toml(path, text)
        if is_joint(self.data):
            remedy = f'name it in a study, base = "{path.name}" under [joint]; tolstat new writes one'
            raise InputError([Fault(self.place, "is a joint file, not a study or case", remedy)])
        self._source = read_input(path) if text is None else text
        self._lined = text is None
        self._overridden: set[str] = set()
        self._faults: list[Fault] = []
        self.text, self.signals = self._source, tuple[str, ...]()
        if "file" in self._source:
            self.text, self.signals = signals.replaced(self._source, self.data, self.path, self._faults)
            self.data = read_toml(path, self.text)
        self._claims = Assignments(self.place)
        self._toleranced: dict[str, str] = {}
        self._together: list[tuple[str, ...]] = []
        self._accepted: set[str] = set()
        allowed = list(sections)
        for key in self.data:
            if key not in allowed:
                self._fault((key,), "unknown key", strict.did_you_mean(key, allowed))

    def finish(self) -> None:
        """Raise an error if faults were found.

        Raises
        ------
        InputError
            With every fault; those of the file have its lines, unless their value is from the command line.
        """
        if not self._faults:
            return
        lined = strict.with_lines(self._faults, self.place, self._source) if self._lined else self._faults
        pairs = zip(self._faults, lined, strict=True)
        raise InputError([fault if fault.place in self._overridden else found for fault, found in pairs])

    def override(self, section: str, key: str, value: object) -> None:
        """Replace a value of the file by one from the command line."""
        if isinstance(self.data.setdefault(section, {}), dict):
            self.data[section][key] = value
        self._overridden.add(f"{self.place}: {section}.{key}")

    def model(self, section: str, model: type[ModelT], *, required: bool = False) -> ModelT | None:
        """Read a section that is one model; the model has its defaults where the file lacks the section."""
        if required and section not in self.data:
            alone = f"; to simulate one joint: tolstat simulate {self.place}" if section == "sampling" else ""
            self._fault((section,), "missing table", f"add [{section}]{alone}")
            return None
        with gather(self._faults):
            return strict.validate(model, self.data.get(section, {}), self.place, prefix=(section,))
        return None

    def fit(self) -> Fit | None:
        """``tolerances.fit``: the fit of all pins in their holes; another one in place of a fit with faults."""
        table = self.data.get("tolerances")
        with gather(self._faults):
            return fits.read(table, self.place)
        return fits.stand_in(table)

    def points(self) -> tuple[Point, ...]:
        """``[operation]``, or ``[[operation]]``: the operating points; empty if one could not be read."""
        if "operation" not in self.data:
            self._fault(("operation",), "missing table", "add [operation]")
            return ()
        with gather(self._faults):
            return points.read(self.data["operation"], self.place)
        return ()

    def joint(self, fit: Fit | None = None) -> Joint | None:
        """``[joint]``: a joint file by name or path, and keys that replace some of its own; diameters by the fit."""
        table = self._table("joint")
        base = table.get("base")
        if base is None:
            self._fault(("joint", "base"), "missing key", 'add base, for example base = "cirelli2021"')
        elif not isinstance(base, str):
            self._fault(("joint", "base"), f"{base!r} is not a text", "give a name in data/joints or a path")
        else:
            overrides = {key: value for key, value in table.items() if key != "base"}
            if fit is not None:
                overrides = self._with_diameters(fit, overrides)
            with gather(self._faults):
                return joint.load(base, overrides, self.place, self.path.parent)
        return None

    def _with_diameters(self, fit: Fit, overrides: Mapping[str, Any]) -> dict[str, Any]:
        """Keys of the joint with the fit's diameters; note diameters and clearance that the study sets beside it."""
        own = overrides.get("contact")
        if not isinstance(own, Mapping):
            return merged(overrides, {"contact": fit.diameters})
        both = [key for key in (*fit.diameters, "clearance") if key in own]
        for key in both:
            self._fault(("joint", "contact", key), "is set by tolerances.fit already", "remove one of the two")
        others = {key: value for key, value in own.items() if key not in both}
        return {**overrides, "contact": merged(others, fit.diameters)}

    def assumed(self, joint: Joint | None, fit: Fit | None) -> tuple[Assumed, ...]:
        """``[[assumed]]``: assumptions that the study adds to those of its joint file."""
        before = len(self._faults)
        entries = self._list("assumed", Assumed)
        if joint is None or len(self._faults) > before:
            return ()
        own = {key: value for key, value in self._table("joint").items() if key != "base"}
        self._faults += faults_of_assumed(entries, joint.given("json"), own, self.place)
        if fit is not None:
            for number, entry in enumerate(entries):
                both = [(n, key) for n, value in enumerate(entry.values) for key in leaves(value) if key in BEARING]
                for n, key in both:
                    path: tuple[int | str, ...] = ("assumed", number, "values", n, *key.split("."))
                    self._fault(path, "is set by tolerances.fit already", "remove one of the two")
        return tuple(entries)

    def errors(self) -> dict[str, float]:
        """``[errors]``: the errors that every joint has."""
        with gather(self._faults):
            return selection.fixed_errors(self._table("errors"), ("errors",), self.place, self._claims)
        return {}

    def tolerances(self, joint: Joint | None, fit: Fit | None) -> Tolerances:
        """``[tolerances]``: how errors scatter."""
        written = []
        for entry in fits.entries(self._table("tolerances"), fit):
            with gather(self._faults):
                selected = selection.resolve(entry, TOLERANCED, self.place)
                with gather(self._faults):
                    self._claims.claim(entry, selected)
                self._toleranced |= {name: TOLERANCED[name] for name in selected}
                written.append((entry, selected))
        found = reading.read(written, Nominal(joint, self.path.parent), self.place, self._faults)
        self._together = [tuple(entry.quantities) for entry in found.entries]
        self._accepted = {bonus.diameter for bonus in found.rejecting}
        drawn: dict[str, list[str]] = {}
        for quantity in found.distributions:
            drawn.setdefault(zone_of(quantity) if is_zone(quantity) else quantity, []).append(quantity)
        self._toleranced = {q: unit for name, unit in self._toleranced.items() for q in drawn.get(name, [name])}
        return found

    def correlation(self, lots: Mapping[str, Lot]) -> Copula:
        """``[[correlation]]``, and that of errors that share the score of their lot; call `tolerances` first."""
        before = len(self._faults)
        entries = self._list("correlation", Correlation)
        if len(self._faults) == before:
            with gather(self._faults):
                copula = correlated(assemble(entries, self._toleranced, self.place), lots, self.place)
                for name in sorted(self._accepted & set(copula.names)):
                    remedy = 'remove the correlation or the bonus, or write material_condition = "fills"'
                    found = f"{name} cannot be correlated: parts are accepted by this diameter and the position"
                    self._fault(("correlation",), found, remedy)
                return copula
        return Copula()

    def proposals(self) -> tuple[Proposal, ...]:
        """``[[proposal]]``: distributions of importance sampling beside the tolerances; call `tolerances` first."""
        found = []
        for number, entry in enumerate(self._list("proposal", ProposalEntry)):
            with gather(self._faults):
                names = list(self._toleranced)
                found.append(proposal.resolve(entry, names, self._together, self.place, ("proposal", number)))
        with gather(self._faults):
            proposal.check_shares(found, self.place)
        return tuple(found)

    def sweep(self) -> tuple[SweepAxis, ...]:
        """``[sweep]``: the axes of a grid."""
        axes = []
        for entry in self._entries("sweep"):
            with gather(self._faults):
                errors = selection.select(entry.pattern, UNITS)
                names = selection.resolve(entry, UNITS if errors else UNITS | KEYS, self.place)
                with gather(self._faults):
                    self._claims.claim(entry, names)
                site = Site(names[0], (UNITS | KEYS)[names[0]], 0.0, self.path.parent)
                context = {"site": site}
                read = strict.validate(SweepEntry, entry.value, self.place, prefix=entry.path, context=context)
                axes.append(SweepAxis(tuple(names), read.start, read.stop, read.points))
        return tuple(axes)

    def swept(self, nominal: listing.Nominal, sweep: tuple[SweepAxis, ...], nominal_first: bool) -> Swept | None:
        """Joints of a sweep of dimensions; None if it sweeps errors alone."""
        variants = listing.Variants(self._table("joint"), nominal, self.place, self.path.parent)
        with gather(self._faults):
            return swept.read(sweep, variants, nominal.joint, nominal_first, self.place)
        return None

    def rejects(self) -> tuple[Gauge, ...]:
        """``[reject]``: joints that are rejected at assembly."""
        return sorting.read(self._entries("reject"), self.path.parent, self.place, self._faults)

    def limits(self, at: Sequence[Point]) -> dict[str, float]:
        """``[limits]``: limit of each load that has one (SI), ``cross1.F`` at all points, ``cross1.F at cruise``."""
        limits: dict[str, float] = {}
        claims = Assignments(self.place)
        every = [point.name for point in at]
        for entry in self._entries("limits"):
            with gather(self._faults):
                pattern, where = split(entry.pattern)
                found = selection.resolve(entry._replace(pattern=pattern), UNIT_OF_LOAD, self.place)
                value = selection.quantity(entry, UNIT_OF_LOAD[found[0]], self.place)
                names = found
                if every:  # if not, the points have faults of their own
                    chosen = points.names_of(where, every, f"{self.place}: {strict.dotted(entry.path)}")
                    names = [points.at(name, chosen, every) for name in found]
                claims.claim(entry, names)
                if value <= 0:
                    self._fault(entry.path, f"{entry.value!r} is not positive", "give a limit above zero")
                limits |= dict.fromkeys(names, value)
        return limits

    def fatigue(self, at: Sequence[Point]) -> fatigue.Fatigue:
        """``[fatigue]``: settings for the evaluation of load cycles."""
        with gather(self._faults):
            return fatigue.read(self.data.get("fatigue", {}), self.place, [point.name for point in at])
        return fatigue.Fatigue()

    def listed(self, joint: Joint | None, operation: Operation | None, solver: Solver | None) -> Design | None:
        """``[grid]``, ``[[case]]`` and ``[[variant]]``: joints listed one by one, variants of `joint`."""
        nominal = listing.Nominal(joint, operation, solver) if joint and operation and solver else None
        with gather(self._faults):
            return listing.read(self.data, nominal, self.place, self.path.parent)
        return None

    def check_points(self, sampling: Sampling, sweep: tuple[SweepAxis, ...], at: Sequence[Point]) -> None:
        """Note several operating points where the joints have points of their own."""
        if len(at) < 2:
            return
        if sampling.method == "cases":
            remedy = "write one [operation], and the others in [[variant]]: operation = { ... }"
            self._fault(("operation",), "several operating points are not possible with 'cases'", remedy)
        for name in (name for axis in sweep for name in axis.names if name.startswith("operation.")):
            remedy = "write one [operation], or sweep other errors"
            self._fault(("sweep", name), "is given by several [[operation]] already", remedy)

    def check_method(self, sampling: Sampling, sweep: tuple[SweepAxis, ...], read: Tolerances, copula: Copula) -> None:
        """Note sections that the sampling method needs or does not use."""
        used = SECTIONS_OF.get(sampling.method, SCATTER)
        needed = used[0]
        if not self.data.get(needed):
            header = "[[case]]" if needed == "case" else f"[{needed}]"
            found = "missing table: no error has a tolerance" if needed == "tolerances" else "missing table"
            self._fault((needed,), found, f"add {header}, or set another sampling.method")
        known = dict.fromkeys((*SCATTER, *(name for names in SECTIONS_OF.values() for name in names)))
        for section in known:
            if section not in used and section in self.data:
                remedy = "remove it, or set another sampling.method"
                self._fault((section,), f"has no effect with {sampling.method!r}", remedy)
        if sampling.joints_per_lot > 1 and not read.lots:
            remedy = "write lot = { share = 0.3 } in an entry of [tolerances], or remove the key"
            self._fault(("sampling", "joints_per_lot"), "has no effect: no tolerance has a lot", remedy)
        if sampling.is_matched and sampling.selective is not None:
            depending = {*copula.names, *read.lots, *self._accepted}
            faults = selective.faults(sampling.selective, read.entries, read.distributions, depending, self.place)
            self._faults += faults
        if sampling.method == "cases" and self.data.get("limits"):
            self._fault(("limits",), "has no effect with 'cases'", "remove it: listed joints have no exceedance")
        if sampling.method == "subset":
            remedy = 'write "random", and run: tolstat rare STUDY --limit "cross1.F > 900 N"'
            self._fault(("sampling", "method"), "'subset' is set by tolstat rare, not in a study", remedy)
        if sampling.method == "importance" and not self.data.get("proposal"):
            remedy = "add [[proposal]] with share, and widen, shift or parts"
            self._fault(("proposal",), "missing table: distributions to draw joints from beside the tolerances", remedy)
        points = math.prod(axis.points for axis in sweep)
        if points > MAX_ROWS:
            self._fault(("sweep",), f"gives {points} joints", f"give at most {MAX_ROWS}")

    def check_known(self, read: Tolerances, copula: Copula, method: str) -> None:
        """Note entries known from measured parts whose joints cannot be reweighted; call `tolerances` first."""
        self._faults += known.faults(known.of(read.entries), method, copula.names, self._accepted, self.place)

    def check_one_joint(self, solver: Solver) -> None:
        """Note settings that only a campaign can have."""
        if solver.fidelity == "auto":
            remedy = 'write "dynamic", "quasistatic" or "ideal"'
            self._fault(("solver", "fidelity"), "'auto' needs the joints of a campaign, a case has one joint", remedy)

    def check_histories(self, output: Output, solver: Solver, listed: Design | None) -> None:
        """Note histories of different lengths, and more harmonics than the steps per revolution resolve.

        ``auto`` chooses enough steps for the harmonics.
        """
        different = {s.steps_per_rev for s in listed.solvers} if listed else set()
        if output.histories != "none" and len(different) > 1:
            found = f"variants have different steps per revolution: {', '.join(map(str, sorted(different)))}"
            remedy = 'give all variants the same solver.steps_per_rev, or write histories = "none"'
            self._fault(("output", "histories"), found, remedy)
        steps = FINEST_STEPS if solver.fidelity == "auto" else solver.steps_per_rev
        most = (steps - 1) // 2
        if "harmonics" in output.histories and output.harmonics > most:
            found = f"{steps} steps per revolution do not resolve {output.harmonics} harmonics"
            self._fault(("output", "harmonics"), found, f"give at most {most}, or a larger solver.steps_per_rev")

    def check_fatigue(self, output: Output) -> None:
        """Note a fatigue section where no cycles are stored; for points joints are simulated again."""
        own = self.data.get("fatigue")
        if output.histories == "none" and isinstance(own, Mapping) and "point" not in own:
            self._fault(("fatigue",), "has no effect without histories", 'write histories = "cycles" in [output]')

    def check_limits(self, output: Output, limits: Mapping[str, float]) -> None:
        """Note limits of loads that are not stored."""
        held = {c.name for c in output.columns}
        lacking = [name for load in limits for name in load_of(load).columns if name not in held]
        if lacking:
            found = f"leaves out columns that [limits] needs: {', '.join(lacking)}"
            self._fault(("output", "results"), found, "add these columns, or remove their limits")

    def _list(self, section: str, model: type[ModelT]) -> list[ModelT]:
        """Read a section that is a list of tables; return the valid ones."""
        data = self.data.get(section, [])
        if not isinstance(data, list):
            self._fault((section,), "is not a list of tables", f"write [[{section}]]")
            return []
        found = []
        for number, item in enumerate(data):
            with gather(self._faults):
                found.append(strict.validate(model, item, self.place, prefix=(section, number)))
        return found

    def _table(self, section: str) -> Mapping[str, Any]:
        table = self.data.get(section, {})
        if isinstance(table, Mapping):
            return table
        self._fault((section,), f"{table!r} is not a table", f"write [{section}]")
        return {}

    def _entries(self, section: str) -> list[Entry]:
        return list(selection.entries(self._table(section), section))

    def _fault(self, path: tuple[int | str, ...], found: str, remedy: str) -> None:
        self._faults.append(Fault(f"{self.place}: {strict.dotted(path)}", found, remedy))
