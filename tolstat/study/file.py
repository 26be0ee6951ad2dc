"""Reading a study or case file section by section, so that all of its faults are reported at once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar

from tolstat import joint
from tolstat.common import strict
from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.files import read_input
from tolstat.common.loads import UNIT_OF_LOAD, split
from tolstat.common.strict import read_toml
from tolstat.joint import Joint, Operation
from tolstat.joint.derived import BEARING
from tolstat.joint.model import Assumed
from tolstat.joint.overrides import leaves, merged
from tolstat.joint.reading import faults_of_assumed, is_joint
from tolstat.study import fatigue, listing, points, proposal, selection, signals, sorting
from tolstat.study.axes import is_zone, zone_of
from tolstat.study.design import KEYS, Design, swept
from tolstat.study.fatigue import Fatigue
from tolstat.study.model import Output, Sampling, Solver, SweepAxis, SweepEntry
from tolstat.study.points import Point
from tolstat.study.proposal import Proposal, ProposalEntry
from tolstat.study.selection import TOLERANCED, UNITS, Assignments, Entry
from tolstat.study.sorting import Gauge
from tolstat.study.tolerances import fits, reading
from tolstat.study.tolerances.correlation import Copula, Correlation, Group, assemble, correlated, groups
from tolstat.study.tolerances.entry import Site
from tolstat.study.tolerances.fits import Fit
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
BESIDE_FIT = ("is set by tolerances.fit already", "remove one of the two")
"""Fault and remedy of a diameter."""


class StudyFile:
    """A TOML file, its sections as parts of a study, and the faults found in them so far.

    Each property reads one section when it is first used, adds its faults to `faults` and gives what could be read;
    `finish` raises them. `text` has mean and orders in place of measured signals.

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
        self._overridden = ""
        self.faults: list[Fault] = []
        self.text, self.signals = self._source, tuple[str, ...]()
        if "file" in self._source:
            self.text, self.signals = signals.replaced(self._source, self.data, self.path, self.faults)
            self.data = read_toml(path, self.text)
        self._claims = Assignments(self.place)
        allowed = list(sections)
        for key in self.data:
            if key not in allowed:
                self.fault(key, "unknown key", strict.did_you_mean(key, allowed))

    def finish(self) -> None:
        """Raise an error if faults were found.

        Raises
        ------
        InputError
            With every fault; those of the file have its lines, unless their value is from the command line.
        """
        if not self.faults:
            return
        lined = strict.with_lines(self.faults, self.place, self._source) if self._lined else self.faults
        pairs = zip(self.faults, lined, strict=True)
        raise InputError([plain if plain.place == self._overridden else with_line for plain, with_line in pairs])

    def override_n(self, n: int) -> None:
        """Set the number of joints from the command line."""
        if isinstance(self.data.setdefault("sampling", {}), dict):
            self.data["sampling"]["n"] = n
        self._overridden = f"{self.place}: sampling.n"

    @cached_property
    def fit(self) -> Fit | None:
        """``tolerances.fit``: the fit of all pins in their holes; another one in place of a fit with faults."""
        table = self.data.get("tolerances")
        with gather(self.faults):
            return fits.read(table, self.place)
        return fits.stand_in(table)

    @cached_property
    def joint(self) -> Joint | None:
        """``[joint]``: a joint file by name or path, and keys that replace some of its own; diameters by the fit."""
        base, overrides = self._table("joint").get("base"), self._joint_keys
        if base is None:
            self.fault("joint.base", "missing key", 'add base, for example base = "cirelli2021"')
        elif not isinstance(base, str):
            self.fault("joint.base", f"{base!r} is not a text", "give a name in data/joints or a path")
        else:
            if self.fit is not None:
                overrides = self._with_diameters(self.fit, overrides)
            with gather(self.faults):
                return joint.load(base, overrides, self.place, self.path.parent)
        return None

    @property
    def _joint_keys(self) -> dict[str, Any]:
        """Keys of ``[joint]`` that replace those of its joint file."""
        return {key: value for key, value in self._table("joint").items() if key != "base"}

    def _with_diameters(self, fit: Fit, overrides: Mapping[str, Any]) -> dict[str, Any]:
        """Keys of the joint with the fit's diameters; note diameters and clearance that the study sets beside it."""
        contact = overrides.get("contact", {})
        if not isinstance(contact, Mapping):
            return merged(overrides, {"contact": fit.diameters})
        twice = [key for key in (*fit.diameters, "clearance") if key in contact]
        for key in twice:
            self.fault(f"joint.contact.{key}", *BESIDE_FIT)
        return {**overrides, "contact": merged({k: v for k, v in contact.items() if k not in twice}, fit.diameters)}

    @cached_property
    def assumed(self) -> tuple[Assumed, ...]:
        """``[[assumed]]``: assumptions that the study adds to those of its joint file."""
        before = len(self.faults)
        entries = self._list("assumed", Assumed)
        if self.joint is None or len(self.faults) > before:
            return ()
        self.faults += faults_of_assumed(entries, self.joint.given("json"), self._joint_keys, self.place)
        for number, entry in enumerate(entries if self.fit else []):
            for n, value in enumerate(entry.values):
                for key in (key for key in leaves(value) if key in BEARING):
                    self.fault(f"assumed[{number}].values[{n}].{key}", *BESIDE_FIT)
        return tuple(entries)

    @cached_property
    def points(self) -> tuple[Point, ...]:
        """``[operation]``, or ``[[operation]]``: the operating points; empty if one could not be read."""
        if "operation" not in self.data:
            self.fault("operation", "missing table", "add [operation]")
            return ()
        with gather(self.faults):
            return points.read(self.data["operation"], self.place)
        return ()

    @property
    def operation(self) -> Operation | None:
        """The first operating point."""
        return self.points[0].operation if self.points else None

    @cached_property
    def solver(self) -> Solver | None:
        """``[solver]``."""
        return self.model("solver", Solver)

    @cached_property
    def sampling(self) -> Sampling | None:
        """``[sampling]``."""
        remedy = f"add [sampling]; to simulate one joint: tolstat simulate {self.place}"
        return self.model("sampling", Sampling, remedy)

    @cached_property
    def output(self) -> Output | None:
        """``[output]``."""
        return self.model("output", Output)

    @cached_property
    def errors(self) -> dict[str, float]:
        """``[errors]``: the errors that every joint has."""
        with gather(self.faults):
            return selection.fixed_errors(self._table("errors"), ("errors",), self.place, self._claims)
        return {}

    @cached_property
    def scatter(self) -> Tolerances:
        """``[tolerances]``: how errors scatter."""
        written = []
        units = dict[str, str]()
        for entry in fits.entries(self._table("tolerances"), self.fit):
            with gather(self.faults):
                selected = selection.resolve(entry, TOLERANCED, self.place)
                with gather(self.faults):
                    self._claims.claim(entry, selected)
                units |= {name: TOLERANCED[name] for name in selected}
                written.append((entry, selected))
        read = reading.read(written, Nominal(self.joint, self.path.parent), self.place, self.faults)
        drawn: dict[str, list[str]] = {}
        for quantity in read.distributions:
            drawn.setdefault(zone_of(quantity) if is_zone(quantity) else quantity, []).append(quantity)
        # those with faults stand for what they would draw, so that others do not seem to lack them
        self._toleranced = {quantity: unit for name, unit in units.items() for quantity in drawn.get(name, [name])}
        return read

    @property
    def accepted(self) -> set[str]:
        """Diameters by which parts are accepted."""
        return {bonus.diameter for bonus in self.scatter.rejecting}

    @cached_property
    def copula(self) -> Copula:
        """``[[correlation]]``, and that of errors that share the score of their lot."""
        lots, before = self.scatter.lots, len(self.faults)
        entries = self._list("correlation", Correlation)
        if len(self.faults) == before:
            with gather(self.faults):
                copula = correlated(assemble(entries, self._toleranced, self.place), lots, self.place)
                for name in sorted(self.accepted & set(copula.names)):
                    found = f"{name} cannot be correlated: parts are accepted by this diameter and the position"
                    remedy = 'remove the correlation or the bonus, or write material_condition = "fills"'
                    self.fault("correlation", found, remedy)
                return copula
        return Copula()

    @cached_property
    def proposals(self) -> tuple[Proposal, ...]:
        """``[[proposal]]``: distributions of importance sampling beside the tolerances."""
        together = [tuple(entry.quantities) for entry in self.scatter.entries]
        proposals = []
        for number, entry in enumerate(self._list("proposal", ProposalEntry)):
            with gather(self.faults):
                path = ("proposal", number)
                proposals.append(proposal.resolve(entry, list(self._toleranced), together, self.place, path))
        with gather(self.faults):
            proposal.check_shares(proposals, self.place)
        return tuple(proposals)

    @cached_property
    def sweep(self) -> tuple[SweepAxis, ...]:
        """``[sweep]``: the axes of a grid."""
        axes = []
        for entry in self._entries("sweep"):
            with gather(self.faults):
                units = UNITS if selection.select(entry.pattern, UNITS) else UNITS | KEYS
                names = selection.resolve(entry, units, self.place)
                with gather(self.faults):
                    self._claims.claim(entry, names)
                context = {"site": Site(names[0], units[names[0]], 0.0, self.path.parent)}
                read = strict.validate(SweepEntry, entry.value, self.place, prefix=entry.path, context=context)
                axes.append(SweepAxis(tuple(names), read.start, read.stop, read.points))
        return tuple(axes)

    @cached_property
    def rejects(self) -> tuple[Gauge, ...]:
        """``[reject]``: joints that are rejected at assembly."""
        return sorting.read(self._entries("reject"), self.path.parent, self.place, self.faults)

    @cached_property
    def limits(self) -> dict[str, float]:
        """``[limits]``: limit of each load that has one (SI), ``cross1.F`` at all points, ``cross1.F at cruise``."""
        limits: dict[str, float] = {}
        claims = Assignments(self.place)
        every = [point.name for point in self.points]
        for entry in self._entries("limits"):
            with gather(self.faults):
                pattern, where = split(entry.pattern)
                names = selection.resolve(entry._replace(pattern=pattern), UNIT_OF_LOAD, self.place)
                value = selection.quantity(entry, UNIT_OF_LOAD[names[0]], self.place)
                if every:  # if not, the points have faults of their own
                    chosen = points.names_of(where, every, f"{self.place}: {strict.dotted(entry.path)}")
                    names = [points.at(name, chosen, every) for name in names]
                claims.claim(entry, names)
                if value <= 0:
                    self.fault(strict.dotted(entry.path), f"{entry.value!r} is not positive", "give a limit above zero")
                limits |= dict.fromkeys(names, value)
        return limits

    @cached_property
    def fatigue(self) -> Fatigue:
        """``[fatigue]``: settings for the evaluation of load cycles."""
        with gather(self.faults):
            return fatigue.read(self.data.get("fatigue", {}), self.place, [point.name for point in self.points])
        return Fatigue()

    @cached_property
    def groups(self) -> tuple[Group, ...]:
        """What a pick-freeze design exchanges together."""
        sampling = self.sampling
        if sampling is None or sampling.method != "pick_freeze":
            return ()
        return groups(self.scatter.entries, self.copula, sampling.groups)

    @property
    def _nominal(self) -> listing.Nominal | None:
        if self.joint is None or self.operation is None or self.solver is None:
            return None
        return listing.Nominal(self.joint, self.operation, self.solver)

    @cached_property
    def listed(self) -> Design | None:
        """``[grid]``, ``[[case]]`` and ``[[variant]]``: joints listed one by one, variants of the joint."""
        with gather(self.faults):
            if self.sampling is not None and self.sampling.method == "cases":
                return listing.read(self.data, self._nominal, self.place, self.path.parent)
        return None

    @cached_property
    def swept(self) -> Design | None:
        """Joints of a sweep of dimensions; None if it sweeps errors alone."""
        if self.sampling is None or self.sampling.method != "sweep" or self._nominal is None:
            return None
        variants = listing.Variants(self._table("joint"), self._nominal, self.place, self.path.parent)
        with gather(self.faults):
            return swept(self.sweep, self._nominal, variants.swept, self.sampling.first_sample, self.place)
        return None

    def model(self, section: str, model: type[ModelT], if_missing: str = "") -> ModelT | None:
        """Read a section that is one model; of one that may be missing the model has its defaults."""
        if if_missing and section not in self.data:
            self.fault(section, "missing table", if_missing)
            return None
        with gather(self.faults):
            return strict.validate(model, self.data.get(section, {}), self.place, prefix=(section,))
        return None

    def _list(self, section: str, model: type[ModelT]) -> list[ModelT]:
        """Read a section that is a list of tables; return the valid ones."""
        data = self.data.get(section, [])
        if not isinstance(data, list):
            self.fault(section, "is not a list of tables", f"write [[{section}]]")
            return []
        valid = []
        for number, item in enumerate(data):
            with gather(self.faults):
                valid.append(strict.validate(model, item, self.place, prefix=(section, number)))
        return valid

    def _table(self, section: str) -> Mapping[str, Any]:
        table = self.data.get(section, {})
        if isinstance(table, Mapping):
            return table
        self.fault(section, f"{table!r} is not a table", f"write [{section}]")
        return {}

    def _entries(self, section: str) -> list[Entry]:
        return list(selection.entries(self._table(section), section))

    def fault(self, key: str, found: str, remedy: str) -> None:
        """Note a fault of a key, once: several properties may read one section."""
        fault = Fault(f"{self.place}: {key}", found, remedy)
        if fault not in self.faults:
            self.faults.append(fault)
