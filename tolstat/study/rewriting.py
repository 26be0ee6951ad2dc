"""Change keys in the text of a study; comments, order and all other values stay as they are written."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from operator import getitem
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import InlineTable, Table

from tolstat.common.errors import Fault, InputError


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
    except TOMLKitError:
        document = None
    if document is None or document.as_string() != text:
        remedy = "write tables such as [a.b] and [a.c], or two [[a]], below each other, with no other table between"
        raise InputError([Fault(place, "cannot be changed in place: its tables are interlaced", remedy)])
    for path, values in changes.items():
        for key, value in values.items():
            _put(reduce(getitem, path, document), key, value)
        table = reduce(getitem, path, document)
        if isinstance(table, InlineTable):  # where keys were added or removed, tomlkit leaves uneven blanks
            reduce(getitem, path[:-1], document)[path[-1]] = tomlkit.value(inline(table))
    return str(document.as_string())


def inline(table: Mapping[str, Any]) -> str:
    """Table in one line."""
    return f"{{ {', '.join(f'{key} = {tomlkit.item(value).as_string()}' for key, value in table.items())} }}"


def _put(table: Any, key: str, value: Any) -> None:
    """Set a key; a new one goes before comments at the end of the table, which may be about the next table."""
    if value is None:
        table.pop(key, None)
    elif table.get(key) != value:
        body = table.value.body if isinstance(table, Table) and key not in table else []
        comments = []
        while body and body[-1][0] is None:
            comments.append(body.pop())
        table[key] = tomlkit.value(inline(value)) if isinstance(value, Mapping) else value
        body.extend(reversed(comments))
