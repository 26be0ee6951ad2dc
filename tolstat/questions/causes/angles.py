"""Which errors make a load scatter at which input angle."""

from __future__ import annotations

import math
from collections.abc import Container, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated

import numpy as np

from tolstat.common.channels import CHANNELS
from tolstat.common.errors import NotApplicable
from tolstat.common.loads import FloatArray, unit_text
from tolstat.common.tables import VALID
from tolstat.display import drawing, style
from tolstat.display.answer import Answer, Part, Sentence, Table
from tolstat.display.asked import Asked
from tolstat.display.blocks import Panel, Panels
from tolstat.display.options import Load, Opt, Top
from tolstat.display.table import Column, Row
from tolstat.display.text import ends
from tolstat.questions.causes.revolution import JOINTS, MIN_JOINTS, AgainstAngle, against_angle
from tolstat.store.view import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINES = 4
"""Number of errors whose share is drawn."""
LOADS = ("5 to 95 % of the joints", "median", "without errors")
"""Labels of the lines of a load."""
ORIGIN = {
    "stored": "from the histories in the file",
    "harmonics": "restored from the harmonics in the file",
    "simulated again": "simulated again, since the file holds no histories",
}
OVER_REVOLUTION = "Share of the variance over the whole revolution, every angle weighted by its variance"

COLUMNS = (
    Column("load", lambda row: str(row["load"]), shown=lambda rows: len({row["load"] for row in rows}) > 1),
    Column("error", lambda row: str(row["error"]), words=True),
    Column("revolution, %", lambda row: _percent(row["share"])),
    Column("95 % interval", lambda row: ends(100.0 * row["share_lower"], 100.0 * row["share_upper"], ".1f")),
    Column("largest, %", lambda row: _percent(row["largest"])),
    Column("at, deg", lambda row: f"{math.degrees(row['theta']):.0f}"),
)
"""Columns of the table ``revolution``."""


def angles(
    view: View,
    by: Load = None,
    joints: Annotated[int, Opt("N", least=MIN_JOINTS)] = JOINTS,
    top: Top = 12,
    logarithm: bool = False,
) -> Answer:
    """Compute which errors scatter a load at each angle.

    Gives for each error the share of the load's variance that it explains alone, over the whole revolution and at the
    angle of its largest share (first-order Sobol' indices). With --out writes the shares at each angle, and pictures.
    Joints are simulated again if FILE has no load histories.

    Example: tolstat angles iso2768_f.h5 --by cross1.F

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances, all of the same weight.
    by : str, optional
        Force or torque, such as cross1.F or output.moment; by default the load whose limit most joints exceed.
    joints : int
        Number of joints used, the first settled ones.
    top : int
        Number of errors in the printed table.
    logarithm : bool
        Explain the variance of the load's logarithm instead of the load's.

    Returns
    -------
    Answer
        Table ``revolution``, one row per error: ``load``, ``error``, ``share`` with ends, ``largest`` share at any
        angle, at ``theta``. Table ``angles``, one row per angle and error: ``theta``, ``load``, ``unit``, ``std``,
        ``error``, ``share`` with ends.

    Raises
    ------
    InputError
        When a name is not a load over the input angle.
    StoreError
        See `against_angle`.
    """
    view, load = view.narrowed(by or view.most_exceeded)
    (found,) = against_angle(view, [load], joints, (load,) if logarithm else ())
    facts = {key: getattr(found, key) for key in ("load", "unit", "logarithm", "joints", "origin", "apart")}
    facts["additive"] = _additive(found)
    parts: list[Part] = [
        Panels(_panels(found)),
        _table([found], found.names[:top]),
        Table("angles", "Shares at each input angle", (), _angle_rows(found), {"theta": "rad"}),
        Sentence(_note([found])),
    ]
    return Answer("angles", "Causes over the input angle", parts, facts)


def angles_on_page(view: View, asked: Asked) -> Answer:
    """Causes of the leading loads over the input angle; of a load with a long tail, those of its logarithm."""
    followed = [load for load in view.leading if load in CHANNELS]
    cannot = view.method == "sweep" or not view.count(*VALID) or view.design.refuses("index") or view.study.groups
    if cannot or not (asked.replay and followed) or len(view.points) > 1:  # histories are those of one point
        raise NotApplicable
    with asked.noting("nothing over the input angle"):
        logarithmic = {load.name for load in view.loads(view.leading) if load.long_tailed}
        found = against_angle(view, followed, asked.replay, logarithmic)
        panels = Panels([panel for angle in found for panel in _panels(angle)])
        drawn = {name for angle in found for name in angle.names[:LINES]}
        parts: list[Part] = [panels, _table(found, drawn), Sentence(_note(found))]
        return Answer("angles", "Causes over the input angle", parts)
    raise NotApplicable


def closed(values: FloatArray) -> FloatArray:
    """Append the first sample of a revolution to its end."""
    return np.concatenate([values, values[..., :1]], axis=-1)


def theta_axis(ax: Axes, theta: FloatArray) -> FloatArray:
    """Set up the x axis for input angles; return the angles in degrees, with 360 appended."""
    ax.set(xlim=(0.0, 360.0), xticks=range(0, 361, 60), xlabel="input shaft angle θ [deg]")
    return np.append(np.degrees(theta), 360.0)


