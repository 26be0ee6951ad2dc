"""Fatigue of a campaign: tables of equivalent loads and of damage sums, figures of load spectra."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from tolstat.analysis.cycles import FloatArray
from tolstat.common.channels import CHANNELS
from tolstat.common.loads import unit_text
from tolstat.display import style, text
from tolstat.display.table import Column, Row
from tolstat.questions.fatigue.query import ANY, SHARES, Loading, equivalent_loads, is_in, leading, spectra

MIN_RANGE = 1e-3
"""Smallest range drawn, relative to the largest."""
MAX_LACKING = 1e-3
"""Relative increase of the sum of S^m by cycles that the file does not hold, above which a note says so."""


def _quantile(share: float) -> Column:
    return Column(
        f"{100 * share:g} % below",
        lambda row: text.value(row[share][0], row["unit"]),
        rank=0 if share == SHARES[-1] else 1,
    )


def _interval(row: Row) -> str:
    _, lower, upper = row[SHARES[-1]]
    return text.span_of(lower, upper, row["unit"])


def _line(row: Row) -> str:
    if row["channel"] == ANY:
        return "-"
    return f"{text.value(row['S0'], CHANNELS[row['channel']].unit)} at {row['N0']:g} cycles, m = {row['m']:g}"


LOADS = (
    Column("channel and exponent", lambda row: f"{row['channel']}, m = {row['m']:g}"),
    Column("nominal", lambda row: text.value(row["nominal"], row["unit"]), rank=2),
    *(_quantile(share) for share in SHARES),
    Column(f"95 % interval of {100 * SHARES[-1]:g} %", _interval),
)
"""Columns of the table `by_channel`."""
DAMAGES = (
    Column("channel", lambda row: str(row["channel"])),
    Column("S–N line", _line, words=True, rank=3),
    Column("nominal damage", lambda row: text.formed(row["nominal"]), rank=2),
    Column("median", lambda row: text.formed(row["median"]), rank=1),
    Column("joints above 1", lambda row: f"{row['count']} of {row['n'] - row['n_failed'] - row['n_unsettled']}"),
    Column("share", lambda row: text.percent(row["estimate"])),
    Column("95 % interval", lambda row: text.span(row["lower"], row["upper"])),
    Column("ppm", lambda row: text.ppm(row["estimate"]), rank=4),
    Column("above in delivery", text.delivery, rank=5),
)
"""Columns of the table `query.damages`. Joints above 1 are counted among the settled ones, as the share is."""


def by_channel(loads: pd.DataFrame) -> pd.DataFrame:
    """One row per channel and exponent of `query.equivalent_loads`: for each share (estimate, lower, upper)."""
    rows = []
    for (channel, m), part in loads.groupby(["channel", "m"], sort=False):
        ends = {row["share"]: (row["estimate"], row["lower"], row["upper"]) for row in part.to_dict("records")}
        unit, nominal = part["unit"].iloc[0], part["nominal"].iloc[0]
        rows.append({"channel": channel, "m": m, "unit": unit, "nominal": nominal, **ends})
    return pd.DataFrame(rows)


def notes(loading: Loading, table: pd.DataFrame) -> str:
    """Notes to `query.equivalent_loads`: number of joints, definition of the loads, restrictions."""
    settings = loading.settings
    lines = [
        f"{_settled(loading)}; loads are ranges: {settings.reference_cycles:g} cycles of them do the damage of "
        f"{settings.revolutions:g} revolutions"
    ]
    if cycle := duty_sentence(loading.duty):
        lines.append(cycle)
    if not loading.design.has_interval("quantile"):
        lines.append("no intervals: order statistics hold for independent samples only")
    lacking = table["lacking"].max() if len(table) else 0.0
    if lacking > MAX_LACKING:
        lines.append(f"cycles that the file does not hold may add {lacking:.2g} of a sum of S^m")
    return "\n".join(lines)


def duty_sentence(cycle: Sequence[tuple[str, float]]) -> str:
    """Shares of a duty cycle in words, without full stop; empty for a single operating point."""
    if len(cycle) < 2:
        return ""
    shares = ", ".join(f"{text.percent(share)} at {name}" for name, share in cycle)
    return f"over a duty cycle: {shares}, shares of the revolutions"


def figure(loading: Loading, confidence: float = 0.95) -> Figure:
    """Draw the load spectra of the most loaded cross and fork bushings.

    Parameters
    ----------
    loading : Loading
        Cycles of the joints.
    confidence : float
        Confidence level of the bands.

    Returns
    -------
    Figure
        Four panels, each with the channel that has the largest damage-equivalent load among the four bushings.
    """
    channels = leading(equivalent_loads(loading, SHARES[-1:]))
    with style.settings():
        small = f"{_settled(loading)}; in each panel the bushing and direction with the largest equivalent load"
        if loading.design.has_interval("quantile"):
            small += f"\nbands: pointwise {100 * confidence:g} % intervals of order statistics"
        page, panels = style.panels(f"{loading.name}: load spectra over the joints", small)
        for group, kind, ax in panels:
            here = [name for name in channels if is_in(CHANNELS[name], group, kind)]
            if here:
                panel(ax, spectra(loading, here[:1], confidence=confidence), loading.settings.revolutions)
            else:
                ax.text(0.5, 0.5, "no joint with a valid result", ha="center", transform=ax.transAxes)
                ax.set(xticks=[], yticks=[])
        style.legend(page, *key())
    return page


def key() -> tuple[list[Artist], list[str]]:
    """Handles and labels of a panel's legend."""
    labels = [f"{100 * share:g} % of the joints stay below" for share in SHARES]
    handles: list[Artist] = [Line2D([], [], color=style.COLOURS[i], ls=style.DASHES[i]) for i in range(len(SHARES))]
    return [*handles, Line2D([], [], color=style.INK, lw=1)], [*labels, "nominal joint"]


