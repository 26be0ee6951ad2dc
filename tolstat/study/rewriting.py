"""Change keys in the text of a study; comments, order and all other values stay as they are written.

Of a study file for `with_settings`: ``tolstat run STUDY --set joint.shaft.axial=free``.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

import numpy as np

from tolstat.common.errors import input_error
from tolstat.common.late import tomlkit

QUOTES = dict.fromkeys(map(ord, "\"'"))
"""Quotes that TOML has around parts of a key: on the command line they may be there or not."""
SETTABLE = ("joint", "mechanism", "operation", "sampling", "output")
"""Sections whose keys `with_settings` sets; a setting of the solver is one of ``run --retry``."""


def with_settings(text: str, settings: Sequence[str]) -> str:
    """Set keys of a study from the command line.

    Parameters
    ----------
    text : str
        TOML of a study.
    settings : sequence of str
        ``"joint.shaft.axial=free"``: dotted key, and value as in TOML; quotes may be left out.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    InputError
        When a setting is none, or is in another section than those of `SETTABLE`; see `with_keys`.
    """
    for setting in settings:
        place = f"--set {setting!r}"
        path, value = parsed(setting, place, "write --set joint.shaft.axial=free")
        if path[0] not in SETTABLE:
            allowed = f"set keys of {', '.join(SETTABLE)}; edit the study for others"
            raise input_error(place, f"is in section {path[0]!r}", allowed)
        text = with_path(text, path, value, place)
    return text


def as_text(sections: Mapping[str, Any]) -> str:
    """TOML of a study's sections.

    Raises
    ------
    InputError
        When a value is of no type that TOML has.
    """
    try:
        return tomlkit.dumps(_plain(sections))
    except (tomlkit.exceptions.TOMLKitError, TypeError, ValueError) as error:
        found = f"a value cannot be written to a study: {error}"
        raise input_error("study", found, "give texts, numbers, true or false, lists and dictionaries") from error


def _plain(value: Any) -> Any:
    """Value with the types that TOML has, from those of NumPy, of pint and of paths."""
    if isinstance(value, Mapping):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if hasattr(value, "magnitude"):
        return f"{value.magnitude} {value.units}"
    return str(value) if isinstance(value, Path) else value


def source(study: object, text: str | None = None) -> tuple[Path, str | None]:
    """Path of a study file, and `text` in place of its own; of sections the path that faults name, and their TOML.

    Raises
    ------
    InputError
        When `study` is of another type, or as `as_text`.
    """
    if isinstance(study, Mapping):
        return Path("study.toml"), as_text(study)
    if isinstance(study, str | Path):
        return Path(study), text
    remedy = "give the path of its TOML file, its sections as dictionaries, or what tolstat.load returns"
    raise input_error("study", f"an object of type {type(study).__name__} is none", remedy)


def parsed(setting: str, place: str, example: str) -> tuple[list[str], Any]:
    """Key path of a setting of the command line, and its value: as in TOML; a text may lack its quotes.

    Raises
    ------
    InputError
        When it is not a dotted key of a section with a value; `example` is the remedy.
    """
    name, _, value = setting.partition("=")
    name = name.translate(QUOTES)
    path = [part.strip() for part in name.split(".")]
    if not (value.strip() and all(path) and len(path) > 1):
        raise input_error(place, "is not a setting", example)
    try:
        return path, tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        return path, value.strip()


def with_path(text: str, path: Sequence[str], value: Any, place: str) -> str:
    """Set a key at a dotted path, in the innermost of the tables around it that the text has."""
    inner: Any = tomllib.loads(text)
    if path[0] not in inner:
        text = f"{text.rstrip()}\n\n[{path[0]}]\n"
        inner = {path[0]: {}}
    depth = 0
    while depth < len(path) - 1 and isinstance(inner, Mapping) and path[depth] in inner:
        inner = inner[path[depth]]
        depth += 1
    if not isinstance(inner, Mapping):
        raise input_error(place, f"{'.'.join(path[:depth])} is no single table", "edit the study")
    for key in reversed(path[depth + 1 :]):
        value = {key: value}
    return with_keys(text, {tuple(path[:depth]): {path[depth]: value}}, place)


def with_keys(text: str, changes: Mapping[tuple[int | str, ...], Mapping[str, Any]], place: str) -> str:
    """Set keys of tables of a study.

    Parameters
    ----------
    text : str
        TOML.
    changes : mapping
        Key path of a table that the text has, to key and value; a value of None removes the key and the
        comment in its line. Values that are equal to those of the text keep their form.
    place : str
        File name shown in faults.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    InputError
        When tomlkit would move tables, or cannot read them.
    """
    try:
        document: Any = tomlkit.parse(text)
    except tomlkit.exceptions.TOMLKitError:
        document = None
    if document is None or document.as_string() != text:
        remedy = "write tables such as [a.b] and [a.c], or two [[a]], below each other, with no other table between"
        raise input_error(place, "cannot be changed in place: its tables are interlaced", remedy)
    for path, values in changes.items():
        for key, value in values.items():
            _put(reduce(getitem, path, document), key, value)
        table = reduce(getitem, path, document)
        if isinstance(table, tomlkit.items.InlineTable):  # tomlkit leaves uneven blanks in it
            reduce(getitem, path[:-1], document)[path[-1]] = tomlkit.value(inline(table))
    return str(document.as_string())


def inline(table: Mapping[str, Any]) -> str:
    """Table in one line, with the tables in it."""
    return f"{{ {', '.join(f'{key} = {literal(value)}' for key, value in table.items())} }}"


def literal(value: Any) -> str:
    """Return a value in one line, as TOML writes it."""
    if isinstance(value, Mapping):
        return inline(value)
    if isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
        return f"[{', '.join(map(literal, value))}]"
    return str(tomlkit.item(value).as_string())


def _put(table: Any, key: str, value: Any) -> None:
    """Set a key; a new one goes before comments at the end of the table, which may be about the next table."""
    if value is None:
        table.pop(key, None)
    elif table.get(key) != value:
        body = table.value.body if isinstance(table, tomlkit.items.Table) and key not in table else []
        comments = []
        while body and body[-1][0] is None:
            comments.append(body.pop())
        table[key] = tomlkit.value(literal(value)) if isinstance(value, Mapping | list) else value
        body.extend(reversed(comments))
