"""Shares of the errors in a load against the shaft angle: text and pictures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tolstat.common.loads import FloatArray, unit_text
from tolstat.display import style
from tolstat.display.table import Column

if TYPE_CHECKING:
    from tolstat.questions.causes.angles import AgainstAngle

LINES = 4
"""Number of errors whose share is drawn."""
LOADS = ("5 to 95 % of the joints", "median", "without errors")
"""Labels of the lines of a load."""
LONG = 16
"""Names with more letters do not fit side by side."""
ORIGIN = {
    "stored": "from the histories in the file",
    "harmonics": "restored from the harmonics in the file",
    "simulated again": "simulated again, since the file holds no histories",
}


COLUMNS = (
    Column("error", lambda row: str(row["error"])),
    Column("revolution, %", lambda row: f"{row['share']:.1f}"),
    Column("95 % interval", lambda row: "-" if np.isnan(row["lower"]) else f"{row['lower']:.1f} .. {row['upper']:.1f}"),
    Column("largest, %", lambda row: f"{row['largest']:.1f}"),
    Column("at, deg", lambda row: f"{row['angle']:.0f}"),
)
"""Columns of the table `rows`."""


def rows(found: AgainstAngle, shown: int = 12) -> pd.DataFrame:
    """Shares, per cent, of the `shown` errors with the largest over the revolution, and the angle of its maximum."""
    own = []
    for i, name in enumerate(found.names[:shown]):
        share, low, high = (100.0 * part[i] for part in found.overall[:3])
        k = int(np.argmax(found.first.estimate[i]))
        head = {"error": name, "share": share, "lower": low, "upper": high}
        own.append({**head, "largest": 100.0 * found.first.estimate[i, k], "angle": np.degrees(found.angles[k])})
    return pd.DataFrame(own)


def note(found: AgainstAngle, log: bool = False) -> str:
    """Notes to the shares: joints, source of the histories, bias correction."""
    said = f"Against the shaft angle: the first {found.joints} settled joints, {ORIGIN[found.origin]}; bands are the "
    said += f"95 % intervals at each angle. Shares{' of the variance of the logarithm' if log else ''} are corrected "
    said += "for chance: an error without effect has the mean share 0, and its estimate may be negative."
    if found.apart:
        said += f" The largest loads differ by up to {found.apart:.1e} (relative) from the stored ones, which another "
        said += "machine or version computed."
    return said


def save(found: AgainstAngle, log: bool, path: Path) -> list[Path]:
    """Draw the load above the shares; return the file written, in the format that the suffix of `path` names."""
    with style.settings():
        figure = Figure(figsize=(8.0, 7.6), layout="constrained")
        upper, lower = figure.subplots(2, 1)
        upper.set_title(f"{found.load} over the revolution, {found.joints} joints")
        loads(upper, found)
        _inside(upper, 3)
        lower.set_title(f"Share of the variance of {'log ' if log else ''}{found.load} that each error explains alone")
        shares(lower, found)
        _inside(lower, 1 if any(len(name) > LONG for name in found.names[:LINES]) else 2)
    return style.save(figure, path.with_suffix(""), (path.suffix,))


def _inside(ax: Axes, columns: int) -> None:
    """Put a legend into the axes, above what is drawn."""
    rows = -(-len(ax.get_legend_handles_labels()[1]) // columns)
    ax.set_ylim(0.0, (1.0 + 0.14 * rows) * ax.get_ylim()[1])
    ax.legend(loc="upper right", ncols=columns, columnspacing=1.2)


def closed(values: FloatArray) -> FloatArray:
    """Append the first sample of a revolution to its end."""
    return np.concatenate([values, values[..., :1]], axis=-1)


def theta_axis(ax: Axes, angles: FloatArray) -> FloatArray:
    """Set up the x axis for shaft angles; return the angles in degrees, with 360 appended."""
    ax.set(xlim=(0.0, 360.0), xticks=range(0, 361, 60), xlabel="input shaft angle θ [deg]")
    return np.append(np.degrees(angles), 360.0)


def loads(ax: Axes, angle: AgainstAngle) -> None:
    """Draw a load over the revolution: nominal joint, median and 5 to 95 % band of the others."""
    theta = theta_axis(ax, angle.angles)
    low, middle, high = closed(angle.spread)
    ax.fill_between(theta, low, high, color=style.COLOURS[0], alpha=0.2, lw=0, label=LOADS[0])
    ax.plot(theta, middle, color=style.COLOURS[0], label=LOADS[1])
    if np.isfinite(angle.nominal).all():
        ax.plot(theta, closed(angle.nominal), color=style.INK, lw=1.0, ls=(0.0, (4.0, 2.0)), label=LOADS[2])
    ax.set_ylabel(f"|{angle.load}| [{unit_text(angle.unit)}]")
    ax.set_ylim(0.0, 1.05 * max(high.max(), np.nan_to_num(angle.nominal).max()))


def shares(ax: Axes, angle: AgainstAngle) -> None:
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
