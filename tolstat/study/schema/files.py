"""JSON schemas of whole files, made from the registries of errors, loads, distributions and from the input models."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from functools import cache
from typing import NamedTuple

from tolstat.analysis.process import LEAST_PARTS, MOST_PARTS
from tolstat.common import json_schema, loads, strict
from tolstat.common.channels import UNIT_OF_CHANNEL
from tolstat.common.files import data_dir
from tolstat.common.loads import UNIT_OF_LOAD
from tolstat.common.units import EXAMPLES
from tolstat.joint import Joint, Operation
from tolstat.joint.model import Assumed
from tolstat.joint.reading import DEFAULT_JOINT
from tolstat.study.axes import is_zone, vectors_of
from tolstat.study.fatigue import LineEntry, Settings
from tolstat.study.listing import CaseEntry, Range, VariantEntry
from tolstat.study.model import Output, Sampling, Solver, SweepEntry
from tolstat.study.points import PointEntry
from tolstat.study.proposal import MAX_SHIFT, MAX_WIDEN, ProposalEntry
from tolstat.study.schema.names import table
from tolstat.study.schema.parts import DRAFT, Schema, finished, for_unit, of_model, overriding, ranges, with_examples
from tolstat.study.selection import TOLERANCED, UNITS
from tolstat.study.sorting import MEASURABLE, RejectEntry
from tolstat.study.stress_point import StressPointEntry
from tolstat.study.swept import KEYS
from tolstat.study.tolerances import fits
from tolstat.study.tolerances.correlation import Correlation
from tolstat.study.tolerances.kinds import ZONE_KINDS, kinds_of

ERRORS = {name: unit for name, unit in UNITS.items() if not name.startswith("operation.")}
"""Unit of each error that can be given a value."""


class Section(NamedTuple):
    """A table of a study.

    Attributes
    ----------
    schema : callable
        Returns its JSON schema.
    repeated : bool
        Whether the file has it any number of times, ``[[case]]``.
    required : bool
        Whether every study needs it.
    in_case : bool
        Whether a case file has it, too.
    listed : callable, optional
        Returns the JSON schema of each table where a study may have several, ``[[operation]]``, in place of one.
    """

    schema: Callable[[], Schema]
    repeated: bool = False
    required: bool = False
    in_case: bool = False
    listed: Callable[[], Schema] | None = None


@cache
def joint() -> Schema:
    """JSON schema of a joint file, with the values of the default joint as examples."""
    values = strict.read_toml(data_dir() / "joints" / f"{DEFAULT_JOINT}.toml")
    del values["assumed"], values["shaft"]["axial"]  # their fields have shorter and more telling examples
    made = with_examples(of_model(Joint), values)
    return {"title": "Joint of tolstat"} | made | {"description": "Nominal joint."}


def keys() -> Schema:
    """JSON schema of a table with some keys of a joint."""
    made = {key: value for key, value in overriding(joint()).items() if key != "title"}
    return made | {"properties": {key: value for key, value in made["properties"].items() if key != "assumed"}}


def overrides() -> Schema:
    """JSON schema of a table that names a joint file and replaces some of its keys."""
    base: Schema = {
        "type": "string",
        "description": "name of a joint that comes with tolstat, or path of a joint file from the folder of this file",
        "examples": [DEFAULT_JOINT],
    }
    own = keys()
    text = "Joint file, and keys that replace some of its own, such as contact.clearance."
    return own | {"description": text, "properties": {"base": base} | own["properties"]}


def errors() -> Schema:
    """JSON schema of errors with given values."""
    text = "Errors that every joint has, by name or pattern: deviations from nominal."
    return table({name: _quantity(unit) for name, unit in ERRORS.items()}) | {"description": text}


def tolerances() -> Schema:
    """JSON schema of the errors that scatter: the entry of each error is one of its kinds."""
    made = table({name: {"x-table": _tolerance(name, unit)} for name, unit in TOLERANCED.items()})
    properties = {fits.KEY: {"x-table": fits.KEY}} | made["properties"]
    return made | {"description": "How errors scatter, by name or pattern.", "properties": properties}


def _of_unit(name: str, unit: str) -> str:
    """Name of the definition of an entry for errors of a unit."""
    return f"{name}_{unit.replace('*', '_').replace('/', '_per_')}"


def _quantity(unit: str) -> Schema:
    return {"x-table": _of_unit("quantity", unit)}


def _tolerance(name: str, unit: str) -> str:
    """Name of the definition of the tolerance of an error."""
    key = name.partition(".")[2]
    return key if key in ZONE_KINDS else _of_unit("tolerance", unit)


def sweep() -> Schema:
    """JSON schema of the axes of a grid of errors and keys of the joint."""
    text = "Errors by name or pattern, and keys of the joint, that take equally spaced values; several make a grid."
    made: dict[str, Schema] = {
        name: {"x-table": _of_unit(SweepEntry.__name__, unit)} for name, unit in (UNITS | KEYS).items()
    }
    return table(made) | {"description": text}


def grid() -> Schema:
    """JSON schema of the lists of values that all cases and variants are run at."""
    made = {name: {"type": "array", "minItems": 1, "items": _quantity(unit)} for name, unit in UNITS.items()}
    text = "Values at which all cases are run, by name or pattern; several entries make a grid."
    return table(made) | {"description": text}


def reject() -> Schema:
    """JSON schema of the inspections at assembly."""
    made: dict[str, Schema] = {
        name: {"x-table": _of_unit(RejectEntry.__name__, unit)} for name, unit in MEASURABLE.items()
    }
    text = "Joints that are rejected at assembly by a measured error or clearance; affects no result."
    return table(made) | {"description": text}


def limits() -> Schema:
    """JSON schema of the limits of loads."""
    text = "Values that loads must not exceed, by name or pattern of loads; they affect no result."
    made: dict[str, Schema] = {name: {"x-table": _of_unit("limit", unit)} for name, unit in UNIT_OF_LOAD.items()}
    found = table(made)
    end = f"(?:{loads.AT}[A-Za-z].*)?$"
    at_points = {f"{pattern.removesuffix('$')}{end}": own for pattern, own in found["patternProperties"].items()}
    return found | {"patternProperties": at_points, "description": text}


def _positive(unit: str) -> Schema:
    quantity = json_schema.quantity(unit, EXAMPLES[unit]) | {"exclusiveMinimum": 0}
    return quantity | json_schema.sign(quantity)


def numbers(low: float, high: float, kind: str = "number") -> Schema:
    """JSON schema of numbers by name or pattern of the quantities that are drawn: errors, and vectors of zones."""
    drawn = [own for name in TOLERANCED for own in (vectors_of(name) if is_zone(name) else (name,))]
    return table({name: {"type": kind, "minimum": low, "maximum": high} for name in drawn})


SECTIONS: dict[str, Section] = {
    "joint": Section(lambda: overrides() | {"required": ["base"]}, required=True, in_case=True),
    "operation": Section(lambda: of_model(Operation), required=True, in_case=True, listed=lambda: of_model(PointEntry)),
    "solver": Section(lambda: of_model(Solver), in_case=True),
    "errors": Section(errors, in_case=True),
    "tolerances": Section(tolerances),
    "correlation": Section(lambda: of_model(Correlation), repeated=True),
    "sampling": Section(lambda: of_model(Sampling), required=True),
    "proposal": Section(lambda: of_model(ProposalEntry), repeated=True),
    "sweep": Section(sweep),
    "grid": Section(grid),
    "case": Section(lambda: of_model(CaseEntry), repeated=True),
    "variant": Section(lambda: of_model(VariantEntry), repeated=True),
    "assumed": Section(lambda: of_model(Assumed), repeated=True),
    "reject": Section(reject),
    "limits": Section(limits),
    "fatigue": Section(lambda: of_model(Settings)),
    "output": Section(lambda: of_model(Output)),
}
"""Tables of a study, in the order of the reference."""


def tables() -> dict[str, Schema]:
    """JSON schemas of the tables that stand in place of a property with ``x-table``."""
    widen = numbers(1 / MAX_WIDEN, MAX_WIDEN)
    found: dict[str, Schema] = {
        "errors": errors(),
        "overrides": overrides(),
        "keys": keys(),
        "vary": ranges(joint(), {"x-table": "range"}),
        "range": of_model(Range),
        "operation": overriding(of_model(Operation)),
        "solver": of_model(Solver),
        "widen": {"anyOf": [{"type": "number", "minimum": 1 / MAX_WIDEN, "maximum": MAX_WIDEN}, widen]},
        "shift": numbers(-MAX_SHIFT, MAX_SHIFT),
        "parts": numbers(LEAST_PARTS, MOST_PARTS, "integer"),
        "quantity": {"type": ["string", "number"]},
        fits.KEY: of_model(fits.FitEntry),
        "points": {"type": "object", "additionalProperties": of_model(StressPointEntry)},
        "lines": table(
            {name: {"x-table": _of_unit(LineEntry.__name__, unit)} for name, unit in UNIT_OF_CHANNEL.items()}
        ),
    }
    for name, unit in TOLERANCED.items():
        kinds = [for_unit(of_model(model), unit) for model in dict.fromkeys(kinds_of(name).values())]
        found.setdefault(_tolerance(name, unit), {"anyOf": kinds})
    for unit in dict.fromkeys((UNITS | KEYS).values()):
        found[_of_unit(SweepEntry.__name__, unit)] = for_unit(of_model(SweepEntry), unit)
    for unit in dict.fromkeys(UNITS.values()):
        found[_of_unit(RejectEntry.__name__, unit)] = for_unit(of_model(RejectEntry), unit)
        found[_of_unit("quantity", unit)] = json_schema.quantity(unit, EXAMPLES[unit])
    for unit in dict.fromkeys(UNIT_OF_LOAD.values()):
        found[_of_unit("limit", unit)] = _positive(unit)
    line = of_model(LineEntry)
    for unit in dict.fromkeys(UNIT_OF_CHANNEL.values()):
        size = {key: value for key, value in line["properties"]["S0"].items() if key != "x-table"} | _positive(unit)
        found[_of_unit(LineEntry.__name__, unit)] = line | {"properties": line["properties"] | {"S0": size}}
    return found


def study() -> Schema:
    """JSON schema of a study."""
    return _file("Study of tolstat", SECTIONS)


def case() -> Schema:
    """JSON schema of a case file."""
    own = {name: section._replace(listed=None) for name, section in SECTIONS.items() if section.in_case}
    return _file("Case of tolstat: one joint", own)


def _file(title: str, sections: dict[str, Section]) -> Schema:
    properties = {}
    for name, section in sections.items():
        made = section.schema()
        said = {"description": made.get("description", "")}
        properties[name] = {"type": "array", "items": made} | said if section.repeated else made
        if section.listed is not None:
            properties[name] = {"anyOf": [made, {"type": "array", "items": section.listed(), "minItems": 1}]} | said
    return {
        "title": title,
        "type": "object",
        "properties": properties,
        "required": [name for name, section in sections.items() if section.required],
        "additionalProperties": False,
    }


KINDS: dict[str, Callable[[], Schema]] = {"study": study, "joint": joint, "case": case}
"""Files that have a JSON schema."""


def schema(kind: str) -> Schema:
    """JSON schema of a file, draft 7, for editors.

    Parameters
    ----------
    kind : str
        ``"study"``, ``"joint"`` or ``"case"``.

    Returns
    -------
    dict
    """
    made: Schema = finished(KINDS[kind]())
    definitions = {name: finished(part) for name, part in tables().items()}
    used: dict[str, Schema] = {}
    referring: list[Schema] = [made]
    while referring:
        names = dict.fromkeys(re.findall(r'"#/definitions/([^"]+)"', json.dumps(referring)))
        referring = [used.setdefault(name, definitions[name]) for name in names if name not in used]
    return {"$schema": DRAFT} | made | ({"definitions": used} if used else {})
