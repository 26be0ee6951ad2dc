"""Exceedance on the page: curves with all their bands, the reader, quantiles and rare loads."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from tolstat.analysis import exceedance as shares
from tolstat.display import drawing, style, text
from tolstat.display.blocks import Block, Panel, Panels, Reader, Section, Table, Text
from tolstat.questions.capability import rendering as capability
from tolstat.questions.exceedance import rendering as exceedance
from tolstat.report.findings import Findings
from tolstat.store.view import Campaign, load
from tolstat.store.view import ends as intervals

STEPS = 240
"""Approximate number of levels at which the reader tool has values; the levels are round numbers."""
ONE_IN = (1e3, 1e4, 1e5)
TOLERANCE = 0.99
"""Share of the joints that the tolerance limit covers."""
GROUPS = [(group, letter) for group in ("cross", "fork") for letter in "FT"]


def section(found: Findings) -> Section:
    """Exceedance of every load."""
    campaign = found.campaign
    blocks: list[Block] = [Panels([_single(campaign, name) for name in found.leading])] if found.leading else []
    if campaign.listed:
        blocks.append(Reader(readings(campaign)))
    panels = [
        Panel(
            f"curves-{group}-{letter}",
            f"{group.capitalize()} bushings, {'force' if letter == 'F' else 'torque'}",
            _described(campaign, [f"{group}{i}.{letter}" for i in (1, 2, 3, 4)]),
            partial(_group, campaign=campaign, group=group, letter=letter),
            (4.9, 3.7),
            reads=tuple(name for i in (1, 2, 3, 4) if (name := f"{group}{i}.{letter}") in campaign.drawn),
        )
        for group, letter in GROUPS
        if any(f"{group}{i}.{letter}" in campaign.drawn for i in (1, 2, 3, 4))
    ]
    blocks += [Panels(panels)] if panels else []
    blocks.append(Text(_note(campaign), small=True))
    blocks.append(_quantiles(campaign))
    blocks += _rare(found) if found.alike else []
    return Section("exceedance", "Which load is exceeded by which share", blocks)


def _note(campaign: Campaign) -> str:
    said = text.sentence(exceedance.note(campaign))
    if campaign.iid:
        said += " Triangles: the joint without errors. Dotted: upper end where no joint exceeds x."
    missing = campaign.missing()
    return f"{said} {text.sentence(missing)}" if missing else said


def _described(campaign: Campaign, names: list[str]) -> str:
    said = []
    for name in names:
        if name in campaign.drawn:
            values, unit = load(campaign.results, name)
            ends = [campaign.quantile(values, s, 0.95).estimate for s in (0.5, 0.99)]
            half, few = (text.value(end, unit) for end in ends)
            said.append(f"{name}: half of the joints exceed {half}, 1 % {few}")
    return "; ".join(said)


def _group(ax: Axes, campaign: Campaign, group: str, letter: str) -> None:
    exceedance.panel(ax, campaign, group, letter)
    handles = [Line2D([], [], color=c, ls=d) for c, d in zip(style.COLOURS, style.DASHES, strict=True)]
    labels = [f"{group}{i}" for i in (1, 2, 3, 4)]
    ax.set_ylabel("share of joints above x")
    if ax.get_yscale() == "log":
        ax.legend(handles, labels, loc="upper right", handlelength=2.6)


def _single(campaign: Campaign, name: str) -> Panel:
    return Panel(
        f"bands-{name.replace('.', '-')}",
        f"{name}: exceedance with all of its bands",
        _described(campaign, [name]) or f"share of the joints above each value of {name}",
        partial(_bands, campaign=campaign, name=name),
        (4.9, 3.7),
        reads=(name,),
    )


def _bands(ax: Axes, campaign: Campaign, name: str) -> None:
    """One load: pointwise and simultaneous band, bounds of the unresolved joints, limit and nominal joint."""
    table, unit = exceedance.curve(campaign, name, 0.95, exceedance.DRAWN_LEVELS)
    if not len(table):
        drawing.empty(ax, "no joint with a valid result")
        return
    limit = campaign.limits.get(name)
    low, high = exceedance.axis_range(table["level"], [] if limit is None else [limit])
    n, floor = int(table["n"][0]), 0.5 * exceedance.least(campaign, table)
    valid = n - int(table["n_failed"][0] + table["n_unsettled"][0])
    ax.set_xlim(low, high)
    style.share_axis(ax, floor)
    exceedance.steps(ax, table, 0, low, floor)
    handles: list[Any] = [Line2D([], [], color=style.COLOURS[0])]
    labels = ["joints above x"]
    if campaign.iid and campaign.weights is None:
        x = np.concatenate([[low], table["level"][1:]])
        half = shares.simultaneous(valid)
        for end in (table["bound_upper"] + half, table["bound_lower"] - half):
            ax.step(x, np.clip(end, 1e-3 * floor, 1.0), where="post", color=style.INK, lw=0.9, ls=(0.0, (4.0, 2.0)))
        handles.append(Line2D([], [], color=style.INK, lw=0.9, ls="--"))
        labels.append("95 % for all x at once (DKW)")
    if campaign.iid:
        handles.insert(1, Patch(color=style.COLOURS[0], alpha=0.25, lw=0))
        labels.insert(1, "95 % at each x (Clopper–Pearson)")
    if valid < n:
        handles.append(Patch(color=style.COLOURS[0], alpha=0.12, lw=0))
        labels.append("with failed and unsettled joints")
    if limit is not None:
        exceedance.limit_lines(ax, {limit: [1, 2, 3, 4]}, text.UNITS.get(unit, unit))
    nominal = exceedance.nominal(campaign, name)
    if low <= nominal <= high:
        style.mark(ax, nominal, 1.0, style.COLOURS[0])
    ax.legend(handles, labels, loc="upper right")
    ax.xaxis.set_major_locator(MaxNLocator(5 if unit != "1" else 3))
    ax.set_xlabel(f"x: {name} [{text.UNITS.get(unit, unit) or '1'}], largest over the revolution")
    ax.set_ylabel("share of joints above x")


def readings(campaign: Campaign) -> dict[str, Any]:
    """Exceedance of every load at round levels, for the reader tool: exact there, not interpolated between them.

    Returns
    -------
    dict
        By load: ``unit``; ``n``, ``failed``, ``unsettled``; ``start``, index of the level shown first (nearest to the
        limit or, without one, to the 90 % quantile); lists of equal length ``x``, ``count``, ``share`` and, for
        independent samples, ``lower``, ``upper``, ``outer_lower``, ``outer_upper``, otherwise ``bound_lower``,
        ``bound_upper``.
    """
    found = {}
    for name in campaign.listed:
        values, unit = load(campaign.results, name)
        status = campaign.results["status"]
        valid = shares.sort_out(values, status).valid
        if not valid.size:
            continue
        limit = campaign.limits.get(name)
        x = _round_loads(float(valid[0]), float(valid[-1]), limit)
        start = limit if limit is not None else campaign.quantile(values, 0.9, 0.95).estimate
        table = campaign.curve(values, x, 0.95, intervals(campaign.results, name))
        ends = ("lower", "upper", "outer_lower", "outer_upper") if campaign.iid else ("bound_lower", "bound_upper")
        found[name] = {
            "unit": text.UNITS.get(unit, unit),
            "n": int(table["n"][0]),
            "failed": int(table["n_failed"][0]),
            "unsettled": int(table["n_unsettled"][0]),
            "start": int(np.argmin(np.abs(x - start))),
            "x": [float(f"{v:.9g}") for v in x],
            "count": table["count"].tolist(),
            "share": [float(f"{v:.3g}") for v in table["estimate"]],
            **{end: [float(f"{v:.3g}") for v in table[end]] for end in ends},
        }
    return found


def _round_loads(low: float, high: float, limit: float | None) -> np.ndarray[Any, np.dtype[np.float64]]:
    low, high = (low, high) if limit is None else (min(low, limit), max(high, limit))
    raw = max(high - low, 1e-3 * abs(high), 1e-12) / STEPS
    power = 10.0 ** np.floor(np.log10(raw))
    step = power * next(m for m in (1, 2, 5, 10) if m * power >= raw)
    marks = step * np.arange(np.floor(low / step), np.ceil(high / step) + 1)
    return np.unique(marks if limit is None else np.append(marks, limit))


def _quantiles(campaign: Campaign) -> Table:
    """Quantiles of every load with their intervals, and its tolerance limit."""
    table = exceedance.quantiles(campaign)
    rows = []
    for name, part in table.groupby("load", sort=False):
        unit = str(part["unit"].iloc[0])
        cells = [str(name), text.value(float(part["nominal"].iloc[0]), unit)]
        for row in part.to_dict("records"):
            own = text.value(row["estimate"], unit)
            ends = "" if np.isnan(row["lower"]) else f" ({text.number(row['lower'])} .. {text.number(row['upper'])})"
            cells.append(own + ends)
        values, _ = load(campaign.results, str(name))
        upper = campaign.quantile(values, TOLERANCE, 0.9).upper
        cells.append("needs more joints" if np.isinf(upper) else text.value(upper, unit))
        rows.append(cells)
    head = ["load", "nominal", *(f"{100 * s:g} % stay below" for s in exceedance.SHARES)]
    head.append(f"tolerance limit {100 * TOLERANCE:g} % / 95 %")
    title = "Quantiles with 95 % intervals of order statistics, and one-sided tolerance limits (Wilks)"
    return Table(title if campaign.iid else "Quantiles", head, rows)


def _rare(found: Findings) -> list[Block]:
    campaign = found.campaign
    rows, said = [], dict[str, list[str]]()
    for name in found.leading:
        try:
            table = capability.returns(campaign, [name], ONE_IN)
        except ValueError as error:
            said.setdefault(str(error), []).append(name)
            continue
        rows += [_rare_row(row) for row in table.to_dict("records")]
        if (table["p"] < 0.05).any():
            said.setdefault("the tail is not generalised Pareto (p < 0.05): do not extrapolate it", []).append(name)
    blocks: list[Block] = []
    if rows:
        head = ["load", "one joint in", "exceeds", "95 % interval", "median of the largest of so many", "fit, p"]
        blocks.append(Table("Rare loads, from a generalised Pareto tail", head, rows))
    if said:
        words = [f"{', '.join(names)}: {found}" for found, names in said.items()]
        blocks.append(Text(f"Rare loads. {'; '.join(words)}.", small=True))
    return blocks


def _rare_row(row: dict[Any, Any]) -> list[str]:
    unit = row["unit"]
    ends = text.span_of(row["lower"], row["upper"], unit)
    cells = [row["load"], f"{row['one_in']:,.0f}".replace(",", " "), text.value(row["estimate"], unit), ends]
    return [*cells, text.value(row["fleet"], unit), f"{row['p']:.2g}"]


def capability_section(found: Findings) -> Section:
    """Yield, ppm and Cpk against each limit and all together."""
    table = capability.limits(found.campaign)
    rows = []
    for row in table.to_dict("records"):
        cells = [row["load"], text.value(row["limit"], row["unit"])]
        cells += [text.percent(row["good"]), text.span(row["good_lower"], row["good_upper"])]
        cells += [text.number(row["ppm"]), text.span_of(row["ppm_lower"], row["ppm_upper"], "1")]
        cells += _with_ends(row, "cpk", ".2f")
        rows.append([*cells, "-" if np.isnan(row["cpk_normal"]) else f"{row['cpk_normal']:.2f}"])
    head = ["load", "limit", "yield", "95 % interval", "ppm", "95 % interval", "Cpk", "95 % interval", "Cpk if normal"]
    notes = [Text(text.sentence(line), small=True) for line in capability.note(table).splitlines()]
    title = "Against each limit, and all of them together"
    return Section("capability", "Capability", [Table(title, head, rows), *notes])


def _with_ends(row: dict[Any, Any], key: str, form: str) -> list[str]:
    own, low, high = row[key], row[f"{key}_lower"], row[f"{key}_upper"]
    value = "-" if np.isnan(own) else f"{own:{form}}"
    return [value, "-" if np.isnan(low) else f"{low:{form}} .. {high:{form}}"]
