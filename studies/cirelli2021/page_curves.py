"""Figures 12 to 22 of the paper: speed ratio and loads over the input angle, every case in each panel.

The direction nearest to the printed tables is drawn bold; the other directions of the same case are hair lines.
"""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MultipleLocator
from numpy.typing import NDArray

from studies.cirelli2021 import tables as paper
from studies.cirelli2021.page_source import PaperStudy
from tolstat.common.load_kinds import CONTACTS, INNER, OUTER
from tolstat.display import style
from tolstat.joint import ideal

Array = NDArray[np.float64]
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
"""One for each printed case: Okabe and Ito (2008)."""
DASHES: tuple[style.Dash, ...] = (
    (0.0, (6.0, 2.0)),
    (0.0, (3.0, 1.5)),
    (0.0, (1.2, 0.9)),
    (0.0, (7.0, 1.5, 1.2, 1.5)),
)
TITLE, LEGEND = 0.48, 0.62
"""Inches of a page above and below its panels."""


def page(title: str, rows: int, columns: int, height: float = 2.7, width: float = 10.6) -> tuple[Figure, list[Axes]]:
    """Make a figure of equal panels, a title above and room for a legend below.

    Parameters
    ----------
    title : str
        Headline.
    rows, columns : int
        Number of panels.
    height, width : float
        Of a row and of the page, inches.
    """
    total = rows * height + TITLE + LEGEND
    frame = (0.0, LEGEND / total, 1.0, 1.0 - (TITLE + LEGEND) / total)
    figure = Figure(figsize=(width, total), layout=ConstrainedLayoutEngine(rect=frame, h_pad=0.08, w_pad=0.06))
    axes = figure.subplots(rows, columns, squeeze=False)
    figure.text(0.012, 1.0 - 0.10 / total, title, fontsize=13.5, fontweight="bold", va="top")
    return figure, list(axes.flat)


def speed_ratio(study: PaperStudy) -> Figure:
    """Figure 12: Psi over the input angle, 0 and 15 degrees."""
    angles = paper.printed().alpha
    with style.settings():
        figure, axes = page("Figure 12. Relative error Ψ of the speed ratio", 1, 2, 3.2)
        for letter, ax, alpha in zip("ab", axes, angles, strict=True):
            analytic = ideal.speed_ratio(study.main.theta, alpha)
            psi = (study.main.tau - analytic) / study.main.tau
            _draw(ax, study, float(alpha), psi)
            ax.set_title(f"({letter}) α = {np.degrees(alpha):.0f}°")
            if np.abs(psi[np.abs(study.main.alpha - alpha) < paper.SAME_ALPHA]).max() < 1e-6:
                ax.set_ylim(-1e-6, 1e-6)
            ax.set_ylabel("Ψ")
            ax.yaxis.set_major_formatter(FuncFormatter(_power))
        _legend(figure, study, [float(a) for a in angles])
    return figure


def bushings(study: PaperStudy, which: tuple[int, int], alpha: float, numbers: str) -> Figure:
    """Force and torque of two bushings at one misalignment: two of Figures 13 to 20.

    Parameters
    ----------
    study : PaperStudy
        The study.
    which : tuple of int
        Indices of the bushings, see `tables.BUSHINGS`.
    alpha : float
        Misalignment, rad.
    numbers : str
        The paper's figure numbers.
    """
    group = "Cross" if which[0] < 4 else "Output fork"
    title = f"Figures {numbers}. {group} bushing force and torque, α = {np.degrees(alpha):.0f}°"
    with style.settings():
        figure, axes = page(title, 2, 2)
        for row, (letter, unit) in enumerate((("F", "N"), ("T", "N m"))):
            pair = axes[2 * row : 2 * row + 2]
            for ax, bushing in zip(pair, which, strict=True):
                _draw(ax, study, alpha, study.main.moduli[:, :, bushing, row])
                ax.set_title(f"{group} bushing {bushing % 4 + 1}, {'force' if row == 0 else 'torque'}")
                ax.set_ylabel(f"|{letter}| [{unit}]")
            _share_scale(pair, 4.0 if row == 0 else 1.0)
        _legend(figure, study, [alpha])
    return figure


