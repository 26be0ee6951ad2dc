"""JSON schema of a table whose keys are names or patterns, such as ``"pin*.offset_[etz]"``.

A key with wildcards matches if its text before the first wildcard begins a name and its text after the last one ends a
name: a misspelt word is refused, and no pattern that selects something is.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping
from typing import Any

from tolstat.study.selection import select

Schema = dict[str, Any]


def table(entries: Mapping[str, Schema]) -> Schema:
    """JSON schema of a table.

    Parameters
    ----------
    entries : mapping
        Name to the schema of its entry. Names with equal schemas can be selected by one pattern.

    Returns
    -------
    dict
        Keys may be quoted (``"pin1.offset_t"``), dotted (``pin1.offset_t``), or patterns.
    """
    groups = _by_schema(entries)
    features = dict.fromkeys(name.partition(".")[0] for name in entries)
    own = {feature: {n.partition(".")[2]: s for n, s in entries.items() if _is_of(n, feature)} for feature in features}
    return {
        "type": "object",
        "properties": {f: halves[""] if "" in halves else _nested(f, halves) for f, halves in own.items()},
        "patternProperties": {f"^(?:{_dotted(names)})$": schema for names, schema in groups},
        "additionalProperties": False,
    }


def _is_of(name: str, feature: str) -> bool:
    return name.partition(".")[0] == feature


def _by_schema(entries: Mapping[str, Schema]) -> list[tuple[list[str], Schema]]:
    groups: dict[str, list[str]] = {}
    for name, schema in entries.items():
        groups.setdefault(json.dumps(schema), []).append(name)
    return [(names, entries[names[0]]) for names in groups.values()]


def _nested(feature: str, halves: Mapping[str, Schema]) -> Schema:
    """Table of one feature: ``pin1.offset_t`` and ``pin1."offset_[tz]"``."""
    patterns = {}
    for names, schema in _by_schema(halves):
        wild = [half for half in names if _by_pattern(f"{feature}.{half}")]
        if wild:
            patterns[f"^{_wild(wild)}$"] = schema
    return {
        "type": "object",
        "properties": dict(halves),
        **({"patternProperties": patterns} if patterns else {}),
        "additionalProperties": False,
    }


def _by_pattern(name: str) -> bool:
    """Whether a pattern can select the name; some names are selected by their full key only."""
    return bool(select(f"{name.partition('.')[0]}.*", [name]))


def _dotted(names: Iterable[str]) -> str:
    """Regular expression of all keys, quoted names and patterns, that can select one of the names."""
    of: dict[str, list[str]] = {}
    for name in names:
        feature, _, half = name.partition(".")
        of.setdefault(feature, []).append(half)
    alike: dict[tuple[str, ...], list[str]] = {}
    for feature, halves in of.items():
        alike.setdefault(tuple(halves), []).append(feature)
    found = []
    for alike_halves, features in alike.items():
        halves = list(alike_halves)
        left = f"(?:{_exact(features)}|{_wild(features)})"
        if halves == [""]:
            found.append(left)
            continue
        wild = [half for half in halves if _by_pattern(f"{features[0]}.{half}")]
        right = f"(?:{_exact(halves)}|{_wild(wild)})" if wild else f"(?:{_exact(halves)})"
        found.append(rf"{left}\.{right}")
    return "|".join(found)


def _exact(words: Iterable[str]) -> str:
    return "|".join("".join(word) for word in _spelt(words))


def _wild(words: Iterable[str]) -> str:
    spelt = _spelt(words)
    begins = dict.fromkeys("".join(word[:end]) for word in spelt for end in range(len(word) + 1))
    ends = dict.fromkeys("".join(word[begin:]) for word in spelt for begin in range(len(word) + 1))
    return rf"(?:{'|'.join(begins)})[*?\[](?:[^.]*[*?\]])?(?:{'|'.join(ends)})"


def _spelt(words: Iterable[str]) -> list[list[str]]:
    """Words letter by letter, as regular expressions; words that differ in the last letter only become one."""
    last: dict[str, str] = {}
    for word in words:
        last[word[:-1]] = last.get(word[:-1], "") + word[-1:]
    return [
        [*map(re.escape, stem), f"[{letters}]" if len(letters) > 1 else re.escape(letters)]
        for stem, letters in last.items()
    ]
