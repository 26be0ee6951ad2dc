"""Lines of the keys of a TOML text, for the places of faults: ``tomllib`` and tomlkit keep no positions."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence

KeyPath = tuple[int | str, ...]

_KEY = re.compile(r"""[A-Za-z0-9_-]+|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'""")
_BLANK = re.compile(r"[ \t]*")
_SPACE = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
"""Blanks, line ends and comments."""
_STRING = re.compile(
    r'"""(?:[^\\]|\\.)*?"{3,5}(?!")' + r"|'''.*?'{3,5}(?!')" + r"""|"(?:[^"\\\n]|\\.)*"|'[^'\n]*'""", re.DOTALL
)
_BARE = re.compile(r"[^,\]}#\r\n]*")
"""A number, a date or a truth value."""
_AT = re.compile(r"\s*\(at (?:line (\d+), column (\d+)|end of document)\)")


def of_syntax(error: tomllib.TOMLDecodeError, text: str) -> tuple[int, str, str]:
    """Line of a syntax error, what the parser says without the place, and a remedy."""
    found, said = _AT.search(str(error)), _AT.sub("", str(error))
    lines = text.splitlines() or [""]
    if found is None or not found[1]:
        return len(lines), f"{said} (end of the file)", "close what is open, or correct the syntax"
    line = int(found[1])
    return line, f"{said} (column {found[2]})", _remedy(said, lines[min(line, len(lines)) - 1], int(found[2]))


_STRAIGHT = str.maketrans(dict.fromkeys("“”„‟«»", '"') | dict.fromkeys("‘’‚‛‹›", "'"))
"""Typographic quotes, to those of TOML."""
_DECIMAL_COMMA = re.compile(r"(=\s*[+-]?\d+),(\d+)(?=\s*(?:[,}#]|$))")
_UNQUOTED_INSIDE = re.compile(r"""(=\s*)([+-]?\d[\d.,]*\s*[^\s\d"'{}\[\],#][^"'{}\[\],#]*?)(?=\s*[,}])""")
_UNQUOTED_KEY = re.compile(r"""\s*(?P<key>[^\s"'#=]*[*?\[\]{}/°][^\s"'#=]*)\s*=\s*(?P<value>.+)""")
_UNQUOTED_VALUE = re.compile(r"""\s*(?P<key>[^=#]+?)\s*=\s*(?P<value>[^\s"'\[{#,][^"'#,{}\[\]]*?)\s*(?:#.*)?""")


def _remedy(said: str, line: str, at: int) -> str:
    """Remedy for a line with a syntax error at a column, from what the parser says of it; most often quotes lack."""
    key, value = _UNQUOTED_KEY.fullmatch(line), _UNQUOTED_VALUE.fullmatch(line)
    if line[at - 1 : at].translate(_STRAIGHT) != line[at - 1 : at]:
        return f"write straight quotes, not typographic ones: {line.translate(_STRAIGHT).strip()}"
    for what, changed in (
        ("straight quotes, not typographic ones", line.translate(_STRAIGHT)),
        ("a point for the decimal comma", _DECIMAL_COMMA.sub(r"\1.\2", line)),
        ("the value in quotes", _UNQUOTED_INSIDE.sub(r'\1"\2"', line)),
    ):
        if changed != line and _is_toml(changed):
            return f"write {what}: {changed.strip()}"
    if said.startswith("Cannot"):
        return "remove one of the two: the key or table is there already"
    if said.startswith("Illegal character '\\n'"):
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
    scanner = _Scanner(text)
    scanner.document()
    return scanner.implied | scanner.lines


class _Scanner:
    """Reads statements one after another.

    Attributes
    ----------
    lines, implied : dict
        Line of each key and header, and of the tables that only longer keys name.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self.at = 0
        self.lines: dict[KeyPath, int] = {}
        self.implied: dict[KeyPath, int] = {}
        self._counts: dict[KeyPath, int] = {}
        self._line, self._counted = 1, 0

    def document(self) -> None:
        table: KeyPath = ()
        while self._skip(_SPACE):
            if self.text.startswith("[[", self.at):
                table = self._next_of(self._header(2))
            elif self.text[self.at] == "[":
                table = self._header(1)
                self.lines[table] = self._here()
            else:
                self._pair(table)

    def _header(self, brackets: int) -> KeyPath:
        """Key path of a header; an array of tables on the way means its last table."""
        self.at += brackets
        keys = self._keys()
        path: KeyPath = ()
        for key in keys[:-1]:
            path = self._inside((*path, key))
            self.implied.setdefault(path, self._here())
        path = (*path, keys[-1])
        self.at += brackets
        return path if brackets == 2 else self._inside(path)

    def _inside(self, path: KeyPath) -> KeyPath:
        return (*path, self._counts[path] - 1) if path in self._counts else path

    def _next_of(self, array: KeyPath) -> KeyPath:
        number = self._counts.get(array, 0)
        self._counts[array] = number + 1
        self.lines.setdefault(array, self._here())
        self.lines[(*array, number)] = self._here()
        return (*array, number)

    def _pair(self, table: KeyPath) -> None:
        line = self._here()
        keys = self._keys()
        for depth in range(1, len(keys)):
            self.implied.setdefault((*table, *keys[:depth]), line)
        path = (*table, *keys)
        self.lines[path] = line
        self.at += 1  # the equals sign
        self._skip(_BLANK)
        self._value(path)

    def _value(self, path: KeyPath) -> None:
        opening = self.text[self.at]
        if opening == "[":
            self._items(path)
        elif opening == "{":
            self.at += 1
            while self._skip(_SPACE) and self.text[self.at] != "}":
                self._pair(path)
                self._comma()
            self.at += 1
        else:
            found = _STRING.match(self.text, self.at) or _BARE.match(self.text, self.at)
            self.at = found.end() if found is not None else len(self.text)

    def _items(self, path: KeyPath) -> None:
        self.at += 1
        number = 0
        while self._skip(_SPACE) and self.text[self.at] != "]":
            self.lines[(*path, number)] = self._here()
            self._value((*path, number))
            self._comma()
            number += 1
        self.at += 1

    def _comma(self) -> None:
        if self._skip(_SPACE) and self.text[self.at] == ",":
            self.at += 1

    def _keys(self) -> Sequence[str]:
        """Read a dotted key up to what ends it."""
        keys = []
        while True:
            self._skip(_BLANK)
            found = _KEY.match(self.text, self.at)
            assert found is not None
            self.at = found.end()
            written = found[0]
            keys.append(str(tomllib.loads(f"key = {written}")["key"]) if written[0] in "\"'" else written)
            self._skip(_BLANK)
            if self.text[self.at] != ".":
                return keys
            self.at += 1

    def _skip(self, blank: re.Pattern[str]) -> bool:
        """Go on behind blanks; whether anything follows."""
        found = blank.match(self.text, self.at)
        self.at = found.end() if found is not None else self.at
        return self.at < len(self.text)

    def _here(self) -> int:
        self._line += self.text.count("\n", self._counted, self.at)
        self._counted = self.at
        return self._line
