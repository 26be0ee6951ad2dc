"""Figure, table and page of a comparison."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, NullFormatter

from studies.precision.measuring import markdown, versions
from studies.precision.points import build, cost, leaders
from studies.precision.runs import Run
from studies.precision.setup import Setup
from tolstat.common.files import atomic_write, write_text
from tolstat.display import style, table

OWN_MARKERS = ("o", "s", "D", "v", "*", "P")
OWN_COLOURS = ("#0072B2", "#0072B2", "#0072B2", "#56B4E9", "#56B4E9", style.INK)
OTHERS = {
    "Radau": ("#D55E00", "^"),
    "BDF": ("#009E73", "<"),
    "LSODA": ("#CC79A7", ">"),
    "CVODE": ("#E69F00", "X"),
    "Exudyn": ("#8C8C8C", "p"),
}
"""Colours of Okabe and Ito (2008), and a grey; each code has a marker of its own too."""
LABELS = {"loads": "largest loads of bushings and shafts", "contact": "largest contact force", "psi": "largest |Ψ|"}
LEVELS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
"""Errors whose cost is tabulated, as far as they exceed the truth's own error."""
TOP = 2.0
"""Errors above this are drawn at it, with a cross."""
FLOOR = 1e-7
"""Errors below this are drawn at it."""


def write(runs: Sequence[Run], setup: Setup, stem: Path) -> str:
    """Write page, table of all points and figure.

    Parameters
    ----------
    runs : sequence of Run
        Measured runs.
    setup : Setup
        The comparison.
    stem : Path
        The files' name without ending.

    Returns
    -------
    str
        Table of the fastest contenders at each error.

    Raises
    ------
    InputError
        When no joint has a truth to compare with.
    """
    points, truth = build(runs)
    count = len({run.joint for run in runs})
    steps, rtol, others = setup.tolstat.steps_per_rev, setup.others.rtol, setup.others
    exudyn = points["contender"].str.startswith("Exudyn").any()
    fixed = f", Exudyn: {others.steps_per_rev[0]} to {others.steps_per_rev[-1]} steps" if exudyn else ""
    subtitle = (
        f"{count} joints of {Path(setup.study).name} (seed {setup.seed}), {len(truth)} of them with a truth. "
        f"tolstat: {steps[0]} to {steps[-1]} steps a revolution; others: rtol {rtol[0]:.0e} to {rtol[-1]:.0e}{fixed},\n"
        f"{others.revolutions} revolutions, at most {others.limit:g} s. {versions()}"
    )
    style.save(figure(points, truth, subtitle), stem)
    with atomic_write(stem.with_suffix(".csv")) as temporary:
        points.to_csv(temporary, index=False, float_format="%.4g", encoding="utf-8", lineterminator="\n")
    write_text(stem.with_suffix(".md"), page(points, truth, subtitle, f"{stem.name}.png"))
    ahead = _ahead(points, truth, "loads")
    rows = ahead.to_dict("records")
    return table.fitted(table.plain(rows), rows)[0]


def short(runs: Sequence[Run]) -> str:
    """Markdown table of the fastest contenders at each error of the median joint, with ratios for the worst joint."""
    points, truth = build(runs)
    worst = _ahead(points, truth, "loads_worst")[["error", "times ahead"]]
    table = _ahead(points, truth, "loads").merge(worst, "left", "error", suffixes=("", ", worst joint"))
    return _markdown(table)


def figure(points: pd.DataFrame, truth: pd.DataFrame, subtitle: str) -> Figure:
    """Draw error against core time.

    Parameters
    ----------
    points, truth : DataFrame
        As `points.build` makes them.
    subtitle : str
        Description of the measurement.

    Returns
    -------
    Figure
        Large panel for the loads, small ones for contact force and Psi. A ring marks settings at which steps were
        halved, a cross those at which joints failed or ran over time (at the upper edge if the median is infinite).
    """
    with style.settings():
        page = Figure(figsize=(11.0, 7.6))
        grid = page.add_gridspec(2, 2, width_ratios=(2.1, 1.0))
        page.subplots_adjust(left=0.075, right=0.985, top=0.84, bottom=0.225, hspace=0.38, wspace=0.2)
        page.text(0.02, 0.972, "Speed against error", fontsize=15, fontweight="bold", va="top")
        page.text(0.02, 0.927, subtitle, fontsize=9.5, color="#444444", va="top", linespacing=1.45)
        places = {"loads": grid[:, 0], "contact": grid[0, 1], "psi": grid[1, 1]}
        looks = _looks(points)
        for kind, place in places.items():
            ax = page.add_subplot(place)
            _panel(ax, points, float(truth[kind].median()), kind, looks)
        _legend(page, looks)
    return page


