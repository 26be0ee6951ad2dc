"""Sections of the page on numerical against statistical error, fatigue, swept values and provenance."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from tolstat.display import text
from tolstat.display.blocks import Block, Facts, Listing, Panel, Panels, Section, Table, Text
from tolstat.questions.exceedance import accuracy, sweep
from tolstat.questions.exceedance import rendering as exceedance
from tolstat.questions.fatigue import rendering as fatigue
from tolstat.report.findings import Findings
from tolstat.store.verification import Verification

if TYPE_CHECKING:
    from tolstat.questions.fatigue.query import Loading


def accuracy_section(found: Findings, verification: Verification) -> Section:
    """Numerical error of the loads, compared with the statistical error of the shares."""
    table = accuracy.distribution(verification)
    head = ["load", "error", "joints", "median", "95 % below", "worst"]
    cells = [[row[0], row[1], str(row[2]), *(_small(x) for x in row[3:])] for row in table.itertuples(index=False)]
    title = "Relative to the largest load of its kind in the joint"
    blocks: list[Block] = [Text(text.sentence(accuracy.note(verification)))]
    if found.campaign.limits and found.sampled:
        blocks.append(_budget(exceedance.limits(found.campaign)))
    blocks.append(Table(title, head, cells, frozenset({0, 1})))
    return Section("accuracy", "Numerical against statistical error", blocks)


def _budget(table: pd.DataFrame) -> Table:
    """Contributions to the uncertainty of each share: sampling, numerical error, unresolved joints."""
    rows = []
    for row in table.to_dict("records"):
        numerical = max(abs(row[f"numerical_{end}"] - row["estimate"]) for end in ("lower", "upper"))
        half = 0.5 * (row["upper"] - row["lower"])
        lost = row["bound_upper"] - row["bound_lower"]
        limit = f"{row['load']} > {text.value(row['level'], row['unit'])}"
        rows.append([limit, text.percent(row["estimate"]), *(text.percent(x) for x in (half, numerical, lost))])
    head = ["limit", "share", "sampling, ±", "numerical error, up to", "failed and unsettled, width"]
    return Table("What makes the shares uncertain, in per cent of the joints", head, rows)


def _small(x: float) -> str:
    return "-" if np.isnan(x) else f"{x:.1e}"


def fatigue_section(found: Findings) -> Section:
    """Spectra and damage-equivalent loads of the channels loaded most."""
    loading = found.loading
    assert loading is not None
    loads = fatigue.equivalent_loads(loading)
    leading = fatigue.leading(loading)
    panels = [
        Panel(
            f"spectrum-{channel.replace('.', '-')}",
            f"{channel}: load spectrum",
            f"Ranges of {channel} that so many cycles a revolution reach, for half, 90 and 99 % of the joints",
            partial(_spectrum, loading=loading, channel=channel),
            (4.9, 3.5),
        )
        for channel in leading
    ]
    rows = []
    shown = loads[loads["channel"].isin(leading)].sort_values(["channel", "m", "share"])
    for (channel, m), part in shown.groupby(["channel", "m"], sort=False):
        unit = str(part["unit"].iloc[0])
        cells = [f"{channel}, m = {m:g}", text.value(float(part["nominal"].iloc[0]), unit)]
        last = part.iloc[-1]
        cells += [text.value(x, unit) for x in part["estimate"]]
        rows.append([*cells, text.span_of(float(last["lower"]), float(last["upper"]), unit)])
    shares = [f"{100 * share:g} % stay below" for share in fatigue.SHARES]
    head = ["channel and exponent", "nominal", *shares, "95 % interval of the last"]
    blocks: list[Block] = [Panels(panels)] if panels else []
    blocks.append(Table("Damage-equivalent loads", head, rows))
    damages = fatigue.damages(loading)
    if len(damages):
        head = ["channel", "nominal damage", "median", "joints above 1", "share", "95 % interval"]
        sums = [_damage(row) for row in damages.to_dict("records")]
        blocks.append(Table("Damage sum of the service life", head, sums))
    blocks += [Text(text.sentence(line), small=True) for line in fatigue.notes(loading, loads).splitlines()]
    return Section("fatigue", "Fatigue", blocks)


def _spectrum(ax: Axes, loading: Loading, channel: str) -> None:
    fatigue.panel(ax, loading, channel)
    handles, labels = fatigue.key()
    ax.legend(handles, labels, loc="upper right")


def _damage(row: dict[Any, Any]) -> list[str]:
    own = [row["channel"], f"{row['nominal']:.2g}", f"{row['median']:.2g}", f"{row['count']} of {row['n']}"]
    return [*own, text.percent(row["estimate"]), text.span(row["lower"], row["upper"])]


def sweep_section(found: Findings) -> Section:
    """Loads against the swept value."""
    panels = [
        Panel(
            f"sweep-{group}-{letter}",
            f"{group.capitalize()} bushings, {'force' if letter == 'F' else 'torque'}",
            f"Largest {'forces' if letter == 'F' else 'torques'} of the {group} bushings against the swept value",
            partial(_sweep, found=found, group=group, letter=letter),
            (4.9, 3.6),
        )
        for group in ("cross", "fork")
        for letter in "FT"
        if any(f"{group}{i}.{letter}" in found.campaign.drawn for i in (1, 2, 3, 4))
    ]
    table = sweep.worst(found.campaign)
    rows = [[f"{x:.5g}" if isinstance(x, float) else str(x) for x in row] for row in table.itertuples(index=False)]
    blocks: list[Block] = [Panels(panels)] if panels else []
    blocks.append(Table("Worst bushing", list(table.columns), rows))
    return Section("sweep", "Loads against the swept value", blocks)


def _sweep(ax: Axes, found: Findings, group: str, letter: str) -> None:
    sweep.panel(ax, found.campaign, group, letter)
    ax.legend(*sweep.key(found.campaign), loc="best", handlelength=2.6)


def provenance_section(found: Findings) -> Section:
    """Provenance of the numbers, and the text of the study."""
    blocks: list[Block] = [Facts(found.facts), Listing("The study as it was run", found.study)]
    return Section("provenance", "Where the numbers come from", blocks)
