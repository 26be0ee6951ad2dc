"""The tables of docs/result_format.md, docs/model.md and docs/study.md, and the page of the present schema.

They are made from `tolstat.common.tables`, `tolstat.joint.contact` the layout in `tolstat.store`
and the input models (`study_reference`).
``python -m tests.format_tables`` brings the documents up to date; a test compares.
"""

from __future__ import annotations

import re
from pathlib import Path

from tests import study_reference
from tests.study_reference import WHOLE
from tolstat.common import tables
from tolstat.common.cardan import CARDAN
from tolstat.common.columns import (
    DESIGN_COLUMNS,
    LEDGER_COLUMNS,
    Column,
    drawn_columns,
    error_columns,
    result_columns,
)
from tolstat.joint.derived import DERIVED
from tolstat.store import layout
from tolstat.store.layout import SESSION

DOCS = Path(__file__).parent.parent / "docs"
FORMAT, MODEL, STUDY = DOCS / "result_format.md", DOCS / "model.md", DOCS / "study.md"
SCHEMA = DOCS / "schemas" / "schema.md"
PAGE = """# Columns of a result file of schema {version}

Datasets of the groups `/errors` and `/results`; what they are about is in [the result file](../result_format.md).
Of faces, bearings of shafts, losses and unbalance a file has those that its joint has.

## `/errors`

{errors}

## `/results`

{results}
"""


def field_table(columns: tuple[Column, ...]) -> str:
    """Markdown table of datasets, the columns of one field in one line."""
    lines = ["| dataset | unit | type | meaning |", "|---|---|---|---|"]
    for name in dict.fromkeys(c.field for c in columns):
        group = [c for c in columns if c.field == name]
        datasets = ", ".join(f"`{c.name}`" for c in group)
        lines.append(f"| {datasets} | {group[0].unit} | {group[0].dtype} | {group[0].description} |")
    return "\n".join(lines)


def session_table() -> str:
    """Markdown table of the group of the run under way."""
    lines = ["| dataset | unit | type | meaning |", "|---|---|---|---|"]
    return "\n".join(lines + [f"| `{n}` | {unit} | {dtype} | {text} |" for n, (dtype, unit, text) in SESSION.items()])


def axis_table() -> str:
    """Markdown table of the axes of histories."""
    lines = ["| axis | values | unit | meaning |", "|---|---|---|---|"]
    for name, (values, text) in layout.axes_of(CARDAN).items():
        held = [f"`{value}`" for value in values]
        told = held if len(held) <= 8 else [*held[:2], "...", held[-1]]
        lines.append(f"| `{name}` | {', '.join(told)} | 1 | {text} |")
    for name, values in {"theta": "2 pi k / steps_per_rev", "harmonic": "0, 1, 2, ..."}.items():
        _, unit, text = layout.scale_of(name, 4, CARDAN)
        lines.append(f"| `{name}` | {values} | {unit} | {text} |")
    return "\n".join(lines)


def status_table() -> str:
    """Markdown table of the values of ``status``."""
    lines = ["| status | name | meaning |", "|---|---|---|"]
    return "\n".join(lines + [f"| {s.value} | `{s.label}` | {tables.STATUS_TEXT[s]} |" for s in tables.Status])


def derived_table() -> str:
    """Markdown table of the keys of a joint that follow from others."""
    lines = ["| key | follows from | formula |", "|---|---|---|"]
    for key, rule in DERIVED.items():
        section = key.partition(".")[0]
        sources = ", ".join(f"`{of.removeprefix(f'{section}.')}`" for of in rule.follows)
        lines.append(f"| `{key}` | {sources} | {rule.formula} |")
    return "\n".join(lines)


def updated(text: str, content: dict[str, str]) -> str:
    """`text` of a document with its tables made anew; each is between a comment with its name and one of its end."""
    for name, table in content.items():
        pattern = rf"(<!-- table: {name} -->\n).*?(<!-- end -->)"
        text, n = re.subn(pattern, lambda m, table=table: m[1] + table + "\n" + m[2], text, flags=re.DOTALL)
        assert n == 1, name
    return text


def documents() -> dict[Path, str]:
    """Up-to-date text of each document."""
    origin = drawn_columns({"method": "subset"})
    parts = {"design": DESIGN_COLUMNS, "ledger": LEDGER_COLUMNS, "origin subset": origin}
    content = {name: field_table(columns) for name, columns in parts.items()}
    content |= {"status": status_table(), "session": session_table(), "axes": axis_table()}
    page = {"errors": field_table(error_columns(WHOLE)), "results": field_table(result_columns(WHOLE))}
    return {
        FORMAT: updated(FORMAT.read_text(encoding="utf-8"), content),
        MODEL: updated(MODEL.read_text(encoding="utf-8"), {"derived": derived_table()}),
        STUDY: updated(STUDY.read_text(encoding="utf-8"), study_reference.tables()),
        SCHEMA: PAGE.format(version=tables.SCHEMA_VERSION, **page),
    }


if __name__ == "__main__":
    for path, text in documents().items():
        path.write_text(text, encoding="utf-8", newline="\n")