def springs(study: PaperStudy, alpha: float) -> Figure:
    """Figures 21 and 22: force of the eight contact springs."""
    with style.settings():
        title = f"Figures 21, 22. Normal force of the contact springs, α = {np.degrees(alpha):.0f}°"
        figure, axes = page(title, 2, 4, 2.6, 13.0)
        ends = [(pin, end) for pin in (2, 3, 0, 1) for end in (OUTER, INNER)]
        for number, (ax, (pin, end)) in enumerate(zip(axes, ends, strict=True), start=1):
            _draw(ax, study, alpha, study.main.contact[:, :, pin, end])
            side = "input" if pin > 1 else "output"
            ax.set_title(f"spring {number}: pin {pin + 1} ({side}), {CONTACTS[end]} end", fontsize=9.5)
            ax.set_ylabel("force [N]" if number % 4 == 1 else "")
        _share_scale(axes, 20.0)
        _legend(figure, study, [alpha])
    return figure


def _draw(ax: Axes, study: PaperStudy, alpha: float, values: Array) -> None:
    """Draw `values`, (m, samples), of all joints at one misalignment."""
    theta = np.append(np.degrees(study.main.theta), 360.0)
    closed = np.concatenate([values, values[:, :1]], axis=1)
    bold = {match.printed: match.row for match in study.matches if abs(match.alpha - alpha) < paper.SAME_ALPHA}
    here = np.abs(study.main.alpha - alpha) < paper.SAME_ALPHA
    for c, name in enumerate(paper.printed().cases):
        for row in np.flatnonzero(here & np.isin(study.main.case, paper.directions(name, study.cases))):
            if row == bold[name]:
                ax.plot(theta, closed[row], color=COLOURS[c], ls=DASHES[c], lw=2.2, zorder=4)
            else:
                ax.plot(theta, closed[row], color=COLOURS[c], lw=0.6, alpha=0.55, zorder=2)
    ax.plot(theta, closed[study.ideal(alpha)], color=style.INK, lw=1.0, zorder=5)
    ax.set_xlim(0.0, 360.0)
    ax.xaxis.set_major_locator(MultipleLocator(90.0))
    ax.set_xlabel("input angle θ [°]")


def _share_scale(axes: list[Axes], least: float) -> None:
    """Give panels one scale, which spans `least` at least: no rounding blown up to a picture."""
    low = min(ax.get_ylim()[0] for ax in axes)
    high = max(ax.get_ylim()[1] for ax in axes)
    spare = max(0.0, 0.5 * (least - (high - low)))
    for ax in axes:
        ax.set_ylim(low - spare, high + spare)


def _legend(figure: Figure, study: PaperStudy, angles: list[float]) -> None:
    handles: list[Artist] = [Line2D([], [], color=style.INK, lw=1.0)]
    labels = ["ideal"]
    for c, name in enumerate(paper.printed().cases):
        found = [m.case for m in study.matches if m.printed == name and any(abs(m.alpha - a) < 1e-6 for a in angles)]
        handles.append(Line2D([], [], color=COLOURS[c], ls=DASHES[c], lw=2.0))
        labels.append(" / ".join(dict.fromkeys(found)).replace(f" / {name}", " /"))
    handles.append(Line2D([], [], color=style.FAINT, lw=0.6))
    labels.append("other directions")
    figure.legend(
        handles, labels, loc="lower center", ncols=len(labels), fontsize=9.5, handlelength=3.2, columnspacing=1.4
    )


def _power(value: float, _: int) -> str:
    return "0" if abs(value) < 1e-15 else f"{value:.1e}".replace("e-0", "e-").replace("-", "−")
