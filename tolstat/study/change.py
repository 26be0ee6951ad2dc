"""Tolerances of a study with the changes that ``--set`` gives on the command line."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.strict import did_you_mean
from tolstat.study import selection
from tolstat.study.file import nominal_value
from tolstat.study.study import Study
from tolstat.study.tolerances import fits
from tolstat.study.tolerances.distributions import Distribution
from tolstat.study.tolerances.entry import Site
from tolstat.study.tolerances.kinds import distribution

REPLACED_KEYS = {
    **dict.fromkeys(("plus_minus",), ("lower", "upper", "iso2768", "nominal")),
    **dict.fromkeys(("lower", "upper"), ("plus_minus", "iso2768", "nominal")),
    **dict.fromkeys(("iso2768", "nominal"), ("plus_minus", "lower", "upper")),
    "cpk": ("std", "sigma"),
    "std": ("cpk",),
    "sigma": ("cpk",),
}
"""Keys of a tolerance entry that each key replaces."""
EXAMPLE = 'write --set "pin*.offset_t.plus_minus=0.05 mm"'


class _Setting(NamedTuple):
    pattern: str
    key: str
    value: Any
    text: str


def changed(study: Study, settings: Sequence[str]) -> dict[str, Distribution]:
    """Tolerances of a study with some keys changed.

    Parameters
    ----------
    study : Study
        The study, which is not modified.
    settings : sequence of str
        ``"pin*.offset_t.plus_minus=0.05 mm"``: name or pattern of errors that the study scatters, key of their
        tolerances, value as in TOML; quotes may be left out. Later settings override earlier ones. A band given one
        way replaces a band given another way, and ``cpk`` replaces ``std``.

    Returns
    -------
    dict
        Error name to distribution, of all errors that the study scatters.

    Raises
    ------
    InputError
        With every fault of the settings.
    """
    faults: list[Fault] = []
    entries = _entries(study)
    touched: dict[str, str] = {}
    for text in settings:
        with gather(faults):
            setting = _parse(text)
            names = selection.select(setting.pattern, study.tolerances)
            if not names:
                remedy = did_you_mean(setting.pattern, list(study.tolerances))
                raise InputError([Fault(f"--set {text!r}", "selects no error that has a tolerance", remedy)])
            for name in names:
                kept = {k: v for k, v in entries[name].items() if k not in REPLACED_KEYS.get(setting.key, ())}
                entries[name] = kept | {setting.key: setting.value}
                touched[name] = text
    found = dict(study.tolerances)
    units = selection.UNITS | selection.RADIAL_UNITS
    reported: set[tuple[str, ...]] = set()
    for name, text in touched.items():
        center = nominal_value(name, study.operation)
        assert center is not None
        site = Site(name, units[name], center, study.path.parent)
        try:
            found[name] = distribution(entries[name], site, f"--set {text!r}", ("tolerances", name))
        except InputError as error:
            key = (text, *(fault.found for fault in error.faults))
            if key not in reported:  # report a fault once for all errors of a pattern
                faults.extend(error.faults)
            reported.add(key)
    if faults:
        raise InputError(faults)
    return found


def _entries(study: Study) -> dict[str, dict[str, Any]]:
    """Entry of each error that scatters, from the study's text."""
    table = tomllib.loads(study.text).get("tolerances", {})
    found: dict[str, dict[str, Any]] = {}
    for entry in fits.entries(table, fits.read(table, study.name)):
        if isinstance(entry.value, Mapping):
            found |= {name: dict(entry.value) for name in selection.select(entry.pattern, study.tolerances)}
    return found


def _parse(text: str) -> _Setting:
    path, equals, value = text.partition("=")
    pattern, dot, key = path.strip().rpartition(".")
    if not (equals and dot and pattern and key and value.strip()):
        raise InputError([Fault(f"--set {text!r}", "is not a setting", EXAMPLE)])
    try:
        read = tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        read = value.strip()
    return _Setting(pattern, key, read, text)
