"""The page as one self-contained HTML file: styles, pictures and script are embedded, and no other script runs."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from markupsafe import Markup

import tolstat
from tolstat.common.aside import mapped
from tolstat.common.files import atomic_write
from tolstat.display import drawing, schemes
from tolstat.display.blocks import Block, Decision, Page, Panel, Panels
from tolstat.report import templates

POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; script-src {}"
)
"""Content-Security-Policy: nothing is loaded or sent; pictures and page have styles of their own."""

_TORQUE = re.compile(r"\bN m\b")
_BEFORE_UNIT = re.compile(r"(?<=\d) (?=(?:k?N|mm|[µu]m|m?rad|deg|rpm|rad/s|[MG]Pa|ms|min|[smh])\b|[%°])")


def write(page: Page, path: Path, processes: int = 1) -> None:
    """Write a page; the same page gives the same bytes, with any number of processes.

    Parameters
    ----------
    page : Page
        The page.
    path : Path
        HTML file.
    processes : int
        Number of processes that draw pictures.
    """
    panels = [panel for section in page.sections for block in section.blocks for panel in _panels(block)]
    drawn = mapped([partial(_figure, panel) for panel in panels], processes)
    figures = {panel.key: figure for panel, figure in zip(panels, drawn, strict=True)}
    environment = templates.environment()
    environment.globals["figure"] = lambda panel: figures[panel.key]
    environment.filters |= {"data": _data, "grouped": grouped, "bound": bound}
    script = (templates.FOLDER / "page.js").read_text(encoding="utf-8")
    text = environment.get_template("page.html.j2").render(
        page=page,
        version=tolstat.__version__,
        script=Markup(script),
        schemes=Markup(schemes.style_sheet()),
        policy=POLICY.format(allowed(script)),
    )
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def allowed(script: str) -> str:
    """Source of a Content-Security-Policy that lets one script run: its SHA-256."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"


def grouped(words: str) -> str:
    """Group the digits of whole numbers from 10 000 on by narrow spaces."""
    return re.sub(r"(?<![\w.])\d{5,}(?!\w)", lambda found: f"{int(found[0]):,}".replace(",", "\u202f"), words)


def bound(words: str) -> str:
    """Keep numbers with their units, and intervals, on one line: no-break spaces in them."""
    words = _BEFORE_UNIT.sub("\u00a0", _TORQUE.sub("N\u00a0m", words))
    return words.replace(" .. ", "\u00a0..\u00a0")


def _panels(block: Block) -> Sequence[Panel]:
    if isinstance(block, Panels):
        return block.panels
    return [block.picture] if isinstance(block, Decision) and block.picture else []


def _figure(panel: Panel) -> dict[str, Any]:
    picture, frame = drawing.svg(panel)
    return {"svg": Markup(picture), "frame": " ".join(f"{x:.7g}" for x in frame)}


def _data(value: Any) -> Markup:
    """JSON for a script element, escaped so that no string can close the element."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"), ensure_ascii=True)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))
