"""Figure 5 of the paper, the spectra, and what the choices that it does not print do to its tables."""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator
from numpy.typing import NDArray

from studies.cirelli2021 import choices as paper_choices
from studies.cirelli2021 import spectra as paper_spectra
from studies.cirelli2021 import tables as paper
from studies.cirelli2021.page_curves import COLOURS, DASHES, page
from studies.cirelli2021.page_equations import hertz
from studies.cirelli2021.page_source import PaperStudy
from tolstat.display import style
from tolstat.joint import material

Array = NDArray[np.float64]
LAWS = {
    "mode": ("o", "#0072B2"),
    "point": ("^", "#D55E00"),
    "uniform": ("s", "#009E73"),
    "sliced": ("D", "#CC79A7"),
    "stations": ("P", "#56B4E9"),
}
FLOOR = 0.05
"""Smallest change of a load that the sweeps show, per cent."""


def contact(study: PaperStudy) -> Figure:
    """Figure 5: force of a pin over its displacement, uniform and point contact."""
    of, steel = study.joint.contact, study.joint.material
    load, ratio = hertz(study.joint)
    force = np.linspace(0.0, load, 200)[1:]
    exact = material.contact_displacement(force / of.z, of.D_H, of.D_P, steel.E, steel.nu)
    k1, k2 = material.fit_contact(load, of.z, of.D_H, of.D_P, steel.E, steel.nu)
    k1u, k2u, k1p, k2p = of.coefficients()
    with style.settings():
        figure, axes = page("Figure 5. Contact force against displacement", 1, 2, 3.4)
        pairs = ((1.0, (k1, k2), (k1u, k2u)), (ratio, (k1 / ratio**2, k2 / ratio), (k1p, k2p)))
        for ax, name, (factor, fitted, given) in zip(axes, ("Uniform", "Point"), pairs, strict=True):
            x = exact * factor
            ax.plot(1e6 * x, 1e-3 * force, color=style.INK, lw=1.6)
            for k, (a, b) in enumerate((fitted, given)):
                ax.plot(1e6 * x, 1e-3 * (a * x**2 + b * x), color=COLOURS[k], ls=DASHES[k], lw=2.0)
            ax.set_title(f"{name} contact" + (f", H = {ratio:g}" if factor > 1.0 else ""))
            ax.set_xlabel("displacement δ [µm]")
            ax.set_ylabel("force [kN]")
        handles: list[Artist] = [Line2D([], [], color=style.INK, lw=1.6)]
        handles += [Line2D([], [], color=COLOURS[k], ls=DASHES[k], lw=2.0) for k in (0, 1)]
        fit = f"quadratic fit, eq. (5), up to {1e-3 * load:g} kN"
        _foot(figure, handles, ["eqs. (3), (4)", fit, "coefficients of the joint file (Table 2)"])
    return figure


def spectra(study: PaperStudy, alpha: float) -> Figure:
    """Amplitudes at multiples of the input speed, all errors beside the ideal joint."""
    main = study.main
    amplitude = paper_spectra.amplitudes(main.moduli)
    ideal = amplitude[study.ideal(alpha)]
    orders = np.arange(1, 7)
    with style.settings():
        title = f"Spectra of output side loads, α = {np.degrees(alpha):.0f}°: ideal joint and errors in every direction"
        figure, axes = page(title, 2, 2)
        panels = [(b, k) for k in (0, 1) for b in (0, 7)]
        for ax, (bushing, load) in zip(axes, panels, strict=True):
            mean = ideal[0, bushing, load]
            ax.bar(orders, 100.0 * ideal[1:7, bushing, load] / mean, width=0.8, color="#BBBBBB", zorder=1)
            for c, name in enumerate(paper.printed().cases):
                here = np.isin(main.case, paper.directions(name, study.cases))
                for row in np.flatnonzero(here & (np.abs(main.alpha - alpha) < paper.SAME_ALPHA)):
                    y = 100.0 * amplitude[row, 1:7, bushing, load] / mean
                    ax.plot(orders + 0.16 * (c - 1.5), y, ls="", marker="os^D"[c], ms=4.5, mfc="none", color=COLOURS[c])
            part = "Cross bushing 1" if bushing == 0 else "Fork bushing 4"
            ax.set_title(f"{part}, {'force' if load == 0 else 'torque'}")
            ax.set_xlabel("multiple of the input speed")
            ax.set_ylabel("amplitude [% of mean]")
        handles: list[Artist] = [Line2D([], [], color="#BBBBBB", lw=8)]
        handles += [Line2D([], [], ls="", marker="os^D"[c], mfc="none", color=COLOURS[c]) for c in range(4)]
        _foot(figure, handles, ["ideal", *paper.printed().cases])
    return figure


def axis_of(study: PaperStudy, sweep: paper_choices.Sweep) -> tuple[Array, float, str]:
    """Swept values for the reader, the study's own value, and the label; mm."""
    if sweep.key == "contact.D_P":  # the same joint file with another pin: its clearance is what counts
        hole = study.joint.contact.D_H
        return 500.0 * (hole - sweep.values), 500.0 * (hole - study.joint.contact.D_P), "radial clearance c [mm]"
    section, name = sweep.key.split(".")
    return 1e3 * sweep.values, 1e3 * float(getattr(getattr(study.joint, section), name)), f"{sweep.key} [mm]"


