"""What is assumed of the joint, and what the verdict stands on, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

AXIAL, LAW = "shaft.axial", "contact.law"
_SHAFT = {"free": ("shaft slides", "if the shaft slides"), "rigid": ("shaft rigid", "if the shaft is held rigidly")}
"""Mounting of the shafts: as a label, and as a condition."""
_LONGEST = 12
"""Number of letters of a name up to which a label has it beside the key."""


def label(name: str, values: Mapping[str, Any]) -> str:
    """Label of a value of an assumption: ``shaft slides``, ``law sliced``, ``clearance 0.05 mm``, ``fork (l_f 30 mm)``.

    Where the name is long it is the key alone, ``r_b 30 mm``.

    Parameters
    ----------
    name : str
        Name of the assumption.
    values : mapping
        Dotted keys of the joint, and their values as written; the first is the one that the assumption is about.
    """
    if AXIAL in values:
        return _SHAFT.get(values[AXIAL], (f"shaft held with {_written(values[AXIAL])}", ""))[0]
    if LAW in values:
        return f"law {values[LAW]}"
    key, value = next(iter(values.items()))
    last = key.rpartition(".")[2]
    if last in name.split():
        return f"{name} {_written(value)}"
    symbol = f"{last} {_written(value)}"
    return symbol if len(name) > _LONGEST else f"{name} ({symbol})"


def keys(values: Mapping[str, Any]) -> str:
    """Keys of the joint with their values, as a joint file has them."""
    return ", ".join(f"{key} = {_written(value)}" for key, value in values.items())


def condition(label: str) -> str:
    """Under which condition the share is that of a variation: ``if the shaft slides``, ``with law sliced``."""
    return dict(_SHAFT.values()).get(label) or f"with {label.replace('all at', 'all assumptions at')}"


def to_find_out(names: Mapping[str, bool]) -> str:
    """What has to be found out: names of assumptions, and whether each is about what holds the shaft."""
    return listed([_noun(name, is_mounting) for name, is_mounting in names.items()])


def listed(items: Sequence[str]) -> str:
    """``a, b and c``."""
    *most, last = items
    return f"{', '.join(most)} and {last}" if most else last


def _noun(name: str, is_mounting: bool) -> str:
    if is_mounting:
        return "how the shaft is held"
    return f"the {name}" if name[:1].islower() else name


def _written(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text.replace("*", " ").replace("^2", "²").replace("^3", "³")
