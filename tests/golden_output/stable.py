"""What of an output depends on machine, time and versions, and nothing else: each pattern here hides one such thing."""

from __future__ import annotations

import re

PATTERNS: tuple[tuple[str, str], ...] = (
    (r"^compil(?:ing|ed)\b.*\n", ""),
    (r"^(?:[^\n:]+: )?\d+ of \d+ (?:joint|shaft|mechanism)s, (?:[^\n]* left, )?\d+ failed, \d+ not settled\n", ""),
    (r"^[a-z ]+, (?:\d+:)?\d+:\d\d\n", ""),
    (r"\babout (?:\d+:)?\d+:\d\d on \d+\s+process(?:es)?", "about TIME on N processes"),
    (r"^(simulated \d+ (?:joint|shaft|mechanism)s) in \d+ s", r"\1 in TIME"),
    (r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?:\.\d+)?(?:\+00:00|Z)?", "DATE"),
    (r"\b(tolstat|python|numpy|numba|scipy|h5py) \d+\.\d+\S*?(?=[\s,;:]|$)", r"\1 VERSION"),
    (r'"(tolstat|python|numpy|numba|scipy|h5py)": "\d+\.\d+[^"]*"', r'"\1": "VERSION"'),
    (r"(?<![\w.])[0-9a-f]{16,64}(?:-dirty)?\b", "HASH"),
    (r"^time a (joint|shaft|mechanism): .*$", r"time a \1: TIME"),
    (r"^time: about .* on \d+ cores?", "time: about TIME on N cores"),
    (r"^  (start|joints|shafts|mechanisms|check|report): (?:less than )?[\d.]+ (?:s|min|h)$", r"  \1: TIME"),
    (r"^memory: .*$", "memory: SIZE"),
    (
        r"^.*\d of \d+ (?:joint|shaft|mechanism)s, (?:[^\n]*\n    )?"
        r"[^\n]*(?:joint|shaft|mechanism)s/s,[^\n]*(?:\n    [^\n]*)?\n",
        "",
    ),
    (r"^( *\"?wall_s\"?): [\d.e+-]+", r"\1: TIME"),
)
"""Regular expressions of lines, and what stands in their place."""


def stable(text: str, places: dict[str, str]) -> str:
    """Text without what depends on machine, time and versions; `places` are folders with the words shown for them."""
    for folder, word in places.items():
        text = text.replace(folder, word)
    text = text.strip("\n") + "\n"
    for pattern, word in PATTERNS:
        text = re.sub(pattern, word, text, flags=re.MULTILINE)
    return "\n".join(line.rstrip() for line in text.strip("\n").split("\n"))
