"""Tolerances of a study with the changes that ``--set`` gives on the command line."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import Any, NamedTuple

from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.strict import did_you_mean
from tolstat.study import rewriting, scaling, selection
from tolstat.study.study import Study
from tolstat.study.tolerances import fits, kinds, zones
from tolstat.study.tolerances.distributions import Distribution
from tolstat.study.tolerances.entry import Site, Toleranced, ToleranceEntry

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
    entries, touched = _keys(study, settings, faults)
    sites = {site.name: site for entry in study.entries for site, _ in entry.models}
    found = dict(study.tolerances)
    reported: set[tuple[str, ...]] = set()
    read: dict[str, tuple[Site, ToleranceEntry]] = {}
    for name, text in touched.items():
        site, place = sites[name], f"--set {text!r}"
        try:
            _check_bonus(study, name, place)
            read[name] = site, kinds.entry(entries[name], site, place, ("tolerances", name))
            _check_zone(study, site, read[name][1], place)
            found |= read[name][1].quantities(site)
        except InputError as error:
            key = (text, *(fault.found for fault in error.faults))
            if key not in reported:  # report a fault once for all errors of a pattern
                faults.extend(error.faults)
            reported.add(key)
    if not faults:
        new = [e._replace(models=tuple(read.get(m[0].name, m) for m in e.models)) for e in study.entries]
        zones.axes_of(new, study.joint.cross.R, "--set")
    if faults:
        raise InputError(faults)
    return found


def rewritten(study: Study, settings: Sequence[str]) -> str:
    """Text of a study with some keys of its tolerances changed, see `changed`; comments and seed are kept.

    An entry whose settings are for some of its errors only becomes one entry for each of its errors.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    InputError
        With the faults of the settings; see `rewriting.with_keys`.
    """
    faults: list[Fault] = []
    keys, touched = _keys(study, settings, faults)
    if faults:
        raise InputError(faults)
    alike: dict[str, dict[str, Any]] = {}
    parted: list[Toleranced] = []
    for entry in study.entries:
        own = [keys[site.name] for site, _ in entry.models]
        if touched.keys() & {site.name for site, _ in entry.models}:
            alike[entry.pattern] = own[0] if all(one == own[0] for one in own) else dict(entry.keys)
            parted += [entry] * any(one != own[0] for one in own)
    text = scaling.rewritten(study, alike, study.sampling.seed)
    paths = {entry.pattern: entry.path for entry in fits.entries(tomllib.loads(text)["tolerances"], None)}
    changes: dict[tuple[int | str, ...], dict[str, Any]] = {("tolerances",): {}}
    for entry in parted:
        *table, key = paths[entry.pattern]
        changes.setdefault(tuple(table), {})[str(key)] = None
        changes["tolerances",] |= {site.name: keys[site.name] for site, _ in entry.models}
    return rewriting.with_keys(text, changes, f"{study.name}.toml")


def _keys(
    study: Study, settings: Sequence[str], faults: list[Fault]
) -> tuple[dict[str, dict[str, Any]], dict[str, str]]:
    """Keys of the entry of each error with the settings; and the setting that changes them, of those changed."""
    keys = {site.name: dict(entry.keys) for entry in study.entries for site, _ in entry.models}
    touched: dict[str, str] = {}
    for text in settings:
        with gather(faults):
            setting = _parse(text)
            names = selection.select(setting.pattern, keys)
            if not names:
                remedy = did_you_mean(setting.pattern, list(keys))
                raise InputError([Fault(f"--set {text!r}", "selects no error that has a tolerance", remedy)])
            for name in names:
                kept = {k: v for k, v in keys[name].items() if k not in REPLACED_KEYS.get(setting.key, ())}
                keys[name] = kept | {setting.key: setting.value}
                touched[name] = text
    return keys, touched


def _check_bonus(study: Study, name: str, place: str) -> None:
    """Refuse changes of a position with a bonus and of its diameter: they move what a part's zone is."""
    if study.has_bonus(name):
        found = "a position with a bonus by maximum material cannot be changed, nor its diameter"
        if study.sampling.is_matched and name.endswith(".diameter"):
            found = "a diameter that is matched by classes cannot be changed"
        raise InputError([Fault(place, found, "run a study of its own")])


def _check_zone(study: Study, site: Site, new: ToleranceEntry, place: str) -> None:
    """Refuse changes of a zone for which the density of the errors is no function of radius and direction alone."""
    if not isinstance(new, zones.ZoneEntry):
        return
    old: Any = next(model for entry in study.entries for one, model in entry.models if one.name == site.name)
    changed_length = site.name.endswith(".position") and new.over != old.over
    if changed_length or new.quantities(site).keys() != old.quantities(site).keys():
        found = f"{site.name} gets another shape, not another size"
        raise InputError(
            [Fault(place, found, "change zone, cp, truncate or distribution only, or run a study of its own")]
        )
    if site.shared and isinstance(new, zones.PositionEntry) and new.build() != old.build():
        found = f"{site.name} cannot be changed: the axis has a zone of direction, too, which shares its room"
        raise InputError([Fault(place, found, "run a study of its own")])


def _parse(text: str) -> _Setting:
    path, equals, value = text.partition("=")
    pattern, dot, key = path.strip().rpartition(".")
    if not (equals and dot and pattern and key and value.strip()):
        raise InputError([Fault(f"--set {text!r}", "is not a setting", EXAMPLE)])
    return _Setting(pattern, key, rewriting.given(value), text)
