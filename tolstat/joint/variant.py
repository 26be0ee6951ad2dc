"""Rebuild the joint of a variant from the values that the result file stores."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tolstat.joint.contact import Station
from tolstat.joint.model import Joint
from tolstat.joint.sections import BeamAxes


def varied(joint: Joint, values: Mapping[str, Any]) -> Joint:
    """Return the joint of a variant.

    Parameters
    ----------
    joint : Joint
        The joint of the study.
    values : mapping
        `Variant.values`: dotted key of the joint to SI value or string; keys of other sections are ignored.
    """
    sections: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        section, _, name = key.partition(".")
        if section not in Joint.model_fields:
            continue
        sections.setdefault(section, {})[name] = tuple(map(_item, value)) if isinstance(value, list) else value
    update = {name: _section(getattr(joint, name), own) for name, own in sections.items()}
    return joint.model_copy(update=update)


def _item(value: Any) -> Any:
    """Convert an item of a list: a contact station, or a number."""
    return Station.model_construct(**value) if isinstance(value, Mapping) else value


def _section(section: Any, values: Mapping[str, Any]) -> Any:
    """Copy a section with new values; a dotted key belongs to a table in it (the stiffness of a bushing)."""
    flat = {key: value for key, value in values.items() if "." not in key}
    tables: dict[str, dict[str, Any]] = {}
    for key, value in values.items():
        table, dot, name = key.partition(".")
        if dot:
            tables.setdefault(table, {})[name] = value
    for table, own in tables.items():
        before = getattr(section, table)
        flat[table] = before.model_copy(update=own) if before is not None else BeamAxes.model_construct(**own)
    return section.model_copy(update=flat)