def page(points: pd.DataFrame, truth: pd.DataFrame, subtitle: str, image: str) -> str:
    """Compose the page in Markdown: figure, fastest contenders at each error, cost of an error."""
    own_error = f"median {truth['loads'].median():.0e}, worst {truth['loads'].max():.0e}"
    costs = cost(points, "loads", _levels(truth, "loads")).drop(columns="ours")
    parts = [
        "# Speed against error",
        subtitle.replace("\n", " "),
        f"![Error against core time]({image})",
        _EXPLANATION.format(own_error=own_error),
        "## Fastest at each error",
        "The cheapest setting measured whose error of the largest loads of bushings and shafts of the median joint is "
        "not larger; times in milliseconds of one core a joint. –: no setting reaches the error. Errors below the "
        "truth's own are left out.",
        _markdown(_ahead(points, truth, "loads")),
        "The same for the error of the worst joint; the time is still the median over the joints:",
        _markdown(_ahead(points, truth, "loads_worst")),
        "## Cost of an error",
        "Milliseconds of one core a joint, by error of the median joint.",
        _markdown(costs.set_axis(["", *(f"{level:.0e}" for level in costs.columns[1:])], axis=1)),
        "All points are in [`precision.csv`](precision.csv). `setting`: steps a revolution or rtol. `failed`, "
        "`over_time`: number of joints. `ms`: median over the joints. `loads`, `contact`, `psi`: error of the median "
        "joint; `loads_worst`: that of the worst. `halvings`, `rates`: mean number of halved steps and of calls of the "
        "right-hand side.",
    ]
    return "\n\n".join(parts) + "\n"


_EXPLANATION = """\
Every integrator has the same task: from the equilibrium of the loaded joint at θ = 0 to the largest loads of a settled
revolution. tolstat computes this equilibrium itself and integrates until the closure is below `solver.settle_tol`. The
others get the equilibrium at no cost and integrate a fixed number of revolutions; their own interpolation gives the
loads at 2880 angles of the last one. Their absolute tolerance is `rtol` times 0.1 mm (0.1 mrad) and 1 m/s (1 rad/s).
Exudyn takes part where it is installed: its generalised α with equal steps, reduced where Newton's
iteration fails; the loads are those at its own steps.
They call the same compiled accelerations, without Numba's check of the argument types, and use a Jacobian from finite
differences or the compiled one ("our Jacobian"). Times are CPU times of processes with one thread, without compilation:
of tolstat the median of repeated calls, of the others one call. "Uniform" is tolstat with uniform steps alone, without
the closer look at peaks and without refinement: they help the joints whose contacts ring.

The truth is a reference solution by scipy's Radau, which starts in the settled state and integrates until the largest
loads repeat within 1e-5 (`tolstat.solver.reference`). With the next looser tolerance its largest loads differ by
{own_error}; smaller errors have no meaning. Errors are relative to the largest load of the kind in the joint, and the
worst bushing counts. Points are medians over the joints."""


