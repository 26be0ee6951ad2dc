"""Characters that cannot be seen, shown by their code."""

from __future__ import annotations

import re

_UNSEEN = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb\ud800-\udfff"
    "\U000e0000-\U000e007f]"
)
"""Control characters but those that end lines, marks and overrides of the direction of text, tags, surrogates."""


def visible(words: str) -> str:
    """Show characters that cannot be seen or change the direction of text by their code, ``[U+202E]``."""
    return _UNSEEN.sub(lambda character: f"[U+{ord(character[0]):04X}]", words)
