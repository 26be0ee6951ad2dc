"""JSON schemas of the parts of a file: of one model, of the entries for one unit, of a table that changes another one.

Schemas of this module have keywords of their own (`common.json_schema`), which `finished` removes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from pydantic import BaseModel

from tolstat.common import json_schema
from tolstat.common.units import EXAMPLES

Schema = dict[str, Any]
DRAFT = "http://json-schema.org/draft-07/schema#"
"""The newest draft that all editors read."""


@cache
def of_model(model: type[BaseModel]) -> Schema:
    """JSON schema of a model, with the models inside it in place of references; only the first part of docstrings."""
    made = model.model_json_schema(by_alias=True)
    definitions = made.pop("$defs", {})
    schema: Schema = _inlined(made, definitions)
    return schema


def _inlined(part: Any, definitions: Mapping[str, Schema]) -> Any:
    if isinstance(part, list):
        return [_inlined(item, definitions) for item in part]
    if not isinstance(part, dict):
        return part
    part = {key: _inlined(value, definitions) for key, value in part.items()}
    if "$ref" in part:
        inner = _inlined(definitions[part.pop("$ref").rpartition("/")[2]], definitions)
        part = inner | part
    if isinstance(part.get("description"), str):
        part["description"] = " ".join(part["description"].partition("\n\n")[0].split())
    return part


def for_unit(part: Any, unit: str) -> Any:
    """Replace quantities in the unit of an entry's error by quantities of a unit."""
    if isinstance(part, list):
        return [for_unit(item, unit) for item in part]
    if not isinstance(part, dict):
        return part
    part = {key: for_unit(value, unit) for key, value in part.items()}
    if part.get("x-unit") != "error":
        return part
    examples = part.get("examples") if unit == "m" else None
    part = part | json_schema.quantity(unit, EXAMPLES[unit])
    if unit == "1":
        part.pop("examples", None)
    else:
        part.pop("default", None)
    return part | ({"examples": examples} if examples else {}) | json_schema.sign(part)


def overriding(part: Schema) -> Schema:
    """Schema of a table that replaces some keys of another: no key of it is required."""
    properties = {
        key: overriding(value) if value.get("type") == "object" else value for key, value in part["properties"].items()
    }
    return {key: value for key, value in part.items() if key != "required"} | {"properties": properties}


def with_examples(part: Schema, values: Mapping[str, Any]) -> Schema:
    """Take the values of a file as examples of its keys."""
    properties = {}
    for key, own in part["properties"].items():
        value = values.get(key)
        if isinstance(value, Mapping):
            own = with_examples(own, value)
        elif value is not None:
            own = own | {"examples": [value]}
        properties[key] = own
    return part | {"properties": properties}


def ranges(part: Schema, entry: Schema) -> Schema:
    """Schema of a table that gives `entry` for quantities of another table, by nested or by quoted dotted keys."""
    nested = _ranges(part, entry)
    dotted = "|".join(re.escape(key) for key in _leaves(part))
    return nested | {"patternProperties": {f"^(?:{dotted})$": entry}}


def _ranges(part: Schema, entry: Schema) -> Schema:
    properties = {}
    for key, value in part["properties"].items():
        if value.get("type") == "object":
            properties[key] = _ranges(value, entry)
        elif "x-unit" in value:
            properties[key] = entry
    return {"type": "object", "properties": properties, "additionalProperties": False}


def _leaves(part: Schema, before: str = "") -> Iterator[str]:
    for key, value in part["properties"].items():
        if value.get("type") == "object":
            yield from _leaves(value, f"{before}{key}.")
        elif "x-unit" in value:
            yield f"{before}{key}"


def finished(part: Any) -> Any:
    """Schema for editors, of draft 7: without keywords of this package."""
    if isinstance(part, list):
        return [finished(item) for item in part]
    if not isinstance(part, dict):
        return part
    table = part.get("x-table")
    if isinstance(table, str):
        kept = {key: part[key] for key in ("description", "default", "examples") if key in part}
        reference = {"$ref": f"#/definitions/{table}"}
        return {"allOf": [reference]} | kept if kept else reference
    part = {key: finished(value) for key, value in part.items() if key != "x-unit"}
    if isinstance(part.get("prefixItems"), list):
        part["items"] = part.pop("prefixItems")[0]
    return part
