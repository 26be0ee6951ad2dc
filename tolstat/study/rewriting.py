"""Change keys in the text of a study, keeping its comments."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from tolstat.common.errors import Fault, InputError


def by_section(text: str) -> Iterator[tuple[str, str]]:
    """Lines of a TOML text, each with the dotted name of the table that it is in."""
    section = ""
    for line in text.splitlines():
        header = re.match(r"\s*\[+\s*([^\]]+?)\s*\]", line)
        section = header[1] if header else section
        yield section, line


def with_keys(text: str, section: str, values: Mapping[str, Any], place: str) -> str:
    """Set keys of one table of a study.

    Parameters
    ----------
    text : str
        TOML.
    section : str
        The table, which has a header of its own and one line per key.
    values : mapping
        Key to JSON value; keys that the table lacks are added.
    place : str
        File name shown in faults.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    InputError
        When the table is written in another way.
    """
    left, lines, header = dict(values), [], -1
    for number, (within, line) in enumerate(by_section(text)):
        key = line.partition("=")[0].strip()
        if within == section and line.lstrip().startswith("["):
            header = number
        if within == section and key in left:
            line = f"{key} = {json.dumps(left.pop(key))}"
        lines.append(line)
    lines[header + 1 : header + 1] = [f"{key} = {json.dumps(value)}" for key, value in left.items()]
    found = "\n".join(lines) + "\n"
    wanted = tomllib.loads(text)
    wanted[section] = wanted.get(section, {}) | dict(values)
    try:
        same = tomllib.loads(found) == wanted
    except tomllib.TOMLDecodeError:
        same = False
    if not same:
        remedy = f"write the header [{section}] on a line of its own, and each key on one line below"
        raise InputError([Fault(f"{place}: {section}", "cannot be edited automatically", remedy)])
    return found
