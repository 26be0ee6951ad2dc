"""First section of the page: the question, and the verdict on each limit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from tolstat.analysis import exceedance as shares
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.blocks import Block, Card, Cards, Panel, Panels, Section, Table, Text
from tolstat.questions.capability import rendering as capability
from tolstat.questions.exceedance import accuracy
from tolstat.questions.exceedance import rendering as exceedance
from tolstat.report.findings import Findings
from tolstat.store import Counts

WORDS = {"yes": "kept", "no": "not kept", "open": "open"}


def section(found: Findings) -> Section:
    """Question, headline, and each limit with its share of joints above it."""
    blocks: list[Block] = [Text(f"Question: {found.question}")] if found.question else []
    if found.sampled and found.campaign.limits:
        table = exceedance.limits(found.campaign)
        judged = [verdict(row, found.accepted) for row in table.to_dict("records")]
        blocks += [Cards([*_headline(found, table), *_basis(found)]), *_limits(found, table, judged)]
    else:
        blocks.append(Cards(_basis(found)))
        if found.sampled:
            remedy = "The study sets no limits: nothing is judged. Its loads are below."
            blocks.append(Text(remedy))
    blocks += [Text(note, small=True) for note in found.notes]
    return Section("verdict", "Verdict", blocks)


def verdict(row: Mapping[Any, Any], accepted: float) -> str:
    """Verdict on a limit: whether the interval `ends` of its share lies below or above the accepted share.

    Parameters
    ----------
    row : mapping
        A row of `exceedance.limits`.
    accepted : float
        Accepted share: share of the joints that may be above the limit; NaN if none is given.

    Returns
    -------
    str
        ``yes`` (below), ``no`` (above), ``open`` (neither, or no interval); empty without an accepted share.
    """
    if np.isnan(accepted):
        return ""
    low, high = ends(row)
    if np.isnan(low):
        return "open"
    return "yes" if high <= accepted else "no" if low > accepted else "open"


def ends(row: Mapping[Any, Any]) -> tuple[float, float]:
    """Interval that covers sampling, unresolved joints and, if known, the numerical error."""
    wide = (row["total_lower"], row["total_upper"])
    return (row["outer_lower"], row["outer_upper"]) if np.isnan(wide[0]) else wide


def _headline(found: Findings, table: pd.DataFrame) -> list[Card]:
    count, cards = len(table), []
    if found.alike:
        together = capability.limits(found.campaign).iloc[-1]
        keep = "its limit" if count == 1 else f"all {count} limits"
        ends_of_yield = text.span(together["good_lower"], together["good_upper"])
        cards.append(
            Card(text.percent(together["good"]), f"of the joints keep {keep} (yield)", f"95 %: {ends_of_yield}")
        )
    first = table[table["load"].isin(found.leading)].sort_values("estimate", ascending=False, kind="stable")
    if first["estimate"].notna().any():
        worst = first.iloc[0]
        label = f"exceed {text.value(worst['level'], worst['unit'])} on {worst['load']}, the limit exceeded most"
        ends_of_share = text.span(worst["outer_lower"], worst["outer_upper"])
        cards.append(Card(text.percent(worst["estimate"]), label, f"95 %: {ends_of_share}"))
    if found.judged:
        all_of_them = [verdict(row, found.accepted) for row in table.to_dict("records")]
        kept = all_of_them.count("yes")
        whole = "no" if "no" in all_of_them else "open" if "open" in all_of_them else "yes"
        label = f"limits kept: at most {text.percent(found.accepted)} of the joints are above"
        words = ", ".join(f"{all_of_them.count(v)} {WORDS[v]}" for v in ("no", "open") if v in all_of_them)
        cards.insert(0, Card(f"{kept} of {count}", label, words or "each with 95 % confidence", whole))
    return cards


def _basis(found: Findings) -> list[Card]:
    campaign = found.campaign
    counts = Counts.of(campaign.results["status"])
    pending = counts.total - counts.done
    note = counts.shortfall + (f", {pending} still pending" if pending else "")
    whole = campaign.count(*VALID) == counts.total
    cards = [Card(str(counts.done), "joints simulated", note, "" if whole else "open")]
    if campaign.verification:
        kinds = {name.rpartition(".")[2] for name in found.leading}
        errors = accuracy.usual(campaign.verification).items()
        usual = {kind: error for kind, error in errors if kind in kinds and not np.isnan(error)}
        if usual:
            kind = max(usual, key=lambda name: usual[name])
            label = f"numerical error of the largest loads ({kind}), relative"
            cards.append(Card(f"{usual[kind]:.1e}", label, accuracy.basis(campaign.verification)))
    return cards


def _limits(found: Findings, table: pd.DataFrame, judged: list[str]) -> list[Block]:
    records = table.to_dict("records")
    unresolved = bool((table["n_failed"] + table["n_unsettled"]).any())
    known = bool(table["numerical_error"].notna().any())
    head = ["load", "limit", "nominal", "above", "share", "95 % interval"]
    head += ["with failed and unsettled"] if unresolved else []
    head += ["with numerical error"] if known else []
    head += ["kept"] if found.judged else []
    rows = []
    for row, answer in zip(records, judged, strict=True):
        cells = [row["load"], text.value(row["level"], row["unit"]), text.value(row["nominal"], row["unit"])]
        cells += [f"{row['count']} of {row['n']}", text.percent(row["estimate"]), text.span(row["lower"], row["upper"])]
        if unresolved:
            kind = "bound" if np.isnan(row["outer_lower"]) else "outer"
            cells.append(text.span(row[f"{kind}_lower"], row[f"{kind}_upper"]))
        cells += [text.span(row["total_lower"], row["total_upper"])] if known else []
        rows.append([*cells, *([WORDS[answer]] if found.judged else [])])
    panel = Panel(
        "forest",
        "Share of the joints above each limit",
        "; ".join(f"{row[0]} above {row[1]}: {row[4]}, 95 % interval {row[5]}" for row in rows),
        lambda ax: _forest(ax, table, found.accepted),
        (4.9, drawing.rows_height(len(table))),
        1.4,
    )
    blocks: list[Block] = [Panels([panel])]
    blocks.append(Table("Limits", head, rows, verdicts=judged if found.judged else ()))
    if "open" in judged and found.campaign.iid and found.alike:
        blocks.append(Text(_open(records, judged, found.accepted)))
    blocks.append(Text(_how(found), small=True))
    return blocks


def _open(records: list[dict[Any, Any]], judged: list[str], accepted: float) -> str:
    """Sentence on the number of joints that would decide each open limit if the shares stayed the same."""
    said = []
    for row, answer in zip(records, judged, strict=True):
        if answer == "open":
            joints = np.inf if np.isnan(row["estimate"]) else shares.needed(row["estimate"], accepted)
            said.append(f"{row['load']} {text.number(joints) if joints < 1e7 else 'more than can be told'}")
    return f"Open limits. Valid joints that would tell, if the shares stay as they are: {', '.join(said)}."


def _how(found: Findings) -> str:
    if not found.campaign.iid:
        return (
            "No intervals: Clopper–Pearson holds for independent samples only; replicates of other seeds tell. "
            "Failed and unsettled joints are counted below and above every limit."
        )
    said = "" if found.alike else "Joints are counted by their weights. "
    said += "Intervals are Clopper–Pearson's, 95 % for each limit by itself; failed and unsettled joints are counted "
    said += "below the limit at the lower end and above it at the upper end."
    if found.judged:
        said += f" A limit is kept when the widest interval lies below {text.percent(found.accepted)}, not kept when it"
        said += " lies above, and open in between: then more joints decide."
    return said


def _forest(ax: Axes, table: pd.DataFrame, accepted: float) -> None:
    """Estimate, interval and outer interval of each limit on an axis of shares."""
    known = table["estimate"][table["estimate"] > 0]
    n = max(int(table["n"].max()), 1)
    floor = 0.5 * min(1.0 / n, known.min() if len(known) else 1.0)
    units = [f"{row['load']} > {text.value(row['level'], row['unit'])}" for row in table.to_dict("records")]
    drawing.rows(ax, units)
    style.share_axis(ax, min(floor, 0.5 * accepted) if accepted > 0 else floor, "x")
    for i, row in enumerate(table.to_dict("records")):
        low, high = ends(row)
        if np.isnan(low):
            low, high = row["bound_lower"], row["bound_upper"]
        ax.plot([max(low, 0.1 * floor), high], [i, i], color=drawing.GREY, lw=5.0, solid_capstyle="butt")
        if not np.isnan(row["lower"]):
            ax.plot([max(row["lower"], 0.1 * floor), row["upper"]], [i, i], color=style.COLOURS[0], lw=2.0)
        if row["estimate"] > 0:
            ax.plot(row["estimate"], i, "o", color=style.COLOURS[0], ms=5.5)
        elif row["estimate"] == 0:
            ax.plot(ax.get_xlim()[0], i, "<", color=style.COLOURS[0], ms=6, clip_on=False)
    if accepted > 0:
        ax.axvline(accepted, color=style.INK, lw=1.4, ls=exceedance.LIMIT_DASH)
        ax.text(accepted, -0.75, f"accepted: {text.percent(accepted)}", ha="center", va="bottom")
    ax.set_xlabel("share of the joints above the limit")