def _overall_rows(found: AgainstAngle) -> list[Row]:
    rows: list[Row] = []
    for i, name in enumerate(found.names):
        share, low, high = (float(part[i]) for part in found.overall[:3])
        k = int(np.argmax(found.first.estimate[i]))
        head = {"load": found.load, "error": name, "share": share, "share_lower": low, "share_upper": high}
        rows.append({**head, "largest": float(found.first.estimate[i, k]), "theta": float(found.angles[k])})
    return rows


def _angle_rows(found: AgainstAngle) -> list[Row]:
    theta, std, shares = found.angles.tolist(), np.sqrt(found.first.variance).tolist(), found.first[:3]
    return [
        {"theta": theta[k], "load": found.load, "unit": found.unit, "std": std[k], "error": name}
        | {f"share{end}": float(part[i, k]) for end, part in zip(("", "_lower", "_upper"), shares, strict=True)}
        for k in range(len(theta))
        for i, name in enumerate(found.names)
    ]


def _percent(share: float) -> str:
    return f"{round(100.0 * share, 1) + 0.0:.1f}"  # no -0


def _table(found: Sequence[AgainstAngle], shown: Container[str]) -> Table:
    """Shares over the revolution; people see those of the errors `shown`."""
    rows = [row for angle in found for row in _overall_rows(angle)]
    seen = [row for row in rows if row["error"] in shown]
    return Table("revolution", OVER_REVOLUTION, COLUMNS, rows, {"theta": "rad"}, seen)


def _additive(angle: AgainstAngle) -> float:
    """Share of the variance over the revolution that all errors explain alone."""
    return float(np.nansum(angle.overall.estimate))


def _note(found: Sequence[AgainstAngle]) -> str:
    """Sums of the shares, joints, source of the histories, bias correction."""
    first = found[0]
    alone = ", ".join(f"{100 * _additive(angle):.0f} % of the variance of {angle.quantity}" for angle in found)
    sentences = (
        f"All errors alone explain {alone}. Over the input angle: the first {first.joints} settled joints, "
        f"{ORIGIN[first.origin]}; bands are the 95 % intervals at each angle. Shares are corrected for chance: an "
        "error without effect has the mean share 0, and its estimate may be negative."
    )
    if first.apart:
        sentences += (
            f" The largest loads differ by up to {first.apart:.1e} (relative) from the stored ones, which another "
            "machine or version computed."
        )
    return sentences


def _panels(angle: AgainstAngle) -> list[Panel]:
    """Load over the revolution, and shares of its variance."""
    key, unit, middle = angle.load, unit_text(angle.unit), angle.spread[1]
    estimates = list(zip(angle.names, angle.overall.estimate, strict=True))
    top = ", ".join(f"{name} {100 * share:.1f} %" for name, share in estimates[:LINES])
    return [
        Panel(
            f"angle-{key}",
            f"{angle.load} over the revolution",
            f"Median of the joints between {middle.min():.4g} and {middle.max():.4g} {unit} over the input angle; "
            f"95 % of the joints stay below {angle.spread[2].max():.4g} {unit} everywhere",
            partial(_draw_loads, angle=angle),
            (4.9, 3.1),
            top=drawing.legend_room(LOADS),
        ),
        Panel(
            f"angle-shares-{key}",
            f"{angle.quantity}: share of the variance over the input angle",
            f"Over the whole revolution: {top}",
            partial(_draw_shares, angle=angle),
            (4.9, 3.1),
            top=drawing.legend_room(angle.names[:LINES]),
        ),
    ]


def _draw_loads(ax: Axes, angle: AgainstAngle) -> None:
    """Draw a load over the revolution: nominal joint, median and 5 to 95 % band of the others."""
    theta = theta_axis(ax, angle.angles)
    low, middle, high = closed(angle.spread)
    ax.fill_between(theta, low, high, color=style.COLOURS[0], alpha=0.2, lw=0, label=LOADS[0])
    ax.plot(theta, middle, color=style.COLOURS[0], label=LOADS[1])
    if np.isfinite(angle.nominal).all():
        ax.plot(theta, closed(angle.nominal), color=style.INK, lw=1.0, ls=(0.0, (4.0, 2.0)), label=LOADS[2])
    ax.set_ylabel(f"|{angle.load}| [{unit_text(angle.unit)}]")
    ax.set_ylim(0.0, 1.05 * max(high.max(), np.nan_to_num(angle.nominal).max()))
    drawing.legend_above(ax, *ax.get_legend_handles_labels())


def _draw_shares(ax: Axes, angle: AgainstAngle) -> None:
    """Draw the shares of the variance of the `LINES` errors with the largest share over the revolution."""
    theta = theta_axis(ax, angle.angles)
    ceiling = 0.0
    for i, name in enumerate(angle.names[:LINES]):
        share, low, high = (100.0 * closed(part[i]) for part in angle.first[:3])
        if np.isfinite(low).all():
            ax.fill_between(theta, low, high, color=style.COLOURS[i], alpha=0.15, lw=0)
        ax.plot(theta, share, color=style.COLOURS[i], ls=style.DASHES[i], label=name)
        ceiling = max(ceiling, float(np.nanmax(np.where(np.isfinite(high), high, share), initial=0.0)))
    ax.set(ylim=(0.0, 1.05 * max(ceiling, 1.0)), ylabel="share of the variance [%]")
    drawing.legend_above(ax, *ax.get_legend_handles_labels())
