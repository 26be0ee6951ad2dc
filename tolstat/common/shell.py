"""Words of the commands that messages tell users to type."""

from __future__ import annotations

import os
import re
import shlex


def quote(word: str, windows: bool = os.name == "nt") -> str:
    """Quote a word for the shell; on Windows in double quotes, which both of its shells take."""
    if not windows:
        return shlex.quote(word)
    return word if re.fullmatch(r"[\w.:\\/~+=-]+", word) else '"{}"'.format(word.replace('"', r"\""))
