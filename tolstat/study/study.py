"""Studies, read from their TOML files."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from html import escape
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from tolstat.common.columns import Column, holds
from tolstat.common.errors import Fault, raise_all
from tolstat.common.loads import limits_in_words, loads_of, split
from tolstat.common.mechanism import Mechanism
from tolstat.common.strict import dotted, with_lines
from tolstat.common.tables import DESIGN, Variant
from tolstat.common.toml_lines import KeyPath
from tolstat.common.wording import Wording, row_of
from tolstat.joint import SPLINE, Joint, Operation, OperationOfLinkage, affecting_results, mechanism_of
from tolstat.joint.linked import joint_of
from tolstat.joint.model import Assumed, leaves
from tolstat.joint.sections import mounting_and_law
from tolstat.study import mounting
from tolstat.study.axes import Axis
from tolstat.study.design import Design
from tolstat.study.fatigue import Fatigue
from tolstat.study.model import Output, Sampling, Solver, SweepAxis
from tolstat.study.mounting import Setting
from tolstat.study.points import Point, limits_at, only_one
from tolstat.study.tolerances.correlation import Copula, Lot
from tolstat.study.tolerances.distributions import Distribution
from tolstat.study.tolerances.entry import SingleEntry, Toleranced
from tolstat.study.tolerances.fits import Fit

MU = "friction.mu"


@dataclass(frozen=True, repr=False)
class Study:
    """A campaign: its joints, the distribution of their errors, limits, and what is stored; or a case of one joint.

    Attributes
    ----------
    path : Path
        The file.
    text : str
        The file as read.
    joint : Joint
        Nominal joint.
    operation : Operation
        Operating point; of several the first, see `at`.
    solver : Solver
        Numerical settings.
    errors : dict
        Fixed errors of every joint except the nominal one (SI).
    points : tuple of Point
        All operating points; the same joints are simulated at each.
    tolerances : dict
        Name to distribution of each quantity that is drawn: an error; or a vector of a zone, such as
        ``pin1.position_inner``, with the distribution of its radius.
    entries : tuple of Toleranced
        Entries of ``[tolerances]`` with what they select.
    axes : dict of str to Axis
        Features and pairs with zones: how the errors follow from what is drawn.
    copula : Copula
        Correlation of the errors of a joint.
    lots : dict of str to Lot
        How errors depend on the lot of their joint.
    sampling : Sampling
        How many, and how they are drawn.
    sweep : tuple of SweepAxis
        Axes of a grid, the last varying fastest; empty unless ``sampling.method`` is ``sweep``.
    swept : Design, optional
        The joints of a sweep of dimensions; None for other sweeps and methods.
    listed : Design, optional
        The joints listed one by one; None unless ``sampling.method`` is ``cases``.
    limits : dict
        Result name (``cross1.F``, ``fork2.T``, ``pin1.contact``, ``psi``) to limit (SI), which holds at all operating
        points; or only at those that it names, ``cross1.F at cruise``.
    fatigue : Fatigue
        Settings for the evaluation of load cycles.
    output : Output
        What is stored of each joint.
    fit : Fit, optional
        Fit by ISO 286 that gives the diameters.
    assumed : tuple of Assumed
        Assumptions that the study adds to those of its joint, see `assumptions`; they affect no joint.
    notes : tuple of str
        Notes on measured signals that speed or torque follow from, see `signals.replaced`, and on measured joints.
    """

    path: Path
    text: str
    joint: Joint
    operation: Operation
    solver: Solver
    errors: dict[str, float]
    sampling: Sampling
    output: Output
    points: tuple[Point, ...]
    tolerances: dict[str, Distribution] = field(default_factory=dict)
    entries: tuple[Toleranced, ...] = ()
    axes: Mapping[str, Axis] = field(default_factory=dict)
    copula: Copula = field(default_factory=Copula)
    lots: Mapping[str, Lot] = field(default_factory=dict)
    sweep: tuple[SweepAxis, ...] = ()
    swept: Design | None = None
    listed: Design | None = None
    limits: dict[str, float] = field(default_factory=dict)
    fatigue: Fatigue = field(default_factory=Fatigue)
    fit: Fit | None = None
    assumed: tuple[Assumed, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def mechanism(self) -> Mechanism:
        """What is simulated: a Cardan joint, or a drive shaft."""
        return mechanism_of(self.joint, self.operation)

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns of the results that are kept."""
        return self.output.columns(self.mechanism)

    @property
    def name(self) -> str:
        """Name of the file without folder and ending."""
        return self.path.stem

    def fault(self, key: str, found: str, remedy: str) -> Fault:
        """Fault of a key of the file, with its line."""
        (lined,) = with_lines([Fault(f"{self.path}: {key}", found, remedy)], str(self.path), self.text)
        return lined

    def check_mounting(self, idle_forces: bool = False) -> None:
        """Refuse settings without effect, see `mounting.refusals`, and deviations that no joint can have.

        With `idle_forces` axial forces without effect are accepted.

        Raises
        ------
        InputError
            With every such setting.
        """
        refused = [*mounting.refusals(self._settings, self._varied), *self._impossible()]
        raise_all([*([] if idle_forces else self.idle_forces), *self._faults(refused)])

    @property
    def idle_forces(self) -> list[Fault]:
        """Axial forces, and their scatter, without effect, see `mounting.idle_forces`."""
        return self._faults(mounting.idle_forces(self._settings, self._varied))

    def _faults(self, refused: Iterable[tuple[KeyPath, str, str]]) -> list[Fault]:
        return [self.fault(dotted(path), *texts) for path, *texts in refused]

    def _impossible(self) -> Iterator[tuple[KeyPath, str, str]]:
        """Deviations that take the friction of a joint below zero, and forces above that which a spline can hold."""
        every = (joint for setting in self._settings for joint in setting.joints)
        mu = min((joint.friction.mu for joint in every if joint.friction.mu is not None), default=math.inf)
        for path, (least, _) in self._given(MU).items():
            if mu + least < 0.0:
                found = f"takes friction.mu = {mu:g} of the joint down to {mu + least:.3g}, below zero"
                yield path, found, f"give no deviation below {-mu:g}"
        for path, ends in self._given(SPLINE).items():
            if (largest := max(ends, key=abs)) and abs(largest) > 1.0:
                found = f"reaches {largest:.3g}: the spline slides at its largest force, which is 1"
                yield path, found, 'give values from -1 to 1, such as { plus_minus = 1, distribution = "uniform" }'

    def _given(self, name: str) -> dict[KeyPath, tuple[float, float]]:
        """Smallest and largest value of an error, by the key path of what gives it."""
        key = name.split(".")
        cases, grid = (self.listed.cases, self.listed.points) if self.listed else ({}, ())
        given: dict[KeyPath, list[float]] = {("errors", *key): [self.errors.get(name, 0.0)]}
        given |= {("case", n - 1, "errors", *key): [each.get(name, 0.0)] for n, each in enumerate(cases.values())}
        given["grid", *key] = [point.get(name, 0.0) for point in grid] or [0.0]
        models = [both for entry in self.entries for both in entry.models if both[0].name == name]
        of_entries = [list(model.ends(site)) for site, model in models if isinstance(model, SingleEntry)]
        given |= {("tolerances", *key): ends for ends in of_entries}
        return {path: (min(values), max(values)) for path, values in given.items()}

    @property
    def known(self) -> tuple[Toleranced, ...]:
        """Entries whose mean and deviation were estimated from measured parts, in the order of the file."""
        return tuple(entry for entry in self.entries if entry.parts)

    @property
    def no_closed_form(self) -> list[tuple[str, str]]:
        """Why closed forms do not hold for some of the joints, see `mounting.no_closed_form`; empty where they do."""
        return list(mounting.no_closed_form(self._settings, self._varied))

    @property
    def joint_in_words(self) -> str:
        """Mounting of the shafts and contact law, in words."""
        every = [setting.joints for setting in self._settings]
        laws = [joint.contact.law for joints in every for joint in joints]
        if isinstance(self.operation, OperationOfLinkage):
            return f"{self.operation.linkage.in_words}{mounting_and_law([], laws)}"
        return mounting_and_law([joints[-1].shaft.axial for joints in every], laws)

    @property
    def _settings(self) -> list[Setting]:
        """Each of `joints` at each of its operating points."""
        if self.listed:
            each = zip(self.joints, self.operations, self.solvers, strict=True)
            return [
                Setting(("operation",) if at == self.operation else ("variant",), joint, at, solver.fidelity)
                for joint, at, solver in each
            ]
        paths = [("operation", number) if point.name else ("operation",) for number, point in enumerate(self.points)]
        at = list(zip(paths, (point.operation for point in self.points), strict=True))
        return [Setting(path, joint, point, self.solver.fidelity) for joint in self.joints for path, point in at]

    @property
    def _varied(self) -> dict[str, list[str]]:
        """Errors that scatter or are swept, to the sections in which they do."""
        grid = {name for point in self.listed.points for name in point} if self.listed else set()
        names = {"tolerances": self.tolerances, "sweep": [n for axis in self.sweep for n in axis.names], "grid": grid}
        varied = [name for section in names.values() for name in section]
        return {name: [section for section in names if name in names[section]] for name in varied}

    @property
    def _different(self) -> Design | None:
        """Joints with dimensions of their own."""
        return self.listed or self.swept

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Nominal joint of each variant."""
        return self._different.joints if self._different else (self.joint,)

    @property
    def others(self) -> dict[str, Joint]:
        """Joints with keys of their own beside `joint`, by the key path of these: joint 2, and those of pairs."""
        operation = self.operation
        if isinstance(operation, OperationOfLinkage):
            own = {name: pair for name, pair in operation.linkage.pair.items() if pair.joint}
            return {f"mechanism.pair.{name}.joint": joint_of(pair, self.joint) for name, pair in own.items()}
        return {"shaft.joint2": operation.joint2} if operation.joint2 else {}

    @property
    def solvers(self) -> tuple[Solver, ...]:
        """Numerical settings of each of `joints`."""
        return self._different.solvers if self._different else (self.solver,)

    @property
    def operations(self) -> tuple[Operation, ...]:
        """Operating point of each of `joints`."""
        return self._different.operations if self._different else (self.operation,)

    def at(self, name: str) -> Study:
        """Return the study at one of its operating points alone, with the limits that hold there.

        Raises
        ------
        InputError
            When there is no such point, or several and no name.
        """
        names = [point.name for point in self.points]
        only_one(name, names, f"{self.path}: operation")
        own = self.points[names.index(name)]
        limits = limits_at(self.limits, [own.name], names)
        swept = self.swept and replace(self.swept, operations=(own.operation,) * len(self.swept.joints))
        points = (Point("", own.operation, 1.0),)
        return replace(self, operation=own.operation, points=points, limits=limits, swept=swept)

    @property
    def variants(self) -> tuple[Variant, ...]:
        """Variant of each of `joints`; empty where all rows have the study's joint."""
        return self._different.variants if self._different else ()

    @property
    def case_names(self) -> tuple[str, ...]:
        """Names of the cases, the one without errors first; empty where joints are not listed."""
        return tuple(self.listed.cases) if self.listed else ()

    @property
    def design(self) -> NDArray[np.void]:
        """Variant, case and group of each row, (rows,), dtype DESIGN; zeros where all rows have the study's joint."""
        return self._different.table if self._different else np.broadcast_to(np.zeros(1, DESIGN), self.rows)

    def has_bonus(self, name: str) -> bool:
        """Whether `name` is a position with a bonus, or the diameter of such a feature."""
        feature, _, key = name.rpartition(".")
        axis = self.axes.get(feature)
        return axis is not None and axis.bonus is not None and key.startswith(("position", "diameter"))

    @property
    def samples(self) -> int:
        """Number of joints, the nominal one not counted."""
        if self.listed:
            return len(self.listed.table)
        return self.sampling.n or math.prod(axis.points for axis in self.sweep)

    @property
    def first_sample(self) -> int:
        """Row of the first random joint: 1 if row 0 is the nominal joint, else 0."""
        return self.sampling.first_sample

    @property
    def rows(self) -> int:
        """Number of rows of every table of this study."""
        return self.first_sample + self.samples

    @property
    def asked(self) -> list[str]:
        """Loads of interest: those with limits, else those that ``output.results`` selects; else none."""
        if self.limits or self.output.results is None:
            return list(dict.fromkeys(split(name)[0] for name in self.limits))
        return [name for name, load in loads_of(self.mechanism).items() if holds(self.columns, load)]

    @property
    def wording(self) -> Wording:
        """Wording of what is said of the rows."""
        return Wording.of(self.mechanism, self.text, (self.name,))

    def __repr__(self) -> str:
        parts = [
            f"{self.samples} {row_of(self.mechanism)}s ({self.sampling.method})",
            f"{len(self.tolerances)} toleranced errors",
        ]
        parts.append(f"{len(self.limits)} limit{'s' * (len(self.limits) != 1)}")
        if len(self.points) > 1:
            parts.append(f"{len(self.points)} operating points")
        return f"<study {self.name!r}: {', '.join(parts)}>"

    def _repr_html_(self) -> str:
        solver, sampling = self.solver, self.sampling
        entries = {
            "file": str(self.path),
            **{f"operation {point.name}".rstrip(): point.in_words for point in self.points},
            "solver": f"{solver.fidelity}, {solver.method}, {solver.steps_per_rev} steps a revolution",
            "fixed errors, SI": ", ".join(f"{name} {value:.4g}" for name, value in self.errors.items()) or "none",
            "sampling": f"{sampling.method}, {self.samples} {row_of(self.mechanism)}s, seed {sampling.seed}",
            "toleranced": ", ".join(self.tolerances) or "none",
            "limits": limits_in_words(self.limits, self.mechanism),
        }
        rows = (f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in entries.items())
        return f"<table><caption>{escape(repr(self)[1:-1])}</caption>{''.join(rows)}</table>"

    def identity(self) -> dict[str, Any]:
        """All settings that determine results, as dotted key to JSON value.

        Limits, lives of bearings, comments and the file's name do not belong to it. Two studies of equal identity have
        the same rows with the same results.
        """
        points = {point.name: point.operation.model_dump() for point in self.points}
        for of_shaft in (point["shaft"] for point in points.values() if "shaft" in point):
            del of_shaft["joint2"]
        parts: dict[str, Any] = {
            "joint": affecting_results(self.joint.given("json")),
            "operation": points.get("", points),
            "solver": self.solver.model_dump(),
            "errors": self.errors,
            "tolerances": {name: d.describe() for name, d in self.tolerances.items()},
            "correlation": {"names": list(self.copula.names), "matrix": self.copula.matrix.tolist()},
            "sampling": self.sampling.model_dump(),
            "sweep": [[list(axis.names), axis.start, axis.stop, axis.points] for axis in self.sweep],
            "output": self.output.identity(self.mechanism),
        }
        optional = {
            "joint2": affecting_results(self.operation.joint2.given("json")) if self.operation.joint2 else {},
            "axes": {name: axis.describe() for name, axis in self.axes.items()},
            "lots": {name: list(lot) for name, lot in self.lots.items()},
            "swept": [variant.values for variant in self.swept.variants] if self.swept else [],
        }
        parts |= {name: part for name, part in optional.items() if part}
        identity: dict[str, Any] = leaves(parts | (self.listed.identity() if self.listed else {}))
        return dict(json.loads(json.dumps(identity)))


Given = str | Path | Mapping[str, Any] | Study
"""A study as it is given: path of its file, its sections, or what was read of them."""


def is_read(study: Given) -> TypeGuard[Study]:
    """Whether a study has been read already."""
    return hasattr(study, "identity")
