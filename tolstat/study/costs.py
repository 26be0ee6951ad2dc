"""Cost of a tolerance of a feature as a reciprocal power, with coefficients from TOML or a text table.

A tolerance t costs c(t) = fixed + (cost - fixed) (at / t)^power. The power 1 is the reciprocal model of Chase and
Greenwood (1988, Design issues in mechanical tolerance analysis), 2 that of Spotts (1973), any other Sutherland and
Roth's (1975).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, NamedTuple

from pydantic import AfterValidator, BeforeValidator, Field, ValidationInfo, model_validator

from tolstat.common import strict, units
from tolstat.common.errors import Fault, gather, raise_all
from tolstat.common.files import read_input
from tolstat.common.mechanism import Mechanism
from tolstat.common.strict import Strict, refuse
from tolstat.common.text_table import TextTable, shortened
from tolstat.study import selection
from tolstat.study.scaling import Tolerance
from tolstat.study.tolerances.entry import OF_ERROR

REACH = (0.1, 4.0)
"""Smallest and largest factor on a tolerance that are considered."""


def _width(value: object, info: ValidationInfo) -> float:
    """Read a width of the tolerance that the entry is for, with the sign that it has on a drawing, or without."""
    tolerance: Tolerance = (info.context or {})["tolerance"]
    return units.to_si(value, tolerance.site.unit, tolerance.mark)


Width = Annotated[float, BeforeValidator(_width), AfterValidator(units.positive), OF_ERROR]
"""Width of a tolerance: half the band, but the whole zone."""


class CostEntry(Strict):
    """Cost of a tolerance of one feature: a pin, a hole, or a pair of holes."""

    cost: Annotated[units.Number, Field(ge=0)] = Field(default=1.0, examples=[4.0])
    """cost of the tolerance `at`, in any currency"""
    fixed: Annotated[units.Number, Field(ge=0)] = Field(default=0.0, examples=[1.0])
    """part of it that does not depend on the tolerance"""
    at: Width | None = Field(default=None, examples=["0.5 deg"])
    """tolerance (half the band, but the whole zone) that costs `cost`; that of the study by default"""
    power: Annotated[units.Number, Field(gt=0, le=10)] = Field(default=1.0, examples=[2.0])
    """exponent of the reciprocal"""
    least: Width | None = Field(default=None, examples=["0.1 deg"])
    """smallest tolerance that the process can hold"""
    most: Width | None = Field(default=None, examples=["0.030 mm"])
    """largest tolerance that the function allows"""
    keep: bool = Field(default=False, strict=True, examples=[True])
    """whether the tolerance stays as it is"""

    @model_validator(mode="after")
    def _in_order(self) -> CostEntry:
        if self.fixed > self.cost:
            raise refuse("fixed is larger than cost", "give fixed <= cost")
        if self.least is not None and self.most is not None and not self.least < self.most:
            raise refuse("least is not below most", "give least < most")
        return self


class Cost(NamedTuple):
    """Cost of one tolerance of the drawing as a function of its factor: the sum over the features it applies to.

    Attributes
    ----------
    width : float
        Tolerance at factor 1, SI.
    entries : dict of str to CostEntry
        Entry of each feature: a position zone of four pins is four, not eight for their offsets.
    """

    width: float
    entries: Mapping[str, CostEntry]

    def at(self, factor: float) -> float:
        """Cost of the tolerance made `factor` times as wide."""
        return sum(self.of(feature, factor) for feature in self.entries)

    def of(self, feature: str, factor: float) -> float:
        """Cost of the tolerance of one feature, made `factor` times as wide."""
        e, t = self.entries[feature], self.width * factor
        return float(e.fixed + (e.cost - e.fixed) * ((e.at or self.width) / t) ** e.power)

    @property
    def reach(self) -> tuple[float, float]:
        """Smallest and largest factor that all features allow, within `REACH`; (1, 1) if the tolerance is kept."""
        entries = self.entries.values()
        if any(e.keep for e in entries):
            return 1.0, 1.0
        least = max([REACH[0], *(e.least / self.width for e in entries if e.least is not None)])
        most = min([REACH[1], *(e.most / self.width for e in entries if e.most is not None)])
        return min(least, 1.0), max(most, 1.0)

    @property
    def is_finite(self) -> bool:
        """Whether the cost is finite over the reach; it is largest and smallest at its ends."""
        try:
            return all(math.isfinite(self.at(factor)) for factor in self.reach)
        except OverflowError:
            return False


def of(tolerances: Sequence[Tolerance], mechanism: Mechanism, path: Path | None = None) -> list[Cost]:
    """Cost of each tolerance.

    Parameters
    ----------
    tolerances : sequence of Tolerance
        Tolerances of the study.
    mechanism : Mechanism
        Whose errors they are of.
    path : Path, optional
        TOML file whose keys are names or patterns of errors and whose entries are `CostEntry`, or text table with a
        column ``tolerance`` of such names and the entries' keys as further columns. A feature is named by one of the
        errors of its tolerance or by all; tolerances of features that the file does not name are kept. Without a file
        each tolerance costs 1 per feature, and 1 / f if made f times as wide.

    Returns
    -------
    list of Cost
        In the order of `tolerances`.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    if path is None:
        return [Cost(t.width, dict.fromkeys(features(t), CostEntry())) for t in tolerances]
    faults: list[Fault] = []
    table: Mapping[str, object]
    lines: str | Mapping[str, int]
    if path.suffix.lower() == ".toml":
        table, lines = strict.read_toml(path), read_input(path)
    else:
        source = TextTable(path)
        table, lines = _rows(source)
        faults += source.faults()
    tolerance_of = {name: tolerance for tolerance in tolerances for name in tolerance.names}
    costs: dict[str, CostEntry] = {}
    claims = selection.Assignments(str(path), mechanism)
    known = {name: tolerance.site.unit for name, tolerance in tolerance_of.items()}
    for entry in selection.entries(table, mechanism):
        with gather(faults):
            names = selection.resolve(entry, known, str(path))
            claims.claim(entry, names)
            context = {"tolerance": tolerance_of[names[0]]}
            cost = strict.validate(CostEntry, entry.value, str(path), prefix=entry.path, context=context)
            costs |= dict.fromkeys(names, cost)
    raise_all(shortened(strict.with_lines(faults, str(path), lines), path))
    read = [Cost(t.width, _of_features(t, costs, str(path), faults)) for t in tolerances]
    raise_all(faults)
    raise_all(
        Fault(f"{path}: {tolerance.pattern}", "costs more than a number can hold", "give a smaller cost, at or power")
        for tolerance, cost in zip(tolerances, read, strict=True)
        if not cost.is_finite
    )
    return read


