"""What texts call a row: they are written for joints, and told with the word of the mechanism, ``shaft``."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tolstat.common.mechanism import Mechanism

_JOINTS = r"""[Jj]oint\ [12]\b | (?i:both|between\ the|cardan|universal|slip|shaft\ of\ two)\ joints?\b
    | joint\ (?:files?|centre|shafts|or\ tolerances|without\ bearings|from\ its\ own\ dimensions|friction\.mu)\b
    | joint's\ (?:centre|speed)\b | (?:centre|keys|\w\.\w+|\[\w+\])\ of\ the\ joint\b"""
"""What is said of one of the joints of a shaft, or of the nominal joint and its file."""
_ROW = r"""(?<! [\w./\\*\[\]"'`=-] ) (?P<first>[Jj])oint(?P<several>s?) (?! [\w\\*\[\]"`=-] | /(?!s\b) | \.[\w*\[] )"""
"""A row: no part of a name, a key, an option or a path."""

LINKAGE = "mechanism"
"""What a row of linkages is called, whose pins are in eyes."""
_HOLE = re.compile(r"(?<![\w./*`-])hole(s?)(?![\w.*\[`])")


def row_of(mechanism: Mechanism) -> str:
    """What a row of a mechanism's tables is called."""
    if not mechanism.cardan:
        return LINKAGE
    return "shaft" if mechanism.is_shaft else "joint"


@dataclass(frozen=True)
class Wording:
    """Tells a text that was written for joints.

    Attributes
    ----------
    word : str
        What a row is called, see `row_of`.
    names : tuple of str
        Names by the user, which stay as they are.
    """

    word: str = "joint"
    names: tuple[str, ...] = ()

    @classmethod
    def of(cls, mechanism: Mechanism, study: str = "", names: Iterable[str] = ()) -> Wording:
        """Wording for a mechanism; `study` is the text of the study, whose names and values stay as they are."""
        word = row_of(mechanism)
        if word == AS_WRITTEN.word:
            return AS_WRITTEN
        written = {*names, *_names_in(study)}
        return cls(word, tuple(sorted(name for name in written if "oint" in name and " " in name.strip())))

    @property
    def title(self) -> str:
        """The mechanism in a headline."""
        return {"joint": "Cardan joint", "shaft": "drive shaft"}.get(self.word, self.word)

    def __call__(self, text: str) -> str:
        """Tell a text with the word for a row; all else stays as it is."""
        if self.word == LINKAGE:
            text = _HOLE.sub(r"eye\1", text)
        if self == AS_WRITTEN or "oint" not in text:
            return text
        return _pattern(self.names).sub(self._told, text)

    def _told(self, found: re.Match[str]) -> str:
        if found["first"] is None:
            return found[0]
        word = self.word.capitalize() if found["first"] == "J" else self.word
        return word + found["several"]


AS_WRITTEN = Wording()
"""Wording where rows are joints."""


@cache
def _pattern(names: tuple[str, ...]) -> re.Pattern[str]:
    # a name of a file may go on: NAME_limits.csv
    own = "".join(rf"(?<!\w){re.escape(name)} | " for name in sorted(names, key=len, reverse=True))
    return re.compile(f"{own}{_JOINTS} | {_ROW}", re.VERBOSE)


def _names_in(study: str) -> Iterator[str]:
    """Keys and texts of a study; none of one that can no longer be read."""
    try:
        yield from _texts(tomllib.loads(study))
    except tomllib.TOMLDecodeError:
        return


def _texts(value: Any) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, inner in value.items():
            yield key
            yield from _texts(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _texts(inner)
