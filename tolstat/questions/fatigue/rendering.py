"""Fatigue of a campaign: damage-equivalent loads, damage sums and load spectra over the joints, and their picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from tolstat.analysis import cycles, damage, exceedance, quantile
from tolstat.common.tables import CHANNELS, Status
from tolstat.display import style
from tolstat.questions.fatigue.query import Loading

SHARES = (0.5, 0.9, 0.99)
MAX_NUMBERS = 40
"""Most points of a spectrum."""
SMALLEST = 1e-3
"""Smallest range drawn, as a part of the largest."""
MOST_LACKING = 1e-3
"""Part of the sum of S^m that cycles without a place may add before it is said."""


def equivalent_loads(loading: Loading, shares: Sequence[float] = SHARES, confidence: float = 0.95) -> pd.DataFrame:
    """Damage-equivalent loads over the joints.

    Parameters
    ----------
    loading : Loading
        Cycles of the joints.
    shares : sequence of float
        Shares of the joints that stay at or below a load.
    confidence : float
        Of the intervals.

    Returns
    -------
    DataFrame
        One row a channel, exponent and share: ``channel``, ``unit``, ``m``, ``nominal``, ``lacking`` (bound of the part
        of the sum of S^m that the file does not hold, largest of the joints), the fields of
        `analysis.quantile.Quantile`, ``confidence``. Loads are ranges in SI units.
    """
    judged, rows = loading.judged, []
    for m in judged.exponents:
        values = damage.equivalent_load(loading.cycles, m, judged.revolutions, judged.reference_cycles)
        nominal = damage.equivalent_load(loading.nominal, m, judged.revolutions, judged.reference_cycles)
        lacking = damage.shortfall(loading.cycles, m)
        for c, channel in enumerate(loading.cycles.channels):
            head = {"channel": channel, "unit": CHANNELS[channel], "m": m, "nominal": _only(nominal[:, c])}
            head["lacking"] = float(lacking[:, c].max(initial=0.0))
            for share in shares:
                q = quantile.at(values[:, c], loading.status, share, confidence, loading.iid)
                rows.append({**head, **q._asdict(), "confidence": confidence})
    return pd.DataFrame(rows)


def damages(loading: Loading, confidence: float = 0.95) -> pd.DataFrame:
    """Share of the joints whose damage sum in the service life exceeds 1, for each channel that has an S–N line.

    Returns
    -------
    DataFrame
        ``channel``, ``m``, ``S0`` (N or N m), ``N0``, ``nominal`` (damage of the nominal joint), ``median`` (of the
        joints), the fields of `analysis.exceedance.Exceedance` for the level 1, ``confidence``.
    """
    rows = []
    for channel, values in loading.judged.lines.items():
        if channel not in loading.cycles.channels:
            continue
        line = damage.Line(*values)
        sums, nominal = (
            damage.damage(part.of(channel), line, loading.judged.revolutions)[:, 0]
            for part in (loading.cycles, loading.nominal)
        )
        head = {"channel": channel, **line._asdict(), "nominal": _only(nominal)}
        head["median"] = quantile.at(sums, loading.status, 0.5).estimate
        above = exceedance.at(sums, loading.status, 1.0, confidence, loading.iid)
        rows.append({**head, **asdict(above), "confidence": confidence})
    return pd.DataFrame(rows)


def spectra(
    loading: Loading,
    channels: Sequence[str] | None = None,
    shares: Sequence[float] = SHARES,
    confidence: float = 0.95,
) -> pd.DataFrame:
    """Cumulative load spectra over the joints: the range that so many cycles of the service life reach.

    Parameters
    ----------
    loading : Loading
        Cycles of the joints.
    channels : sequence of str, optional
        Channels of ``loading.cycles``; all without it.
    shares, confidence
        As in `equivalent_loads`; the intervals are pointwise.

    Returns
    -------
    DataFrame
        One row a channel, share and number: ``channel``, ``unit``, ``cycles`` (in the service life), ``nominal``, the
        fields of `analysis.quantile.Quantile`, ``confidence``. Ranges in SI units, ascending numbers.
    """
    rows = []
    for channel in loading.cycles.channels if channels is None else channels:
        part = loading.cycles.of(channel)
        numbers = _numbers(part)
        values = cycles.spectrum(part, numbers)[:, 0]
        nominal = cycles.spectrum(loading.nominal.of(channel), numbers)[:, 0]
        for share in shares:
            for q, number in enumerate(numbers):
                found = quantile.at(values[:, q], loading.status, share, confidence, loading.iid)
                head = {"channel": channel, "unit": CHANNELS[channel], "cycles": number * loading.judged.revolutions}
                rows.append({**head, "nominal": _only(nominal[:, q]), **found._asdict(), "confidence": confidence})
    return pd.DataFrame(rows)


def worst(table: pd.DataFrame) -> list[str]:
    """Of each bushing's force and torque the channel with the largest load, from `equivalent_loads`.

    Read at the middle exponent and the highest share; moduli, whose cycles are no cycles of a component, only where the
    table has nothing else. Empty when no joint has a valid result.
    """
    exponents = sorted(table["m"].unique())
    part = table[(table["m"] == exponents[len(exponents) // 2]) & (table["share"] == table["share"].max())]
    part = part.dropna(subset="estimate")
    components = part[part["channel"].str.contains("_")]
    part = components if len(components) else part
    kinds = part["channel"].str.split("_").str[0]
    return [str(name) for name in part.loc[part.groupby(kinds, sort=False)["estimate"].idxmax(), "channel"]]


def notes(loading: Loading, table: pd.DataFrame) -> str:
    """Sentences on what the figures of `equivalent_loads` stand on."""
    judged = loading.judged
    lines = [
        f"{_valid(loading)}; loads are ranges: {judged.reference_cycles:g} cycles of them do the damage of "
        f"{judged.revolutions:g} revolutions"
    ]
    if not loading.iid:
        lines.append("no intervals: order statistics hold for independent samples only")
    lacking = table["lacking"].max() if len(table) else 0.0
    if lacking > MOST_LACKING:
        lines.append(f"cycles that the file does not hold may add {lacking:.2g} of a sum of S^m")
    return "\n".join(lines)


def figure(loading: Loading, confidence: float = 0.95) -> Figure:
    """Draw the load spectra of the most loaded cross and fork bushings.

    Parameters
    ----------
    loading : Loading
        Cycles of the joints.
    confidence : float
        Of the bands.

    Returns
    -------
    Figure
        Four panels, each with the channel that has the largest damage-equivalent load among the four bushings.
    """
    channels = leading(loading)
    with style.settings():
        small = f"{_valid(loading)}; in each panel the bushing and direction with the largest equivalent load"
        if loading.iid:
            small += f"\nbands: pointwise {100 * confidence:g} % intervals of order statistics"
        page, panels = style.panels(f"{loading.name}: load spectra over the joints", small)
        for group, letter, ax in panels:
            here = [name for name in channels if name.startswith(group) and f".{letter}" in name]
            if here:
                panel(ax, loading, here[0], confidence)
            else:
                ax.text(0.5, 0.5, "no joint with a valid result", ha="center", transform=ax.transAxes)
                ax.set(xticks=[], yticks=[])
        style.legend(page, *key())
    return page


def key() -> tuple[list[Artist], list[str]]:
    """Legend of a panel: its lines and their meaning."""
    labels = [f"{100 * share:g} % of the joints stay below" for share in SHARES]
    handles: list[Artist] = [Line2D([], [], color=style.COLOURS[i], ls=style.DASHES[i]) for i in range(len(SHARES))]
    return [*handles, Line2D([], [], color=style.INK, lw=1)], [*labels, "nominal joint"]


def leading(loading: Loading) -> list[str]:
    """Of force and torque of the cross and of the fork bushings the channel with the largest equivalent load."""
    table = equivalent_loads(loading, SHARES[-1:])
    candidates = table[table["channel"].isin(worst(table))].sort_values("estimate")
    found = []
    for group in ("cross", "fork"):
        for letter in "FT":
            here = candidates[candidates["channel"].str.match(rf"{group}\d\.{letter}")]
            found += [str(here["channel"].iloc[-1])] if len(here) else []
    return found


def panel(ax: Axes, loading: Loading, channel: str, confidence: float = 0.95) -> None:
    """Draw the spectra of one channel: steps down to the right, and their bands."""
    revolutions = loading.judged.revolutions
    table = spectra(loading, [channel], SHARES, confidence)
    ax.set_xlabel("cycles a revolution with at least this range")
    ax.set_ylabel(f"range of {channel} [{'N' if CHANNELS[channel] == 'N' else 'N m'}]")
    ceiling = float(table["estimate"].max())
    floor = SMALLEST * ceiling if ceiling > 0 else 1.0
    numbers = table["cycles"].unique() / revolutions
    x = np.concatenate([[0.7 * numbers[0]], numbers])
    for i, (_, part) in enumerate(table.groupby("share")):
        lower, estimate, upper = (part[name].to_numpy() for name in ("lower", "estimate", "upper"))
        if np.isfinite(lower).any():
            top = np.where(np.isfinite(upper), upper, estimate)  # no upper end: too few joints
            ends = (_held(np.maximum(y, 0.1 * floor)) for y in (lower, top))
            ax.fill_between(x, next(ends), next(ends), step="pre", color=style.COLOURS[i], alpha=0.2, lw=0)
        ax.step(x, _held(estimate), where="pre", color=style.COLOURS[i], ls=style.DASHES[i], zorder=3)
    ax.step(x, _held(part["nominal"].to_numpy()), where="pre", color=style.INK, lw=1, zorder=2)
    shown = table.loc[table["estimate"] > floor, "cycles"].max() / revolutions
    ax.set(xscale="log", yscale="log", ylim=(floor, 2.0 * max(ceiling, floor)))
    ax.set_xlim(x[0], 1.05 * max(shown if shown > x[0] else x[-1], 2.0 * x[0]))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())
    ax.set_xticks([t for t in (0.01, 0.03, 0.1, 0.3, 1, 2, 3, 4, 6, 8, 12, 16) if x[0] <= t <= ax.get_xlim()[1]])


def _valid(loading: Loading) -> str:
    return f"{int((loading.status == Status.OK).sum())} of {loading.status.size} joints settled"


def _held(y: exceedance.FloatArray) -> exceedance.FloatArray:
    """Values of a step curve with the first one held to the left edge."""
    return np.concatenate([y[:1], y])


def _numbers(part: cycles.Cycles) -> exceedance.FloatArray:
    """Cycles per revolution at which the spectra of the joints have their steps, some of them if they are many."""
    order = np.argsort(-part.ranges[:, 0], axis=1)
    steps = np.cumsum(part.weights[order], axis=1)[np.take_along_axis(part.ranges[:, 0], order, axis=1) > 0]
    numbers = np.unique(np.append(steps.round(9), 1.0))
    thinned = np.linspace(0, numbers.size - 1, min(numbers.size, MAX_NUMBERS)).round().astype(int)
    return np.asarray(numbers[thinned])


def _only(values: exceedance.FloatArray) -> float:
    return float(values[0]) if values.size else np.nan
