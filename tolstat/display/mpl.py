"""Modules of matplotlib, each imported when it is first used: ``lines.Line2D`` imports `matplotlib.lines`."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import matplotlib as mpl
    from matplotlib import figure, lines, markers, patches, ticker
else:

    class _Late:
        """A module that is imported when one of its attributes is read."""

        def __init__(self, name: str) -> None:
            self._name = name

        def __getattr__(self, attribute: str) -> Any:
            return getattr(import_module(self._name), attribute)

    mpl = _Late("matplotlib")
    figure, lines, markers, patches, ticker = (
        _Late(f"matplotlib.{name}") for name in ("figure", "lines", "markers", "patches", "ticker")
    )

__all__ = ["figure", "lines", "markers", "mpl", "patches", "ticker"]
