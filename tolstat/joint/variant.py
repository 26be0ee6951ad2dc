"""Rebuild the joint of a variant from the values that the result file stores."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from tolstat.common.strict import validate
from tolstat.joint.model import Joint
from tolstat.joint.overrides import laid_over, leaves


def varied(joint: Joint, values: Mapping[str, Any]) -> Joint:
    """Return the joint of a variant.

    Parameters
    ----------
    joint : Joint
        The joint of the study.
    values : mapping
        `Variant.values`: dotted key of the joint to SI value or string, None for a key that follows from others; keys
        of other sections are ignored.
    """
    own = {key: value for key, value in values.items() if key.partition(".")[0] in Joint.model_fields}
    if not own:
        return joint
    kept = {key: value for key, value in leaves(joint.given()).items() if key not in own}
    new = {key: value for key, value in own.items() if value is not None}
    return validate(Joint, laid_over(_tables(kept), _tables(new)), "joint", context={"si": True})


def _tables(values: Mapping[str, Any]) -> dict[str, Any]:
    """Nested tables from dotted keys."""
    found: dict[str, Any] = {}
    for key, value in values.items():
        *path, name = key.split(".")
        table = found
        for part in path:
            table = table.setdefault(part, {})
        table[name] = value
    return found
