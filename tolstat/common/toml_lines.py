"""Lines of the keys of a TOML text, for the places of faults: ``tomllib`` and tomlkit keep no positions."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from typing import Any

KeyPath = tuple[int | str, ...]
CLOSING = {"[": "]", "{": "}"}

_STRING_OR_COMMENT = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}(?!")' + r"|'''.*?'{3,5}(?!')" + r"""|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'|#[^\n]*""", re.DOTALL
)
_AT = re.compile(r"\s*\(at (?:line (\d+), column (\d+)|end of document)\)")


def of_syntax(error: tomllib.TOMLDecodeError, text: str) -> tuple[int, str, str]:
    """Line of a syntax error, what the parser says without the place, and a remedy."""
    at, message = _AT.search(str(error)), _AT.sub("", str(error))
    lines = text.splitlines() or [""]
    if at is None or not at[1]:
        return len(lines), f"{message} (end of the file)", "close what is open, or correct the syntax"
    line = int(at[1])
    return line, f"{message} (column {at[2]})", _remedy(message, lines[min(line, len(lines)) - 1], int(at[2]))


_STRAIGHT = str.maketrans(dict.fromkeys("“”„‟«»", '"') | dict.fromkeys("‘’‚‛‹›", "'"))
"""Typographic quotes, to those of TOML."""
_DECIMAL_COMMA = re.compile(r"(=\s*[+-]?\d+),(\d+)(?=\s*(?:[,}#]|$))")
_UNQUOTED_INSIDE = re.compile(r"""(=\s*)([+-]?\d[\d.,]*\s*[^\s\d"'{}\[\],#][^"'{}\[\],#]*?)(?=\s*[,}])""")
_UNQUOTED_KEY = re.compile(r"""\s*(?P<key>[^\s"'#=]*[*?\[\]{}/°][^\s"'#=]*)\s*=\s*(?P<value>.+)""")
_UNQUOTED_VALUE = re.compile(r"""\s*(?P<key>[^=#]+?)\s*=\s*(?P<value>[^\s"'\[{#,][^"'#,{}\[\]]*?)\s*(?:#.*)?""")


def _remedy(message: str, line: str, column: int) -> str:
    """Remedy for a line with a syntax error at a column, from what the parser says of it; most often quotes lack."""
    key, value = _UNQUOTED_KEY.fullmatch(line), _UNQUOTED_VALUE.fullmatch(line)
    if line[column - 1 : column].translate(_STRAIGHT) != line[column - 1 : column]:
        return f"write straight quotes, not typographic ones: {line.translate(_STRAIGHT).strip()}"
    for what, changed in (
        ("straight quotes, not typographic ones", line.translate(_STRAIGHT)),
        ("a point for the decimal comma", _DECIMAL_COMMA.sub(r"\1.\2", line)),
        ("the value in quotes", _UNQUOTED_INSIDE.sub(r'\1"\2"', line)),
    ):
        if changed != line and _is_toml(changed):
            return f"write {what}: {changed.strip()}"
    if message.startswith("Cannot"):
        return "remove one of the two: the key or table is there already"
    if message.startswith("Illegal character '\\n'"):
        return "close the quotes on the same line"
    if line.count("{") > line.count("}"):
        return "write a table in { } on one line, or under a header [ ]"
    if key is not None:
        return f'write the name in quotes: "{key["key"]}" = {key["value"].strip()}'
    if value is not None:
        return f'write the value in quotes: {value["key"]} = "{value["value"]}"'
    return "correct the syntax there"


def _is_toml(line: str) -> bool:
    try:
        tomllib.loads(line)
    except tomllib.TOMLDecodeError:
        return False
    return True


def of_keys(text: str) -> dict[KeyPath, int]:
    """Line of each key path of a text that ``tomllib`` can read.

    Parameters
    ----------
    text : str
        TOML.

    Returns
    -------
    dict
        Key path, with the index of an entry of a list, to its line (from 1). A table that has a header has the header's
        line, another the line of its first key.
    """
    lines: dict[KeyPath, int] = {}
    sizes: dict[KeyPath, int] = {}
    table: KeyPath = ()
    statement, first, before = "", 1, 0
    for number, line in enumerate(text.split("\n"), start=1):
        statement += f"{line}\n"
        opened = _open(statement)
        closing = "".join(CLOSING[statement[at]] for at in reversed(opened))
        try:
            data = tomllib.loads(statement + closing)
        except tomllib.TOMLDecodeError:  # inside a text of several lines
            continue
        if statement.lstrip().startswith("["):
            table = _table(data, lines, sizes, number)
        else:
            for path in paths(data, before):
                lines.setdefault((*table, *path), first)
        if closing == "]" and _blanked(statement).rstrip().endswith(","):
            # the items of a list so far are known: read on from its bracket, or a long list takes long
            items: Any = data
            while isinstance(items, dict):
                (items,) = items.values()
            before += len(items)
            statement = statement[: opened[0] + 1]
        elif not closing:
            statement, before = "", 0
        first = number + 1
    return lines


def _table(header: Any, lines: dict[KeyPath, int], sizes: dict[KeyPath, int], number: int) -> KeyPath:
    """Key path of a header, whose line is added to `lines`; an array of tables on the way means its last table."""
    path: KeyPath = ()
    while header:
        ((key, header),) = header.items()
        path = (*path, key)
        lines.setdefault(path, number)
        if isinstance(header, list):  # [[ ]]
            (header,) = header
            sizes[path] = sizes.get(path, 0) + 1
        if path in sizes:
            path = (*path, sizes[path] - 1)
    lines[path] = number
    return path


def _blanked(statement: str) -> str:
    """Statement with spaces in place of texts and comments."""
    return _STRING_OR_COMMENT.sub(lambda match: " " * len(match[0]), statement)


def _open(statement: str) -> list[int]:
    """Places of the brackets that are open at the end of a statement."""
    opened: list[int] = []
    for bracket in re.finditer(r"[\[\]{}]", _blanked(statement)):
        if bracket[0] in CLOSING:
            opened.append(bracket.start())
        elif opened:
            opened.pop()
    return opened


def paths(data: object, before: int = 0) -> Iterator[KeyPath]:
    """Key paths of nested tables and lists; the first item of the outermost list has the index `before`."""
    if isinstance(data, dict):
        for key, value in data.items():
            yield (key,)
            yield from ((key, *path) for path in paths(value, before))
    elif isinstance(data, list):
        for index, value in enumerate(data, before):
            yield (index,)
            yield from ((index, *path) for path in paths(value))
