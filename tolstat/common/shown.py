"""How results look at the Python prompt and in a notebook: one short line, and a table of their fields."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from html import escape
from typing import Any, TypeGuard, TypeVar

import numpy as np

T = TypeVar("T")
MAX_TEXT = 60
"""Number of characters of a text that a short line shows."""
MAX_ITEMS = 4
"""Number of items of a list or array up to which a short line shows them all."""
MAX_ROWS = 12
"""Number of rows of a table that a notebook shows."""


def shown(cls: type[T]) -> type[T]:
    """Class decorator for named tuples and dataclasses: a ``__repr__`` of one line, and a table for notebooks."""
    decorated: Any = cls
    decorated.__repr__, decorated._repr_html_ = _repr, _repr_html
    return cls


def table(title: str, entries: Iterable[tuple[str, object]]) -> str:
    """HTML table of named values, for a notebook; tables among the values are tables inside it."""
    rows = "".join(
        f'<tr><th style="text-align:left;vertical-align:top;white-space:nowrap">{escape(name)}</th>'
        f'<td style="text-align:left">{_html(value)}</td></tr>'
        for name, value in entries
    )
    return f'<table><caption style="text-align:left;white-space:nowrap">{escape(title)}</caption>{rows}</table>'


def short(value: object) -> str:
    """One value in a few characters: numbers with four digits, tables and long lists by their size."""
    if value is None or isinstance(value, bool | int | np.integer | np.bool_):
        return str(value)
    if isinstance(value, float | np.floating):
        return f"{value:.4g}"
    if isinstance(value, str):
        line = value if len(value) <= MAX_TEXT else f"{value[: MAX_TEXT - 3]}..."
        return repr(line)
    if isinstance(value, np.ndarray):
        if value.ndim == 1 and value.size <= MAX_ITEMS and value.dtype.names is None:
            return f"[{', '.join(map(short, value.tolist()))}]"
        return f"<array {' x '.join(map(str, value.shape))}>"
    if _is_frame(value):
        return f"<table {' x '.join(map(str, value.shape))}>"
    if _is_shown(value):
        return repr(value)
    if isinstance(value, Mapping):
        items = [f"{key!r}: {short(item)}" for key, item in value.items()]
        return f"{{{', '.join(items)}}}" if len(items) <= MAX_ITEMS else f"<{len(items)} entries>"
    if isinstance(value, list | tuple) and not hasattr(value, "_fields"):
        if value and all(_is_shown(item) for item in value):
            return f"<{len(value)} {type(value[0]).__name__}>"
        return f"[{', '.join(map(short, value))}]" if len(value) <= MAX_ITEMS else f"<{len(value)} items>"
    text = repr(value)
    return text if len(text) <= MAX_TEXT else f"<{type(value).__name__}>"


def _is_frame(value: Any) -> TypeGuard[Any]:
    """Whether a value is a table of pandas, which need not be imported for that."""
    return hasattr(value, "to_html") or (hasattr(value, "to_frame") and hasattr(value, "shape"))


def _is_shown(value: Any) -> bool:
    return type(value).__dict__.get("__repr__") is _repr


def _entries(result: Any) -> list[tuple[str, object]]:
    names = [field.name for field in fields(result)] if is_dataclass(result) else result._fields
    return [(name, getattr(result, name)) for name in names]


def _repr(result: object) -> str:
    return f"{type(result).__name__}({', '.join(f'{name}={short(value)}' for name, value in _entries(result))})"


def _repr_html(result: object) -> str:
    return table(type(result).__name__, _entries(result))


def _html(value: Any) -> str:
    if _is_frame(value):
        frame = value if hasattr(value, "to_html") else value.to_frame()
        return str(frame.to_html(max_rows=MAX_ROWS, border=0))
    if _is_shown(value):
        return _repr_html(value)
    if isinstance(value, str):
        text = escape(value)
        return f'<pre style="margin:0;white-space:pre-wrap">{text}</pre>' if "\n" in value else text
    return escape(short(value))