def largest(study: PaperStudy, variant: int, name: str, alpha: float, load: int) -> float:
    """Largest |Gamma| on the output side over all directions of a printed case, per cent; `load` 0 force, 1 torque."""
    rows = (study.variant == variant) & np.isin(study.case, paper.directions(name, study.cases))
    rows &= np.abs(study.alpha - alpha) < paper.SAME_ALPHA
    part = np.abs(study.gamma[rows][:, paper.OUTPUT_SIDE, load])
    return float(np.nanmax(part)) if np.isfinite(part).any() else float("nan")


def sweeps(study: PaperStudy) -> Figure:
    """Largest Gamma, and the distance from the printed tables, against each choice that is not printed."""
    found = study.sweeps()
    objective = {fit.variant: fit.objective for fit in study.fits}
    with style.settings():
        figure, axes = page("What decides Γ: one unprinted value at a time", 3, len(found), 2.5, 3.3 * len(found) + 0.6)
        grid = np.array(axes).reshape(3, len(found))
        for column, sweep in zip(grid.T, found, strict=True):
            x, own, label = axis_of(study, sweep)
            for load in (0, 1):
                _gamma_panel(column[load], study, sweep, x, load)
            column[2].plot(x, [objective[int(v)] for v in sweep.variants], color=style.INK, marker="o", ms=3.5, lw=1.4)
            column[2].axhline(paper_choices.no_effect(), color=style.FAINT, ls=(0.0, (1.0, 2.0)), lw=1.3)
            _distance_scale(column[2])
            column[2].set_xlabel(label)
            for ax in column:
                ax.axvline(own, color=style.FAINT, lw=0.9, ls=(0.0, (4.0, 3.0)), zorder=1)
        for ax, text in zip(grid[:, 0], ("largest |Γ_F| [%]", "largest |Γ_T| [%]", "distance [points]"), strict=True):
            ax.set_ylabel(text)
        handles: list[Artist] = [Line2D([], [], color=COLOURS[c], ls=DASHES[c], lw=1.8) for c in range(4)]
        handles += [Line2D([], [], color=style.FAINT, lw=0.9, ls=(0.0, (4.0, 3.0)))]
        handles += [Line2D([], [], color=style.FAINT, lw=1.3, ls=(0.0, (1.0, 2.0)))]
        _foot(figure, handles, [*paper.printed().cases, "value of the joint file", "distance if errors did nothing"])
    return figure


def _gamma_panel(ax: Axes, study: PaperStudy, sweep: paper_choices.Sweep, x: Array, load: int) -> None:
    for c, name in enumerate(paper.printed().cases):
        both = [[largest(study, int(v), name, float(a), load) for v in sweep.variants] for a in paper.printed().alpha]
        ax.plot(x, np.maximum(np.max(both, axis=0), FLOOR), color=COLOURS[c], ls=DASHES[c], marker=".", ms=4)
    _log_scale(ax, 0.5, 3000.0)


def _distance_scale(ax: Axes) -> None:
    _log_scale(ax, 1.0, 1000.0)


def _log_scale(ax: Axes, low: float, high: float) -> None:
    ax.set_yscale("log")
    ax.set_ylim(low, high)
    ax.yaxis.set_major_locator(LogLocator(numticks=6))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))


def search(study: PaperStudy) -> Figure:
    """Distance from the printed tables of every joint of the search, against each quantity that moves."""
    members, keys = study.searched()
    objective = {fit.variant: fit.objective for fit in study.fits}
    with style.settings():
        title = "Search: distance from the printed tables, 128 entries"
        figure, axes = page(title, 1, len(keys), 3.0, 3.3 * len(keys) + 0.6)
        laws = [str(study.variants[v].values.get("contact.law", study.joint.contact.law)) for v in members]
        for ax, key in zip(axes, keys, strict=True):
            values = np.array([float(study.variants[v].values[key]) for v in members])
            x, _, label = axis_of(study, paper_choices.Sweep("", key, values, np.array(members)))
            for law in dict.fromkeys(laws):
                marker, colour = LAWS[law]
                chosen = [i for i, name in enumerate(laws) if name == law]
                y = [objective[members[i]] for i in chosen]
                ax.plot(x[chosen], y, ls="", marker=marker, ms=5, mfc="none", color=colour)
            ax.axhline(paper_choices.no_effect(), color=style.FAINT, ls=(0.0, (1.0, 2.0)), lw=1.3)
            _distance_scale(ax)
            ax.set_xlabel(label)
        axes[0].set_ylabel("distance [points]")
        used = list(dict.fromkeys(laws))
        handles: list[Artist] = [Line2D([], [], ls="", marker=LAWS[n][0], mfc="none", color=LAWS[n][1]) for n in used]
        handles.append(Line2D([], [], color=style.FAINT, lw=1.3, ls=(0.0, (1.0, 2.0))))
        _foot(figure, handles, [*(f"law {name}" for name in used), "distance if errors did nothing"])
    return figure


def _foot(figure: Figure, handles: list[Artist], labels: list[str]) -> None:
    figure.legend(
        handles, labels, loc="lower center", ncols=len(labels), fontsize=9.5, handlelength=3.0, columnspacing=1.6
    )