def panel(ax: Axes, spectrum: pd.DataFrame, revolutions: float) -> None:
    """Draw the spectra of one channel as step curves, with their bands.

    Parameters
    ----------
    ax : Axes
        Where to draw.
    spectrum : DataFrame
        Rows of `query.spectra` for one channel.
    revolutions : float
        Service life that its numbers of cycles refer to.
    """
    ceiling = float(spectrum["estimate"].max())
    floor = MIN_RANGE * ceiling if ceiling > 0 else 1.0
    numbers = spectrum["cycles"].unique() / revolutions
    x = np.concatenate([[0.7 * numbers[0]], numbers])
    for i, (_, part) in enumerate(spectrum.groupby("share")):
        lower, estimate, upper = (part[name].to_numpy() for name in ("lower", "estimate", "upper"))
        if np.isfinite(lower).any():
            top = np.where(np.isfinite(upper), upper, estimate)  # too few joints: the upper end is infinite
            low, high = (_from_left_edge(np.maximum(y, 0.1 * floor)) for y in (lower, top))
            ax.fill_between(x, low, high, step="pre", color=style.COLOURS[i], alpha=0.2, lw=0)
        ax.step(x, _from_left_edge(estimate), where="pre", color=style.COLOURS[i], ls=style.DASHES[i], zorder=3)
    ax.step(x, _from_left_edge(part["nominal"].to_numpy()), where="pre", color=style.INK, lw=1, zorder=2)
    shown = spectrum.loc[spectrum["estimate"] > floor, "cycles"].max() / revolutions
    ax.set(xscale="log", yscale="log", ylim=(floor, 2.0 * max(ceiling, floor)))
    ax.set_xlim(x[0], 1.05 * max(shown if shown > x[0] else x[-1], 2.0 * x[0]))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    ax.set_xticks([t for t in (0.01, 0.03, 0.1, 0.3, 1, 2, 3, 4, 6, 8, 12, 16) if x[0] <= t <= ax.get_xlim()[1]])
    channel, unit = spectrum[["channel", "unit"]].iloc[0]
    ax.set_xlabel("cycles a revolution with at least this range")
    ax.set_ylabel(f"range of {channel} [{unit_text(unit)}]")


def _settled(loading: Loading) -> str:
    return f"{loading.settled} of {loading.status.size} joints settled"


def _from_left_edge(y: FloatArray) -> FloatArray:
    """Repeat the first value of a step curve, so that the curve begins at the left edge."""
    return np.concatenate([y[:1], y])
