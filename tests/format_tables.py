"""The field tables of docs/result_format.md, made from `tolstat.common.tables`.

``python -m tests.format_tables`` brings the document up to date; a test compares the two.
"""

from __future__ import annotations

import re
from pathlib import Path

from tolstat.common import draw_records, tables
from tolstat.common.columns import DESIGN_COLUMNS, ERROR_COLUMNS, LEDGER_COLUMNS, RESULT_COLUMNS, Column

DOCUMENT = Path(__file__).parent.parent / "docs" / "result_format.md"


def field_table(columns: tuple[Column, ...]) -> str:
    """Markdown table of datasets, the columns of one field in one line."""
    lines = ["| dataset | unit | type | meaning |", "|---|---|---|---|"]
    for name in dict.fromkeys(c.field for c in columns):
        group = [c for c in columns if c.field == name]
        datasets = ", ".join(f"`{c.name}`" for c in group)
        lines.append(f"| {datasets} | {group[0].unit} | {group[0].dtype} | {group[0].description} |")
    return "\n".join(lines)


def status_table() -> str:
    """Markdown table of the values of ``status``."""
    lines = ["| status | name | meaning |", "|---|---|---|"]
    return "\n".join(lines + [f"| {s.value} | `{s.label}` | {tables.STATUS_TEXT[s]} |" for s in tables.Status])


def motion_table() -> str:
    """Markdown table of the values of ``motion``."""
    lines = ["| motion | name | meaning |", "|---|---|---|"]
    return "\n".join(lines + [f"| {m.value} | `{m.label}` | {tables.MOTION_TEXT[m]} |" for m in tables.Motion])


def updated(text: str) -> str:
    """`text` of the document with its tables made anew."""
    content = {
        "design": field_table(DESIGN_COLUMNS),
        **{f"origin {method}": field_table(draw_records.columns({"method": method})) for method in draw_records.FIELDS},
        "errors": field_table(ERROR_COLUMNS),
        "results": field_table(RESULT_COLUMNS),
        "ledger": field_table(LEDGER_COLUMNS),
        "status": status_table(),
        "motion": motion_table(),
    }
    for name, table in content.items():
        pattern = rf"(<!-- table: {name} -->\n).*?(<!-- end -->)"
        text = re.sub(pattern, lambda m, table=table: m[1] + table + "\n" + m[2], text, flags=re.DOTALL)
    return text


if __name__ == "__main__":
    DOCUMENT.write_text(updated(DOCUMENT.read_text(encoding="utf-8")), encoding="utf-8")
