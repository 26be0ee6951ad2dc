"""Modules of matplotlib, each imported when it is first used: ``lines.Line2D`` imports `matplotlib.lines`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tolstat.common.late import Late

if TYPE_CHECKING:
    import matplotlib as mpl
    from matplotlib import figure, lines, markers, patches, ticker
else:
    mpl = Late("matplotlib")
    figure, lines, markers, patches, ticker = (
        Late(f"matplotlib.{name}") for name in ("figure", "lines", "markers", "patches", "ticker")
    )

__all__ = ["figure", "lines", "markers", "mpl", "patches", "ticker"]
