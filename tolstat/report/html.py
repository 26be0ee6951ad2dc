"""The page as one self-contained HTML file: styles, pictures and script are embedded."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from markupsafe import Markup

import tolstat
from tolstat.common.files import atomic_write
from tolstat.display import drawing
from tolstat.display.blocks import Page, Panel
from tolstat.report import templates


def write(page: Page, path: Path) -> None:
    """Write a page; the same page gives the same bytes.

    Parameters
    ----------
    page : Page
        The page.
    path : Path
        HTML file.
    """
    environment = templates.environment()
    environment.globals["figure"] = _figure
    environment.filters["data"] = _data
    text = environment.get_template("page.html.j2").render(page=page, version=tolstat.__version__)
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _figure(panel: Panel) -> dict[str, Any]:
    picture, frame = drawing.svg(panel)
    return {"svg": Markup(picture), "frame": " ".join(f"{x:.7g}" for x in frame)}


def _data(value: Any) -> Markup:
    """JSON for a script element, escaped so that no string can close the element."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"), ensure_ascii=True)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))
