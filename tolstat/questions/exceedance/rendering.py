"""Load exceedance of a random campaign: the table at the limits, the curves, and their picture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict

import numpy as np
import pandas as pd
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from tolstat.analysis import exceedance, weighted
from tolstat.analysis.accuracy import size
from tolstat.common.loads import LOADS
from tolstat.common.tables import VALID, Status
from tolstat.display import style
from tolstat.questions.exceedance import accuracy
from tolstat.store.view import Campaign, ends, load

SHARES = (0.5, 0.9, 0.95, 0.99)
BUDGET = ("numerical_lower", "numerical_upper", "total_lower", "total_upper")
MAX_LEVELS, DRAWN_LEVELS = 600, 200
"""Maximum number of points of a curve in the CSV and in the picture."""
LIMIT_DASH, ZERO_DASH = (0.0, (8.0, 3.0)), (0.0, (1.0, 2.0))


def limits(campaign: Campaign, confidence: float = 0.95) -> pd.DataFrame:
    """Share of the joints above each of the study's limits.

    Parameters
    ----------
    campaign : Campaign
        The campaign.
    confidence : float
        Confidence level of the intervals.

    Returns
    -------
    DataFrame
        One row per limit, in the study's order: ``load``, ``unit``, ``nominal``, then the fields of
        `analysis.exceedance.Exceedance` (``level`` is the limit), then ``confidence`` and the error budget, see
        `_budget`. Loads in SI units.
    """
    rows = []
    numerical = accuracy.usual(campaign.verification) if campaign.verification else {}
    for name, level in campaign.limits.items():
        values, unit = load(campaign.results, name)
        share = campaign.above(values, level, confidence, ends(campaign.results, name))
        head = {"load": name, "unit": unit, "nominal": nominal(campaign, name)}
        budget = _budget(campaign, name, level, confidence, numerical)
        rows.append({**head, **asdict(share), "confidence": confidence, **budget})
    return pd.DataFrame(rows)


def _budget(
    campaign: Campaign, name: str, level: float, confidence: float, numerical: Mapping[str, float]
) -> dict[str, float]:
    """Bounds of a share with every load shifted down and up by the numerical error.

    Returns
    -------
    dict
        ``numerical_error``, relative to the largest load of the kind in the joint, NaN if unknown; ``numerical_lower``
        and ``numerical_upper``, the estimates with loads shifted down and up; ``total_lower`` and ``total_upper``,
        their ends ``outer_lower`` and ``outer_upper``: cover numerical error, sampling and unresolved joints.
    """
    kind = LOADS[name].kind
    error = numerical.get(kind, np.nan)
    values = load(campaign.results, name)[0]
    shift = error * size(campaign.results, name)
    if np.isnan(error):
        return {"numerical_error": error} | dict.fromkeys(BUDGET, np.nan)
    least, most = ends(campaign.results, name)
    low, high = (campaign.above(values + s, level, confidence, (least + s, most + s)) for s in (-shift, shift))
    bounds = (low.estimate, high.estimate, low.outer_lower, high.outer_upper)
    return {"numerical_error": error, **dict(zip(BUDGET, bounds, strict=True))}


def quantiles(campaign: Campaign, confidence: float = 0.95) -> pd.DataFrame:
    """Quantiles of every bushing load kept or, if there are none, of the other loads kept.

    Returns
    -------
    DataFrame
        One row per load and share: ``load``, ``unit``, ``nominal``, the fields of `analysis.quantile.Quantile`,
        ``confidence``. Loads in SI units.
    """
    rows = []
    for name in campaign.listed:
        values, unit = load(campaign.results, name)
        for share in SHARES:
            q = campaign.quantile(values, share, confidence)
            head = {"load": name, "unit": unit, "nominal": nominal(campaign, name)}
            rows.append({**head, **q._asdict(), "confidence": confidence})
    return pd.DataFrame(rows)


def curves(campaign: Campaign, confidence: float = 0.95) -> pd.DataFrame:
    """Exceedance curves of the loads of `quantiles`, as one table.

    Returns
    -------
    DataFrame
        ``load``, ``unit``, then the fields of `analysis.exceedance.Exceedance`; SI units, at most
        `MAX_LEVELS` levels per load.
    """
    parts = []
    for name in campaign.listed:
        table, unit = curve(campaign, name, confidence, MAX_LEVELS)
        part = pd.DataFrame({field: table[field] for field in exceedance.CURVE.names or ()})
        part.insert(0, "load", name)
        part.insert(1, "unit", unit)
        parts.append(part)
    return pd.concat(parts, ignore_index=True)


def note(campaign: Campaign) -> str:
    """Sentence on what the intervals cover."""
    if campaign.weights is not None:
        text = (
            "joints counted by their weights; bands: pointwise 95 % Clopper–Pearson intervals of as many equal joints "
            f"as would be as sure{_distrust(campaign)}"
        )
    elif campaign.iid:
        text = "bands: pointwise 95 % Clopper–Pearson intervals of the settled joints"
    else:
        text = "no intervals: Clopper–Pearson holds for independent samples only"
    if campaign.count(*VALID) + campaign.count(Status.PENDING) < len(campaign.results):
        text += "; light bands: with the others counted below and above every x"
    return text


def _distrust(campaign: Campaign) -> str:
    """Words on limits whose share is unreliable, because too few effective joints are above them."""
    poor = []
    weights = np.ones(len(campaign.results)) if campaign.weights is None else campaign.weights
    for name, level in campaign.limits.items():
        values, status = load(campaign.results, name)[0], campaign.results["status"]
        found = weighted.trust(values, status, weights, level)
        if not found.usable:
            poor.append(f"{name} ({found.effective:.0f} effective joints above, Pareto k {found.k:.2f})")
    return f"; not to be trusted, needs more joints or other proposals: {', '.join(poor)}" if poor else ""


def figure(campaign: Campaign, confidence: float = 0.95) -> Figure:
    """Draw the exceedance curves of all bushing loads that the study keeps.

    Parameters
    ----------
    campaign : Campaign
        The campaign; without a valid joint, the panels say so.
    confidence : float
        Confidence level of the bands.

    Returns
    -------
    Figure
        Four panels, empty where no load is kept; share of the joints on a logarithmic axis down to half a joint.
    """
    with style.settings():
        title = f"{campaign.name}: share of joints whose largest load exceeds x"
        page, panels = style.panels(title, f"{campaign.head()}\n{note(campaign)}")
        for group, letter, ax in panels:
            panel(ax, campaign, group, letter, confidence)
        _legend(page, campaign)
    return page


def nominal(campaign: Campaign, name: str) -> float:
    """Load of the nominal joint, SI; NaN if there is none."""
    return float(load(campaign.nominal, name)[0][0]) if len(campaign.nominal) else np.nan


def curve(campaign: Campaign, name: str, confidence: float, most: int) -> tuple[NDArray[np.void], str]:
    """Exceedance curve of a load and its unit, thinned to `most` levels: denser at the largest loads."""
    values, unit = load(campaign.results, name)
    levels = np.unique(exceedance.sort_out(values, campaign.results["status"]).valid)
    if levels.size > most:
        top = levels.size - np.geomspace(1, levels.size, most // 2).round().astype(int)
        even = np.linspace(0, levels.size - 1, most // 2).round().astype(int)
        levels = levels[np.union1d(top, even)]
    below = np.nextafter(levels[:1], -np.inf)  # a level that every valid joint exceeds
    return campaign.curve(values, np.concatenate([below, levels]), confidence, ends(campaign.results, name)), unit


def panel(ax: Axes, campaign: Campaign, group: str, letter: str, confidence: float = 0.95) -> None:
    """Draw the curves of four bushings: ``cross`` or ``fork``, ``F`` or ``T``."""
    names = [f"{group}{i}.{letter}" for i in (1, 2, 3, 4)]
    tables = [
        curve(campaign, name, confidence, DRAWN_LEVELS)[0] if name in campaign.drawn else np.empty(0, exceedance.CURVE)
        for name in names
    ]
    unit = "N" if letter == "F" else "N m"
    ax.set_xlabel(f"x: largest |{letter}| over the revolution [{unit}]")
    if letter == "F":
        ax.set_ylabel("share of joints above x")
    levels = np.concatenate([table["level"] for table in tables])
    if not levels.size:
        held = any(name in campaign.drawn for name in names)
        found = "no joint with a valid result" if held else "not kept by the study"
        ax.text(0.5, 0.5, found, ha="center", transform=ax.transAxes)
        ax.set(xticks=[], yticks=[])
        return
    marked = _limit_levels(campaign, group, letter)
    low, high = axis_range(levels, list(marked))
    ax.set_xlim(low, high)
    floor = 0.5 * min(least(campaign, table) for table in tables if table.size)
    style.share_axis(ax, floor)
    for i, table in enumerate(tables):
        if table.size:
            steps(ax, table, i, low, floor)
        ideal = nominal(campaign, names[i])
        if low <= ideal <= high:
            style.mark(ax, ideal, 1.0, style.COLOURS[i])
    if campaign.iid:
        ends = [table["outer_upper"][-1] for table in tables if table.size]
        ax.axhline(max(ends), color=style.FAINT, lw=1.1, ls=ZERO_DASH, zorder=1.5)
    limit_lines(ax, marked, unit)


def least(campaign: Campaign, table: NDArray[np.void]) -> float:
    """Smallest share that a curve shows: that of one joint or, with weights, the smallest positive estimate."""
    shares = table["estimate"][table["estimate"] > 0]
    return 1.0 / float(table["n"][0]) if campaign.weights is None else float(shares.min(initial=1.0))


def axis_range(levels: NDArray[np.float64], marked: list[float]) -> tuple[float, float]:
    """Range of the x axis: the loads, and the limits unless they lie far off."""
    low, high = float(levels.min()), float(levels.max())
    reach = max(high - low, 0.02 * abs(high), 1e-12)
    near = [x for x in marked if low - 0.8 * reach <= x <= high + 0.8 * reach]
    low, high = min([low, *near]), max([high, *near])
    margin = 0.05 * max(high - low, reach)
    return low - margin, high + margin


def steps(ax: Axes, table: NDArray[np.void], i: int, low: float, floor: float) -> None:
    """Draw one curve with its bands as steps; its first row is drawn from the left edge `low` on."""
    if not table.size:
        return
    x = np.concatenate([[low], table["level"][1:]])
    colour = style.COLOURS[i]

    def shown(field: str) -> NDArray[np.float64]:
        shares: NDArray[np.float64] = table[field].clip(1e-3 * floor, 1.0)
        return shares

    def band(lower: str, upper: str, alpha: float) -> None:
        ax.fill_between(x, shown(lower), shown(upper), step="post", color=colour, alpha=alpha, lw=0)

    iid = np.isfinite(table["lower"]).all()
    if iid:
        band("lower", "upper", 0.2)
    if table["n_failed"][0] + table["n_unsettled"][0]:
        band("outer_lower" if iid else "bound_lower", "outer_upper" if iid else "bound_upper", 0.1)
    ax.step(x, shown("estimate"), where="post", color=colour, ls=style.DASHES[i], zorder=3)


def _limit_levels(campaign: Campaign, group: str, letter: str) -> dict[float, list[int]]:
    """Limits of a panel: level -> numbers of the bushings that have it."""
    found: dict[float, list[int]] = {}
    for i in (1, 2, 3, 4):
        name = f"{group}{i}.{letter}"
        if name in campaign.limits:
            found.setdefault(campaign.limits[name], []).append(i)
    return dict(sorted(found.items()))


def limit_lines(ax: Axes, marked: dict[float, list[int]], unit: str) -> None:
    """Mark limits by vertical lines, labelled above the panel; an arrow stands for one out of range."""
    labels: list[tuple[float, str, str]] = []
    low, high = ax.get_xlim()
    for level, numbers in marked.items():
        text = f"limit {level:g} {unit}" + ("" if len(numbers) == 4 else f" ({', '.join(map(str, numbers))})")
        colour = style.COLOURS[numbers[0] - 1] if len(numbers) == 1 else style.INK
        if low <= level <= high:
            ax.axvline(level, color=colour, lw=1.4, ls=LIMIT_DASH, zorder=2)
        else:
            text = f"{text} →" if level > high else f"← {text}"
        place = float(np.clip((level - low) / (high - low), 0.0, 1.0))
        labels = _without_overlap(labels, (place, text, colour))
    for place, text, colour in labels:
        side = "left" if place < 0.12 else "right" if place > 0.88 else "center"
        ax.text(
            place,
            1.015,
            text,
            transform=ax.transAxes,
            ha=side,
            va="bottom",
            size=0.9 * rcParams["font.size"],
            color=colour,
        )


def _without_overlap(labels: list[tuple[float, str, str]], new: tuple[float, str, str]) -> list[tuple[float, str, str]]:
    """Append a label, or merge it with the previous one if they would overlap (0.014 panel widths per letter)."""
    if not labels:
        return [new]
    place, text, _ = labels[-1]
    if new[0] - place > 0.007 * (len(text) + len(new[1])) + 0.02:
        return [*labels, new]
    joined = (0.5 * (place + new[0]), f"{text}, {new[1].replace('limit ', '')}", style.INK)
    return _without_overlap(labels[:-1], joined)


def _legend(page: Figure, campaign: Campaign) -> None:
    handles: list[Artist] = [
        Line2D([], [], color=c, ls=dash) for c, dash in zip(style.COLOURS, style.DASHES, strict=True)
    ]
    labels = [f"bushing {i}" for i in (1, 2, 3, 4)]
    if campaign.iid:
        handles += [Patch(color=style.FAINT, alpha=0.4, lw=0)]
        handles += [Line2D([], [], color=style.FAINT, lw=1.1, ls=ZERO_DASH)]
        labels += ["95 % band", "upper end where none exceeds x"]
    if len(campaign.nominal):
        handles.append(Line2D([], [], marker="v", color=style.FAINT, ls="", ms=7.5))
        labels.append("nominal joint")
    style.legend(page, handles, labels)
