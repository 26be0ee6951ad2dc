"""JSON and CSV as short readable text with numbers of nine digits, and the comparison of such text."""

from __future__ import annotations

import csv
import json
import math
import re
from io import StringIO
from typing import Any

DIGITS = 9
CLOSE, ROUGH = ", numbers", ", rough numbers"
"""At the end of the head of a block whose numbers are compared with a tolerance."""
TOLERANCES = {CLOSE: (1e-6, 1e-12), ROUGH: (0.1, 2e-6)}
"""Relative and absolute: processors differ in the last bits of a result, which differences amplify: numerical errors of
1e-6 by half. Numbers are told with two digits: 1.65e-5 by 6 % apart."""
LINE, LONG = 110, 200
"""Longest line of a list or table, characters; most lines of a document."""
FEW, HEAD = 24, 2
"""Longest list, or table, that is shown whole; numbers shown of a longer one."""
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.]*\w)|(?<!\w)-?(?:nan|inf)(?!\w)", re.IGNORECASE)


def short(value: float) -> str:
    """A number with `DIGITS` digits; integers as they are, other whole numbers with ``.0``."""
    if isinstance(value, int):
        return str(value)
    text = f"{value:.{DIGITS}g}"
    return text if not text.lstrip("-").isdigit() else text + ".0"


def json_text(text: str) -> str:
    """JSON as text: what is short on one line, records of plain values as tables, long lists as head and summary."""
    lines = _json(json.loads(text), "").split("\n")
    more = [f"... {len(lines) - LONG} more lines"] if len(lines) > LONG else []
    return "\n".join(lines[:LONG] + more)


def _json(value: Any, indent: str) -> str:
    if isinstance(value, list) and len(value) > FEW and all(isinstance(x, int | float) for x in value):
        return summary(value)
    if isinstance(value, dict | list) and value:
        line = _one_line(value)
        if len(indent) + len(line) <= LINE:
            return line
        inner = indent + " "
        if isinstance(value, dict):
            rows = [f"{inner}{json.dumps(key)}: {_json(item, inner)}" for key, item in value.items()]
        elif all(isinstance(item, int | float) for item in value):
            return line
        elif _is_table(value):
            rows = [inner + _one_line(list(row)) for row in (value[0].keys(), *(item.values() for item in value))]
        else:
            rows = [inner + _json(item, inner) for item in value]
        begin, end = "{}" if isinstance(value, dict) else "[]"
        return "\n".join([begin, *(f"{row}," for row in rows[:-1]), rows[-1], indent + end])
    return _one_line(value)


def _is_table(rows: list[Any]) -> bool:
    """Whether these are several records of the same plain values."""
    return len(rows) > 2 and all(
        isinstance(row, dict)
        and list(row) == list(rows[0])
        and not any(isinstance(cell, dict | list) for cell in row.values())
        for row in rows
    )


def _one_line(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)}: {_one_line(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_one_line, value)) + "]"
    if isinstance(value, float):
        return short(value)
    return json.dumps(value, ensure_ascii=False)


def summary(values: list[Any]) -> str:
    """First numbers of many, how many there are, and mean, least and largest."""
    if all(value == values[0] for value in values):
        return f"{short(values[0])} x {len(values)}"
    known = [float(x) for x in values if math.isfinite(x)]
    first = ", ".join(short(x) for x in values[:HEAD])
    other = f", {len(values) - len(known)} not finite" if len(known) < len(values) else ""
    if not known:
        return f"[{first}, ...; {len(values)} numbers{other}]"
    mean = math.fsum(known) / len(known)
    return f"[{first}, ...; {len(values)}{other}: mean {short(mean)}, {short(min(known))} .. {short(max(known))}]"


def csv_text(text: str) -> str:
    """A short table of few columns as it is; another with one line a column: name, first values, summary."""
    rows = list(csv.reader(StringIO(text)))
    if len(rows) <= FEW and max(map(len, rows), default=0) <= FEW:
        return "\n".join(",".join(_cell(cell) for cell in row) for row in rows)
    head, *body = rows
    units = body.pop(0) if len(body) > 1 and _are_units(*body[:2]) else [""] * len(head)
    lines = [f"{len(body)} rows of {len(head)} columns"]
    for index, name in enumerate(head):
        cells = [row[index] if index < len(row) else "missing" for row in body]
        unit = f" [{units[index]}]" if units[index] else ""
        lines.append(f"{name}{unit}: {_column(cells)}")
    return "\n".join(lines)


def _are_units(row: list[str], values: list[str]) -> bool:
    """Whether a row has units above values: words or nothing above numbers, and no number but 1."""
    above = [unit for unit, value in zip(row, values, strict=False) if _number(value) is not None]
    return any(_number(unit) is None for unit in above) and {"1"} >= {x for x in row if _number(x) is not None}


def _cell(cell: str) -> str:
    number = _number(cell)
    return cell if number is None else short(number)


def _number(cell: str) -> float | int | None:
    try:
        return int(cell) if re.fullmatch(r"-?\d+", cell) else float(cell)
    except ValueError:
        return None


def _column(cells: list[str]) -> str:
    known = [number for number in map(_number, cells) if number is not None]
    if len(known) + cells.count("") < len(cells) or not known:
        counts = {word: cells.count(word) for word in sorted(set(cells))}
        shown = [f"{word or 'empty'} {count}" for word, count in list(counts.items())[:FEW]]
        return ", ".join([*shown, *(["..."] if len(counts) > FEW else [])])
    return summary(known) + (f", {cells.count('')} empty" if "" in cells else "")


def without_numbers(text: str) -> str:
    """Text with a sign in place of each number, and one blank in place of several."""
    return re.sub(r" {2,}", " ", NUMBER.sub("#", text))


def same_line(expected: str, actual: str, how: str = CLOSE) -> bool:
    """Whether two lines have the same words, and numbers that agree within the tolerances; integers exactly."""
    if expected == actual:
        return True
    if without_numbers(expected) != without_numbers(actual):
        return False
    pairs = zip(NUMBER.findall(expected), NUMBER.findall(actual), strict=True)
    return all(_same_number(one, other, *TOLERANCES[how]) for one, other in pairs)


def _same_number(one: str, other: str, relative: float, absolute: float) -> bool:
    if one == other:
        return True
    if re.fullmatch(r"-?\d+", one) and re.fullmatch(r"-?\d+", other):
        return False
    return math.isclose(float(one), float(other), rel_tol=relative, abs_tol=absolute)
