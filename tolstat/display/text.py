"""Tables as aligned text, for standard output."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tolstat.common.files import atomic_write

if TYPE_CHECKING:
    import pandas as pd

UNITS = {"N*m": "N m", "1": ""}


def limits(table: pd.DataFrame) -> str:
    """Text of `exceedance.limits`: the share of joints above each limit.

    Parameters
    ----------
    table : DataFrame
        As `exceedance.limits` returns it.

    Returns
    -------
    str
        One line per limit. If joints failed or did not settle, a further column gives the share with all of them
        counted below, then above the limit (for independent samples with the interval). If the numerical error is
        known, two more columns give the share with every load shifted by it down and up, and the range that covers
        numerical error, unresolved joints and sampling.
    """
    unresolved = bool((table["n_failed"] + table["n_unsettled"]).any())
    rows = [["load", "nominal", "limit", "joints", "above", "share", "95 % interval"]]
    rows[0] += ["with unresolved joints"] if unresolved else []
    verified = bool(table["numerical_error"].notna().any())
    rows[0] += ["with numerical error", "total interval"] if verified else []
    for row in table.to_dict("records"):
        line = [row["load"], value(row["nominal"], row["unit"]), value(row["level"], row["unit"])]
        line += [str(row["n"]), str(row["count"]), percent(row["estimate"])]
        line.append(span(row["lower"], row["upper"]))
        if unresolved:
            iid = not math.isnan(row["outer_lower"])
            ends = ("outer_lower", "outer_upper") if iid else ("bound_lower", "bound_upper")
            line.append(span(row[ends[0]], row[ends[1]]))
        if verified:
            line.append(span(row["numerical_lower"], row["numerical_upper"]))
            line.append(span(row["total_lower"], row["total_upper"]))
        rows.append(line)
    return align(rows)


def quantiles(table: pd.DataFrame) -> str:
    """Text of `exceedance.quantiles`: one line per load, one column per share.

    Returns
    -------
    str
        The interval is that of the highest share; ``inf`` if there are too few joints for its upper end.
    """
    shares = sorted(table["share"].unique())
    heads = [f"{100.0 * share:g} %" for share in shares]
    rows = [["load", "nominal", *heads, f"95 % interval of {heads[-1]}"]]
    for name, part in table.groupby("load", sort=False):
        lines = part.sort_values("share").to_dict("records")
        last, unit = lines[-1], lines[-1]["unit"]
        interval = "-" if math.isnan(last["lower"]) else f"{last['lower']:.4g} .. {value(last['upper'], unit)}"
        rows.append(
            [
                str(name),
                value(last["nominal"], unit),
                *(value(q["estimate"], unit) for q in lines),
                interval,
            ]
        )
    return align(rows)


def accuracy(table: pd.DataFrame) -> str:
    """Text of `accuracy.distribution`: one line per kind of load and check."""
    rows = [["load", "error", "joints", "median", "95 % below", "worst"]]
    for row in table.itertuples(index=False):
        rows.append([str(row.load), str(row.error), str(row.joints), *(_small(x) for x in row[3:])])
    return align(rows)


def plain(table: pd.DataFrame) -> str:
    """Text of any frame, numbers to five digits, headed by its columns."""
    rows = [[str(column) for column in table.columns]]
    for line in table.itertuples(index=False):
        rows.append([("-" if math.isnan(x) else f"{x:.5g}") if isinstance(x, float) else str(x) for x in line])
    return align(rows)


def records(table: pd.DataFrame) -> list[dict[str, Any]]:
    """Rows of a frame for JSON; NaN and infinity, which JSON lacks, become None."""

    def plain_number(x: Any) -> Any:
        x = x.item() if hasattr(x, "item") else x
        return None if isinstance(x, float) and not math.isfinite(x) else x

    return [{str(k): plain_number(v) for k, v in row.items()} for row in table.to_dict("records")]


def csv(table: pd.DataFrame, stem: Path, what: str) -> Path:
    """Write a frame as ``STEM_what.csv``; return its path."""
    path = stem.with_name(f"{stem.name}_{what}.csv")
    with atomic_write(path) as temporary:
        table.to_csv(temporary, index=False, encoding="utf-8", lineterminator="\n")
    return path


def align(rows: list[list[str]], text_last: bool = False) -> str:
    """Align rows of text in columns: the first to the left, the others to the right; with `text_last` the last left."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True)]
        if text_last:
            cells[-1] = row[-1]
        lines.append("  ".join([row[0].ljust(widths[0]), *cells]).rstrip())
    return "\n".join(lines)


def value(x: float, unit: str) -> str:
    """Format a load with its unit, four digits; NaN gives a dash."""
    return f"{number(x)} {UNITS.get(unit, unit)}".strip() if not math.isnan(x) else "-"


def number(x: float) -> str:
    """Format to four digits; numbers below 1e7 have no positive exponent: ``13030``, not ``1.303e+04``."""
    short = f"{x:.4g}"
    return f"{float(short):.0f}" if "e+" in short and abs(x) < 1e7 else short


def span_of(low: float, high: float, unit: str) -> str:
    """Format an interval of loads with its unit; NaN gives a dash."""
    if math.isnan(low):
        return "-"
    return f"{number(low)} .. {'needs more joints' if math.isinf(high) else value(high, unit)}"


def sentence(words: str) -> str:
    """Make words a sentence: capital letter (unless the first word has a digit, as names of loads) and full stop."""
    first = words.partition(" ")[0]
    return (words if any(letter.isdigit() for letter in first) else words[:1].upper() + words[1:]) + "."


def _small(x: float) -> str:
    return "-" if math.isnan(x) else f"{x:.1e}"


def percent(share: float) -> str:
    """Format a share in per cent, three digits; NaN gives a dash."""
    return "-" if math.isnan(share) else f"{100.0 * share:.3g} %"


def span(low: float, high: float) -> str:
    """Format an interval of shares in per cent; NaN gives a dash."""
    return "-" if math.isnan(low) else f"{100.0 * low:.3g} .. {percent(high)}"