def _looks(points: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """Colour, marker and line of each contender."""
    looks: dict[str, dict[str, Any]] = {}
    for name, ours in points[["contender", "ours"]].drop_duplicates().itertuples(index=False):
        if ours:
            k = sum(str(look["label"]).startswith("tolstat") for look in looks.values())
            dash = style.DASHES[k % 4] if k < 3 else "-"
            colour, marker = OWN_COLOURS[k % 6], OWN_MARKERS[k % 6]
            looks[name] = {"color": colour, "marker": marker, "linestyle": dash, "label": f"tolstat {name}"}
        else:
            code, _, jacobian = str(name).partition(",")
            colour, marker = OTHERS[code]
            fill = {} if jacobian else {"markerfacecolor": "white", "linestyle": (0.0, (2.0, 1.5))}
            looks[name] = {"color": colour, "marker": marker, "linestyle": "-", "label": name, **fill}
    return looks


def _panel(ax: Axes, points: pd.DataFrame, floor: float, kind: str, looks: dict[str, dict[str, Any]]) -> None:
    main = kind == "loads"
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_title(f"Error of {LABELS[kind]}", fontsize=11 if main else 10)
    for first, name in enumerate(looks):
        group = points[points["contender"] == name]
        errors = group[kind].clip(lower=FLOOR)
        good = errors.map(math.isfinite) & (errors <= TOP)
        ax.plot(
            group["ms"].where(good), errors.where(good), ms=6.5 if main else 4, lw=1.5 if main else 1.0, **looks[name]
        )
        halved = group[good & (group["halvings"] > 0)]
        ax.plot(
            halved["ms"],
            halved[kind].clip(lower=FLOOR),
            "o",
            ms=12 if main else 8,
            mfc="none",
            mec=style.FAINT,
            mew=0.8,
        )
        if main and first == 0:
            _steps(ax, group[good & (errors > 3 * floor)])
        lame = group[(group["failed"] + group["over_time"] > 0) | (errors > TOP)]
        at = lame[kind].clip(lower=FLOOR, upper=TOP)
        ax.plot(lame["ms"], at, "x", ms=9 if main else 6, color=looks[name]["color"], mew=1.6, clip_on=False, zorder=4)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(FuncFormatter(_power))
        axis.set_minor_formatter(NullFormatter())
    ax.set_ylim(top=TOP)
    low = ax.get_ylim()[0]
    if 0 < floor < TOP:
        low = min(low, 0.5 * floor)
    ax.axhspan(low, max(floor, low), color="#F0F0F0", zorder=0)
    ax.set_ylim(low, TOP)
    ax.set_xlabel("core time a joint [ms]")
    if main:
        ax.set_ylabel("error (median over the joints) [1]")
        across = ax.get_yaxis_transform()
        ax.text(0.01, max(floor, low), "the truth's own error", transform=across, va="top", fontsize=9)


def _steps(ax: Axes, group: pd.DataFrame) -> None:
    """Write the steps a revolution beside the points of a curve of the solver."""
    for ms, error, steps in group[["ms", "loads", "setting"]].itertuples(index=False):
        at = (ms, max(error, FLOOR))
        ax.annotate(f"{steps:g}", at, (-9, -9), textcoords="offset points", fontsize=7.5, ha="right", color=style.INK)


def _power(value: float, _: int) -> str:
    exponent = round(math.log10(value))
    if -2 < exponent < 3:
        return f"{value:g}"
    return "10" + str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def _legend(page: Figure, looks: dict[str, dict[str, Any]]) -> None:
    handles = [Line2D([], [], ms=6.5, lw=1.5, **look) for look in looks.values()]
    ring: dict[str, Any] = {"marker": "o", "mfc": "none", "mec": style.FAINT, "ls": "none"}
    handles.append(Line2D([], [], ms=11, label="steps were halved", **ring))
    handles.append(
        Line2D([], [], ls="none", marker="x", ms=8, color=style.INK, label="failed, over time or off the scale")
    )
    page.legend(handles=handles, loc="lower center", ncols=4, bbox_to_anchor=(0.5, 0.005), handlelength=3.0, fontsize=9)


def _levels(truth: pd.DataFrame, error: str) -> list[float]:
    own = truth["loads"].median() if error == "loads" else truth["loads"].max()
    return [level for level in LEVELS if level > own]


def _ahead(points: pd.DataFrame, truth: pd.DataFrame, error: str) -> pd.DataFrame:
    """`leaders` with its columns named for readers."""
    found = leaders(cost(points, error, _levels(truth, error)))
    return found.set_axis(["error", "tolstat", "ms", "best other", "its ms", "times ahead"], axis=1)


def _markdown(table: pd.DataFrame) -> str:
    return markdown([list(table.columns), *([_text(x) for x in row] for row in table.itertuples(index=False))])


def _text(x: Any) -> str:
    if not isinstance(x, float):
        return str(x) or "–"
    if not math.isfinite(x):
        return "–"
    return f"{x:.1e}".replace(".0e", "e") if 0 < x < 0.01 else f"{x:.3g}" if x < 1000 else f"{x:.0f}"
