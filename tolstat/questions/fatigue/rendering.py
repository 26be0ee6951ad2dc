"""Fatigue of a campaign: damage-equivalent loads, damage sums and load spectra over the joints; figures."""

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
"""Maximum number of points of a spectrum."""
SMALLEST = 1e-3
"""Smallest range drawn, relative to the largest."""
MOST_LACKING = 1e-3
"""Relative increase of the sum of S^m by cycles that the file does not hold, above which a note says so."""


def equivalent_loads(loading: Loading, shares: Sequence[float] = SHARES, confidence: float = 0.95) -> pd.DataFrame:
    """Quantiles over the joints of the damage-equivalent loads.

    Parameters
    ----------
    loading : Loading
        Cycles of the joints.
    shares : sequence of float
        Shares of the joints at or below the quantile.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    DataFrame
        One row per channel, exponent and share: ``channel``, ``unit``, ``m``, ``nominal``, ``lacking`` (upper bound of
        the relative increase of the sum of S^m by cycles that the file does not hold, maximum over the joints), the
        fields of `analysis.quantile.Quantile`, ``confidence``. Loads are ranges in SI units.
    """
    judged, rows = loading.judged, []
    for m in judged.exponents:
        values = damage.equivalent_load(loading.cycles, m, judged.revolutions, judged.reference_cycles)
        nominal = damage.equivalent_load(loading.nominal, m, judged.revolutions, judged.reference_cycles)
        lacking = damage.truncation_bound(loading.cycles, m)
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
    """Cumulative load spectra: quantiles over the joints of the range that a number of cycles reaches or exceeds.

    Parameters
    ----------
    loading : Loading
        Cycles of the joints.
    channels : sequence of str, optional
        Channels of ``loading.cycles``; by default all.
    shares, confidence
        As in `equivalent_loads`; the intervals are pointwise.

    Returns
    -------
    DataFrame
        One row per channel, share and number: ``channel``, ``unit``, ``cycles`` (in the service life), ``nominal``, the
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
    """Channel with the largest equivalent load for each bushing's force and torque, from `equivalent_loads`.

    Evaluated at the middle exponent and the highest share. Moduli, whose cycles are not those of a component, are used
    only if the table has nothing else. Empty if no joint has a valid result.
    """
    exponents = sorted(table["m"].unique())
    part = table[(table["m"] == exponents[len(exponents) // 2]) & (table["share"] == table["share"].max())]
    part = part.dropna(subset="estimate")
    components = part[part["channel"].str.contains("_")]
    part = components if len(components) else part
    kinds = part["channel"].str.split("_").str[0]
    return [str(name) for name in part.loc[part.groupby(kinds, sort=False)["estimate"].idxmax(), "channel"]]


def notes(loading: Loading, table: pd.DataFrame) -> str:
    """Notes to `equivalent_loads`: number of joints, definition of the loads, restrictions."""
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
        Confidence level of the bands.

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
    """Handles and labels of a panel's legend."""
    labels = [f"{100 * share:g} % of the joints stay below" for share in SHARES]
    handles: list[Artist] = [Line2D([], [], color=style.COLOURS[i], ls=style.DASHES[i]) for i in range(len(SHARES))]
    return [*handles, Line2D([], [], color=style.INK, lw=1)], [*labels, "nominal joint"]


def leading(loading: Loading) -> list[str]:
    """Channel with the largest equivalent load for force and torque of the cross bushings and of the fork bushings."""
    table = equivalent_loads(loading, SHARES[-1:])
    candidates = table[table["channel"].isin(worst(table))].sort_values("estimate")
    found = []
    for group in ("cross", "fork"):
        for letter in "FT":
            here = candidates[candidates["channel"].str.match(rf"{group}\d\.{letter}")]
            found += [str(here["channel"].iloc[-1])] if len(here) else []
    return found


def panel(ax: Axes, loading: Loading, channel: str, confidence: float = 0.95) -> None:
    """Draw the spectra of one channel as step curves, with their bands."""
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
            top = np.where(np.isfinite(upper), upper, estimate)  # too few joints: the upper end is infinite
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
    """Repeat the first value of a step curve, so that the curve extends to the left edge."""
    return np.concatenate([y[:1], y])


def _numbers(part: cycles.Cycles) -> exceedance.FloatArray:
    """Cycles per revolution at which the spectra of the joints have steps, thinned to `MAX_NUMBERS`."""
    order = np.argsort(-part.ranges[:, 0], axis=1)
    steps = np.cumsum(part.weights[order], axis=1)[np.take_along_axis(part.ranges[:, 0], order, axis=1) > 0]
    numbers = np.unique(np.append(steps.round(9), 1.0))
    thinned = np.linspace(0, numbers.size - 1, min(numbers.size, MAX_NUMBERS)).round().astype(int)
    return np.asarray(numbers[thinned])


def _only(values: exceedance.FloatArray) -> float:
    return float(values[0]) if values.size else np.nan
