"""Quantities as drawings write them: the sign before the number, angles in minutes, units without a dot between.

Their JSON schema is for editors, see `study.schema`. Keywords of this package in it: ``x-unit``, the SI unit of a
quantity, ``"error"`` for that of the error that an entry is for; ``x-table``, the name of a definition that stands in
place of the property.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, NamedTuple

DIAMETER = "⌀"
PLUS_MINUS = "±"
MINUS = str.maketrans("−–", "--")
"""Signs that spreadsheets and text processors write for a minus."""
NAMES = {DIAMETER: "a diameter", PLUS_MINUS: "a band"}
"""What a value with each sign is."""


class Written(NamedTuple):
    """A quantity as it is written.

    Attributes
    ----------
    mark : str
        `DIAMETER`, `PLUS_MINUS`, or empty.
    number : float
        The number before the unit.
    unit : str
        The unit as written; empty for a pure number.
    """

    mark: str
    number: float
    unit: str


_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_NOT_FINITE = r"[+-]?(?:nan|inf(?:inity)?)(?![a-z])"
_QUANTITY = re.compile(
    rf"\s*(?P<number>{_NUMBER}|{_NOT_FINITE})"
    r"\s*(?P<unit>|(?:1?\s*/\s*)?[A-Za-zµμ°%][\w µμ°%*/^().·⁻¹²³⁴-]{0,40})\s*",
    re.ASCII | re.IGNORECASE,
)
"""A number and a unit. Anything else is refused: pint would read "1,5 mm" as 15 mm and "0,1 mm" as nothing."""

_MARK = re.compile(r"\s*(?:(?P<diameter>[⌀ØøΦφ∅]|dia(?:meter\b|\.|\b|(?=\d)))|(?P<band>±|\+/?[-−]))\s*", re.IGNORECASE)
_MARK_BEHIND = re.compile(r"(?<=[\w.])\s+dia\.?\s*", re.IGNORECASE)

_MINUTE, _SECOND = "['′’]", "(?:[\"″”]|''|′′|’’)"
_ANGLE = re.compile(
    r"\s*(?P<sign>[+-]?)\s*(?=\d)"
    rf"(?:(?P<degrees>\d+)\s*°\s*)?(?:(?P<minutes>\d+(?:\.\d+)?)\s*{_MINUTE}(?!['′’])\s*)?"
    rf"(?:(?P<seconds>\d+(?:\.\d+)?)\s*{_SECOND}\s*)?",
    re.ASCII,
)
"""Degrees, minutes and seconds, of which any may be left out."""

_SPELLINGS = (
    (re.compile(r"(?<![A-Za-z])([kMmd]?N)(m|cm|mm)(?![A-Za-z])"), r"(\1*\2)"),
    (re.compile(r"(?<![A-Za-z])(?:U|r|tr)(?![A-Za-z])"), "turn"),
    (re.compile(r"(?<![A-Za-z])(?:RPM|Rpm|UPM|UpM|Upm)(?![A-Za-z])"), "rpm"),
    (re.compile(r"(?<=[A-Za-z])-1(?!\d)"), "^-1"),
    (re.compile(r"·"), "*"),
    (re.compile(r"^\s*/"), "1/"),
)
"""Spellings that pint does not know or takes for something else, and what is meant: Nm, U/min, r/min, RPM, min-1."""

MAX_LENGTH = 100
"""Largest number of characters of a quantity."""
_ODD_POWER = re.compile(r"(?:\^|\*\*)(?!\s*\(?\s*[-+]?\d{1,2}(?:\.\d{1,3})?\s*\)?(?![\w.(]|\s*(?:\^|\*\*)))")
"""Power whose exponent is no small number: a unit is computed, and ``m**9**9**9`` would take for ever."""


def read(text: str) -> Written | None:
    """Sign, number and unit of a quantity as it stands on a drawing; None if it is none."""
    if len(text) > MAX_LENGTH or _ODD_POWER.search(text):
        return None
    mark, rest = "", text
    if (sign := _MARK.match(text)) is not None:
        mark, rest = (DIAMETER if sign["diameter"] else PLUS_MINUS), text[sign.end() :]
        if rest[:1] in ("+", "-"):
            return None
    elif (sign := _MARK_BEHIND.search(text)) is not None and sign.end() == len(text):
        mark, rest = DIAMETER, text[: sign.start()]
    angle = _degrees(rest)
    if angle is not None:
        return Written(mark, angle, "deg")
    quantity = _QUANTITY.fullmatch(rest)
    return None if quantity is None else Written(mark, float(quantity["number"]), quantity["unit"])


def pint_unit(unit: str) -> str:
    """Spell a unit as pint reads it."""
    for spelt, meant in _SPELLINGS:
        unit = spelt.sub(meant, unit)
    return unit


def _degrees(text: str) -> float | None:
    """Degrees of an angle with minutes or seconds; None for other texts, and for 60 or more beside a larger unit."""
    angle = _ANGLE.fullmatch(text)
    if angle is None or not (angle["minutes"] or angle["seconds"]):
        return None
    degrees, minutes, seconds = (float(angle[name] or 0.0) for name in ("degrees", "minutes", "seconds"))
    whole = "." not in (angle["minutes"] or "") or not angle["seconds"]
    below = (not angle["degrees"] or minutes < 60.0) and (not (angle["degrees"] or angle["minutes"]) or seconds < 60.0)
    if not (whole and below):
        return None
    size = degrees + minutes / 60.0 + seconds / 3600.0
    return -size if angle["sign"] == "-" else size


PURE = rf"^\s*{_NUMBER}\s*%?\s*$"
"""Pattern of a text that is a number, for quantities without unit."""
_SIGN = r"(?:±|\+/?[-−]|[⌀ØøΦφ∅]|[Dd]ia(?:meter|\.)?)?"
WITH_UNIT = rf"^\s*{_SIGN}\s*{_NUMBER}\s*(?:1\s*/|[eE][^\d+-]|[A-DF-Za-df-zµμ°′'%/(])"
"""Pattern of the beginning of a quantity with a unit. It accepts more than is read: the unit is checked by `units`.
Without look-around, which some editors' regular expressions lack."""


def schema_of_quantity(unit: str, example: str, words: tuple[str, ...] = ()) -> dict[str, Any]:
    """JSON schema of a quantity as a file writes it.

    Parameters
    ----------
    unit : str
        SI unit; of unit ``"1"`` are bare numbers, of all others texts with a number and a unit.
    example : str
        How such a value is written.
    words : tuple of str
        Words that may stand in place of a quantity.
    """
    if unit == "1":
        return {"type": ["number", "string"], "pattern": PURE, "x-unit": unit}
    if words:
        written = {"type": "string", "pattern": WITH_UNIT}
        return {"anyOf": [{"enum": list(words)}, written], "x-unit": unit, "examples": [example]}
    return {"type": "string", "pattern": WITH_UNIT, "x-unit": unit, "examples": [example]}


def schema_of_positive(own: dict[str, Any]) -> dict[str, Any]:
    """JSON schema of a quantity that must be above zero."""
    bounded = own | {"exclusiveMinimum": 0}
    return bounded | schema_of_sign(bounded)


def schema_of_sign(own: Mapping[str, Any]) -> dict[str, Any]:
    """Keyword that refuses a minus sign in the text of a quantity that must not be negative."""
    if "string" not in str(own.get("type", own)) or 0 not in (own.get("minimum"), own.get("exclusiveMinimum")):
        return {}
    return {"not": {"type": "string", "pattern": r"^\s*-"}}