def features(tolerance: Tolerance) -> list[str]:
    """Features that a tolerance applies to: pins, holes, pairs of holes."""
    return list(dict.fromkeys(name.rpartition(".")[0] for name in tolerance.names))


def _of_features(
    tolerance: Tolerance, costs: Mapping[str, CostEntry], place: str, faults: list[Fault]
) -> dict[str, CostEntry]:
    """Entry of each feature of a tolerance; several errors of it may have one entry only."""
    found: dict[str, CostEntry] = {}
    for name in tolerance.names:
        feature = name.rpartition(".")[0]
        entry = costs.get(name)
        if entry is not None and found.setdefault(feature, entry) != entry:
            remedy = "give one for all errors of the tolerance: it is one width on the drawing"
            faults.append(Fault(f"{place}: {tolerance.pattern}", f"has two costs for {feature}", remedy))
    return {feature: found.get(feature, CostEntry(cost=0.0, keep=True)) for feature in features(tolerance)}


def _rows(table: TextTable) -> tuple[dict[str, dict[str, object]], dict[str, int]]:
    """Entry of each row of a text table as TOML would give it, and its line."""
    table.numbers({}, ["tolerance"], 1)
    rows, lines = dict[str, dict[str, object]](), dict[str, int]()
    for line, cells in table.rows:
        row = {name: cells[column] for name, column in table.columns.items() if cells[column]}
        name = row.pop("tolerance", "")
        if name in lines:
            remedy = f"keep one of them: the other is in line {lines[name]}"
            table.fault(line, "", f"has a second row of {name!r}", remedy)
        else:
            rows[name] = {key: _value(table, line, cell, table.units[key]) for key, cell in row.items()}
            lines[name] = line
    return rows, lines


def _value(table: TextTable, line: int, cell: str, unit: str) -> object:
    """Convert a cell to the value that TOML would give."""
    if cell.lower() in ("true", "false"):
        return cell.lower() == "true"
    digits, _, own = cell.partition(" ")
    value = table.number(line, digits)
    if math.isnan(value):
        return cell
    return f"{value!r} {own or unit}" if own or unit else value
