"""JSON schemas of study, joint and case files for editors, from the input models and the registries of names.

Inside this module a schema may have keywords of `common.notation`, which `_finished` replaces. What stands before or
behind the dot of a key is a name, or has a wildcard: whether a pattern selects something, an editor does not tell.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from tolstat.common import loads, strict
from tolstat.common.cardan import CARDAN, MECHANISMS, PARTS, SHAFT, SPLINED, named
from tolstat.common.channels import components, planes
from tolstat.common.error_fields import error_units, given_units
from tolstat.common.files import data_dir
from tolstat.common.loads import units_of_limits
from tolstat.common.mechanism import Mechanism
from tolstat.common.notation import schema_of_positive, schema_of_quantity
from tolstat.common.units import EXAMPLES
from tolstat.joint import DriveShaft, Joint, Linkage, Operation
from tolstat.joint.linked import linkage_mechanism
from tolstat.joint.model import Assumed
from tolstat.joint.reading import DEFAULT_JOINT
from tolstat.study.axes import is_zone
from tolstat.study.design import KEYS
from tolstat.study.fatigue import LineEntry, Settings, StressPointEntry
from tolstat.study.file import OF_CASE
from tolstat.study.listing import CaseEntry, Range, VariantEntry
from tolstat.study.model import Output, Sampling, Solver, SweepEntry
from tolstat.study.points import DrivenPoint, DrivenPointEntry, PointEntry
from tolstat.study.selection import halves, joints, toleranced_units
from tolstat.study.tolerances import fits
from tolstat.study.tolerances.correlation import Correlation
from tolstat.study.tolerances.kinds import KINDS as TOLERANCES
from tolstat.study.tolerances.kinds import ZONE_KINDS

Schema = dict[str, Any]
DRAFT = "http://json-schema.org/draft-07/schema#"
"""The newest draft that all editors read."""
WILD = r"[^.]*[*?\[][^.]*"
"""Half of a name with a wildcard."""
FEATURE = rf"(?:[^.]*\.)?{WILD}|{WILD}\.[^.]*"
"""What stands before the last dot of a name, with a wildcard; a joint may stand before it."""
JOINTS = joints(SHAFT)
"""What stands before the names of the features of one of several joints."""
WHOLE = tuple(MECHANISMS[named(base, PARTS)] for base in (CARDAN, SPLINED))
"""Mechanisms with all parts, which have the names of all others but linkages."""
NAME = "<name>"
"""Pair or member of a linkage, which the user names, in the names of its errors and loads: ``<name>_pin.offset_t``."""
LINKAGES = tuple(Path(__file__).parent / "templates" / f"{kind}.toml" for kind in ("fourbar", "hinge"))
"""Studies of linkages that have the names of all others: a driven member is held, or has a pair in the ground."""
REQUIRED = ("joint", "operation", "sampling")
"""Tables that every study has; a case has those of `OF_CASE`."""


def _changed(part: Any, change: Callable[[Schema], Schema]) -> Any:
    """Schema with each table in it changed, the innermost ones first."""
    if isinstance(part, list):
        return [_changed(item, change) for item in part]
    if not isinstance(part, dict):
        return part
    return change({key: _changed(value, change) for key, value in part.items()})


@cache
def of_model(model: type[BaseModel]) -> Schema:
    """JSON schema of a model, with the models inside it in place of references; only the first part of docstrings."""
    generated = model.model_json_schema(by_alias=True)
    definitions = generated.pop("$defs", {})

    def inlined(part: Schema) -> Schema:
        if "$ref" in part:
            part = _changed(definitions[part.pop("$ref").rpartition("/")[2]], inlined) | part
        if isinstance(part.get("description"), str):
            part["description"] = " ".join(part["description"].partition("\n\n")[0].split())
        return part

    schema: Schema = _changed(generated, inlined)
    return schema


@cache
def joint() -> Schema:
    """JSON schema of a joint file, with the values of the default joint as examples."""
    values = strict.read_toml(data_dir() / "joints" / f"{DEFAULT_JOINT}.toml")
    del values["assumed"], values["shaft"]["axial"]  # their fields have shorter and more telling examples
    return {"title": "Joint of tolstat"} | _with_examples(of_model(Joint), values) | {"description": "Nominal joint."}


def _with_examples(part: Schema, values: Mapping[str, Any]) -> Schema:
    """Take the values of a file as examples of its keys."""
    properties = {}
    for key, schema in part["properties"].items():
        value = values.get(key)
        if isinstance(value, Mapping):
            properties[key] = _with_examples(schema, value)
        else:
            properties[key] = schema if value is None else schema | {"examples": [value]}
    return part | {"properties": properties}


def _overriding(part: Schema, quantity: Schema | None = None) -> Schema:
    """Schema of a table that replaces some keys of another; of its quantities alone, each by `quantity`, if given."""
    properties = {}
    for key, schema in part["properties"].items():
        if schema.get("type") == "object":
            properties[key] = _overriding(schema, quantity)
        elif quantity is None or "x-unit" in schema:
            properties[key] = quantity or schema
    return {key: value for key, value in part.items() if key not in ("title", "required")} | {"properties": properties}


def _table(description: str, entries: Mapping[str, Schema], end: str = "") -> Schema:
    """Schema of a table by names, quoted (``"pin1.offset_t"``) or dotted, and patterns; `end` may follow a pattern."""
    features: dict[str, dict[str, Schema]] = {}
    names_of: dict[str, list[str]] = {}
    for name, schema in entries.items():
        feature, half = halves(name) if name.partition(".")[0] in JOINTS else name.partition(".")[::2]
        features.setdefault(feature, {})[half] = schema
        names_of.setdefault(json.dumps(schema), []).append(name)
    wild = {"anyOf": _different(schema for name, schema in entries.items() if not is_zone(name))}
    nested: dict[str, Schema] = {}
    patterns: dict[str, Schema] = {}
    others: Schema | bool = False
    for feature, keys in features.items():
        inner = keys.get("") or _closed(keys, {f"^{WILD}$": wild} if wild["anyOf"] else None)
        joint, _, own = feature.rpartition(".")
        if NAME in feature:
            patterns |= {f"^{_escaped(feature)}$": inner} if feature != NAME else {}
            others = inner if feature == NAME else others
            continue
        around = nested.setdefault(joint, _closed({}, {r"[.*?\[]": wild}))["properties"] if joint else nested
        around[own] = inner
    patterns |= {f"^(?:{_keys(names)}){end}$": json.loads(schema) for schema, names in names_of.items()}
    patterns |= {rf"^(?:{'|'.join(map(_escaped, features))}|{FEATURE})\.{WILD}{end}$": wild}
    return _closed(nested, patterns, others) | {"description": description}


def _closed(
    properties: Mapping[str, Schema], patterns: Mapping[str, Schema] | None = None, others: Schema | bool = False
) -> Schema:
    """Schema of a table without other keys, or whose other keys have a schema."""
    by_pattern = {"patternProperties": dict(patterns)} if patterns else {}
    return {"type": "object", "properties": dict(properties), **by_pattern, "additionalProperties": others}


def _escaped(feature: str) -> str:
    """Regular expression of a feature."""
    return re.escape(feature).replace(NAME, "[^.]+")


def _different(schemas: Iterable[Schema]) -> list[Schema]:
    return [json.loads(text) for text in dict.fromkeys(map(json.dumps, schemas))]


def _keys(names: Iterable[str]) -> str:
    """Regular expression of names, and of patterns with a wildcard before the dot alone."""
    halves_of: dict[str, list[str]] = {}
    for name in names:
        feature, _ = halves(name)
        halves_of.setdefault(feature, []).append(re.escape(name[len(feature) :]))
    features_of: dict[str, list[str]] = {}
    for feature, keys in halves_of.items():
        features_of.setdefault("|".join(keys), []).append(_escaped(feature))
    wild = {ends: FEATURE if ends else WILD for ends in features_of}
    return "|".join(f"(?:{'|'.join(features)}|{wild[ends]})(?:{ends})" for ends, features in features_of.items())


def _every(units_of: Callable[[Mechanism], Mapping[str, Any]]) -> dict[str, Any]:
    """Names in all mechanisms, with their units; in those of linkages `NAME` is what the user names."""
    found = {name: unit for mechanism in WHOLE for name, unit in units_of(mechanism).items()}
    for path in LINKAGES:
        linkage = Linkage.model_validate(strict.read_toml(path)["mechanism"])
        own = re.compile(rf"^(?:{'|'.join([*linkage.pair, linkage.drive.member])})(?=[_.])")
        names = units_of(linkage_mechanism(linkage, PARTS))
        found |= {own.sub(NAME, name): unit for name, unit in names.items() if own.match(name)}
    return found


def _entries(name: str, units: Mapping[str, str]) -> dict[str, Schema]:
    """Reference, by name of a quantity, to the definition of an entry that has quantities of its unit."""
    return {quantity: {"x-table": f"{name}_1" if unit == "1" else name} for quantity, unit in units.items()}


def _pure(part: Schema) -> Schema:
    """Entry of an error that is a pure number, see `_changed`."""
    if part.get("x-unit") != "error":
        return part
    return {key: value for key, value in part.items() if key not in ("examples", "not")} | schema_of_quantity("1", "")


def sections() -> dict[str, Schema]:
    """JSON schema of each table of a study, in the order of the reference."""
    text = "Joint file, and keys that replace some of its own, such as contact.clearance."
    swept = "Errors by name or pattern, and keys of the joint, that take equally spaced values; several make a grid."
    errors, drawn = _every(error_units), _every(toleranced_units)
    grid = {
        name: {"type": "array", "minItems": 1, "items": schema} for name, schema in _entries("quantity", errors).items()
    }
    limited = "Values that loads must not exceed, by name or pattern of loads; they affect no result."
    toleranced = _entries("tolerance", drawn)
    toleranced |= {name: {"x-table": key} for name in drawn if (key := halves(name)[1]) in ZONE_KINDS}
    scatter = _table("How errors scatter, by name or pattern.", toleranced)
    return {
        "joint": _definitions()["overrides"] | {"description": text, "required": ["base"]},
        "operation": _points(Operation, PointEntry, DrivenPoint, DrivenPointEntry),
        "shaft": of_model(DriveShaft),
        "mechanism": of_model(Linkage),
        "solver": of_model(Solver),
        "errors": _table(
            "Errors that every joint has, by name or pattern: deviations from nominal.",
            _entries("quantity", _every(given_units)),
        ),
        "tolerances": scatter | {"properties": {fits.KEY: {"x-table": fits.KEY}} | scatter["properties"]},
        "correlation": _listed(Correlation),
        "sampling": of_model(Sampling),
        "sweep": _table(swept, _entries("sweep", errors | KEYS)),
        "grid": _table("Values at which all cases are run, by name or pattern; several entries make a grid.", grid),
        "case": _listed(CaseEntry),
        "variant": _listed(VariantEntry),
        "assumed": _listed(Assumed),
        "limits": _table(limited, _entries("limit", _every(units_of_limits)), end=f"(?:{loads.AT}[A-Za-z].*)?"),
        "fatigue": of_model(Settings),
        "output": of_model(Output),
    }


def _points(*models: type[BaseModel]) -> Schema:
    """Schema of one operating point or several, of one of the models; the second and fourth are entries of a list."""
    ways = [_listed(model) | {"minItems": 1} if number % 2 else of_model(model) for number, model in enumerate(models)]
    return {"anyOf": ways, "description": ways[0]["description"]}


def _listed(model: type[BaseModel]) -> Schema:
    item = of_model(model)
    return {"type": "array", "items": item, "description": item["description"]}


def _definitions() -> dict[str, Schema]:
    """JSON schemas of the tables that stand in place of a property with ``x-table``."""
    keys = _overriding(joint())
    del keys["properties"]["assumed"]
    base: Schema = {
        "type": "string",
        "description": "name of a joint that comes with tolstat, or path of a joint file from the folder of this file",
        "examples": [DEFAULT_JOINT],
    }
    entries: dict[str, Schema] = {
        "tolerance": {"anyOf": [of_model(model) for model in TOLERANCES.values()]},
        "quantity": schema_of_quantity("error", EXAMPLES["m"]),
        "sweep": of_model(SweepEntry),
        "limit": schema_of_positive(schema_of_quantity("error", EXAMPLES["N"])),
    }
    return {
        **entries,
        **{f"{name}_1": _changed(schema, _pure) for name, schema in entries.items()},
        **{key: {"anyOf": _different(map(of_model, kinds.values()))} for key, kinds in ZONE_KINDS.items()},
        "errors": _table("", _entries("quantity", _every(given_units))),
        "keys": keys,
        "overrides": keys | {"properties": {"base": base} | keys["properties"]},
        "vary": _overriding(joint(), {"x-table": "range"}),
        "range": of_model(Range),
        "operation": _overriding(of_model(Operation)),
        "solver": of_model(Solver),
        fits.KEY: of_model(fits.FitEntry),
        "points": {"type": "object", "additionalProperties": of_model(StressPointEntry)},
        "line": of_model(LineEntry),
        "lines": _lines(),
    }


def _lines() -> Schema:
    """Schema of S–N lines by component, or by direction of a force or moment."""
    signed = _table("", _entries("line", dict.fromkeys(_every(components), "N")))
    directions = _table("", _entries("line", dict.fromkeys(_every(planes), "N")), " at .+")
    return signed | {"patternProperties": signed["patternProperties"] | directions["patternProperties"]}


def study() -> Schema:
    """JSON schema of a study."""
    return _file("Study of tolstat", sections(), REQUIRED)


def case() -> Schema:
    """JSON schema of a case file."""
    of_case = {name: made for name, made in sections().items() if name in OF_CASE}
    of_case["operation"] = {"anyOf": [of_model(Operation), of_model(DrivenPoint)]}
    return _file("Case of tolstat: one joint", of_case, REQUIRED[:2])


def _file(title: str, sections: Mapping[str, Schema], required: Iterable[str]) -> Schema:
    linked: Schema = {"required": ["mechanism"]}
    of_linkages = linked | {"properties": {"operation": _points(DrivenPoint, DrivenPointEntry)}}
    of_joints = {"not": linked, "properties": {"operation": _points(Operation, PointEntry)}}
    ways = {"anyOf": [of_joints, of_linkages]}
    return {"title": title} | _closed(sections) | {"required": list(required)} | ways


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
    document: Schema = _changed(KINDS[kind](), _finished)
    definitions = {name: _changed(part, _finished) for name, part in _definitions().items()}
    used: dict[str, Schema] = {}
    referring: list[Schema] = [document]
    while referring:
        names = dict.fromkeys(re.findall(r'"#/definitions/([^"]+)"', json.dumps(referring)))
        referring = [used.setdefault(name, definitions[name]) for name in names if name not in used]
    return {"$schema": DRAFT} | document | ({"definitions": used} if used else {})


def _finished(part: Schema) -> Schema:
    """Schema for editors, of draft 7: without keywords of this package; see `_changed`."""
    if isinstance(part.get("x-table"), str):
        annotations = {key: part[key] for key in ("description", "default", "examples") if key in part}
        return {"allOf": [{"$ref": f"#/definitions/{part['x-table']}"}]} | annotations
    part.pop("x-unit", None)
    if isinstance(part.get("prefixItems"), list):
        part["items"] = part.pop("prefixItems")[0]
    return part
