"""Keys that a case, study or variant has in place of those of a joint file."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from tolstat.joint import derived
from tolstat.joint.contact import keys_valid_for


def overridden(data: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Replace keys of a joint file by those of `over`; remove what follows from these and is not in `over`, too."""
    given = leaves(over).keys()
    outdated = derived.changed(given, leaves(data)) - given
    return laid_over(_without(data, outdated), over)


def laid_over(below: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Replace keys of a joint by those of `over`, and remove those of another contact law or a third of a bearing."""
    contact, new = below.get("contact"), over.get("contact")
    if isinstance(contact, Mapping) and isinstance(new, Mapping) and "law" in new:
        below = {**below, "contact": keys_valid_for(contact, new["law"])}
    return merged(_without(below, derived.replaced(leaves(over), leaves(below))), over)


def merged(data: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Replace keys of `data` by those of `over`, table by table."""
    result = dict(data)
    for key, value in over.items():
        below = result.get(key)
        if isinstance(below, Mapping) and isinstance(value, Mapping):
            value = merged(below, value)
        result[key] = value
    return result


def leaves(table: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Values of a joint by dotted key."""
    values: dict[str, Any] = {}
    for key, value in table.items():
        values |= leaves(value, f"{before}{key}.") if isinstance(value, Mapping) else {f"{before}{key}": value}
    return values


def nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Nested tables from dotted keys: the inverse of `leaves`."""
    result: dict[str, Any] = {}
    for key, value in values.items():
        *tables, name = key.split(".")
        inner: Any = value if not tables else {name: value}
        for part in reversed(tables[1:]):
            inner = {part: inner}
        result = merged(result, {tables[0] if tables else name: inner})
    return result


def _without(table: Mapping[str, Any], away: Collection[str], before: str = "") -> dict[str, Any]:
    return {
        key: _without(value, away, f"{before}{key}.") if isinstance(value, Mapping) else value
        for key, value in table.items()
        if f"{before}{key}" not in away
    }
