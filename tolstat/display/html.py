"""Blocks as HTML: the environment of the templates, pictures as inline SVG, an answer in a notebook."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

import tolstat
from tolstat.common.cores import mapped
from tolstat.common.files import write_text
from tolstat.display import drawing, style, unseen
from tolstat.display.blocks import Block, Decision, Page, Panel, Panels
from tolstat.display.text import sentence

TEMPLATES = Path(__file__).parent / "templates"

_TORQUE = re.compile(r"\bN m\b")
_INSIDE = re.compile(r"(?<=\d) (?=(?:k?N|mm|[µu]m|m?rad|deg|rpm|rad/s|[MG]Pa|ms|min|[smh])\b|[%°])|(?<=<) (?=\d)")


def environment(figure: Callable[[Panel], dict[str, Any]]) -> jinja2.Environment:
    """Make the Jinja environment of the templates: inserted values are escaped, unseen characters shown.

    Parameters
    ----------
    figure : callable
        Picture of a panel, as `figures` gives it.
    """
    files = jinja2.FileSystemLoader(TEMPLATES)
    templates = jinja2.Environment(loader=files, autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_shown)
    templates.globals |= {"figure": figure, "schemes": Markup(style.style_sheet())}
    templates.filters |= {"data": _data, "grouped": grouped, "bound": bound, "sentence": sentence}
    templates.filters["kind"] = lambda block: type(block).__name__
    return templates


def fragment(title: str, blocks: Sequence[Block]) -> str:
    """Blocks as an element for notebooks, with their style."""
    templates = environment(figures(blocks, 1))
    return templates.get_template("fragment.html.j2").render(title=title, blocks=blocks)


def figures(blocks: Sequence[Block], processes: int) -> Callable[[Panel], dict[str, Any]]:
    """Draw the pictures of some blocks; the function returned gives a panel's ``svg`` and the ``frame`` of its axes."""
    panels = [panel for block in blocks for panel in _panels(block)]
    drawn = zip(panels, mapped([partial(drawing.svg, panel) for panel in panels], processes), strict=True)
    pictures = {p.key: {"svg": Markup(svg), "frame": " ".join(f"{x:.7g}" for x in frame)} for p, (svg, frame) in drawn}
    return lambda panel: pictures[panel.key]


def grouped(words: str) -> str:
    """Group the digits of whole numbers from 10 000 on by narrow spaces."""
    return re.sub(r"(?<![\w.])\d{5,}(?!\w)", lambda number: f"{int(number[0]):,}".replace(",", "\u202f"), words)


def bound(words: str) -> str:
    """Keep numbers with their signs and units, and intervals, on one line: no-break spaces in them."""
    words = _INSIDE.sub("\u00a0", _TORQUE.sub("N\u00a0m", words))
    return words.replace(" .. ", "\u00a0..\u00a0")


def _panels(block: Block) -> Sequence[Panel]:
    if isinstance(block, Panels):
        return block.panels
    return [panel for panel in (block.chart, block.picture) if panel] if isinstance(block, Decision) else []


def _data(value: Any) -> Markup:
    """JSON for a script element, escaped so that no string can close the element."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"), ensure_ascii=True)
    return Markup(text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026"))


def _shown(value: Any) -> Any:
    return unseen.visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value


POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'; script-src {}"
)
"""Content-Security-Policy: nothing is loaded or sent; pictures and page have styles of their own."""


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
    drawn = figures([block for section in page.sections for block in section.blocks], processes)
    script = page.wording((TEMPLATES / "page.js").read_text(encoding="utf-8"))
    template = environment(drawn).get_template("page.html.j2")
    text = template.render(
        page=page, version=tolstat.__version__, script=Markup(script), policy=POLICY.format(allowed(script))
    )
    write_text(path, text)


def allowed(script: str) -> str:
    """Source of a Content-Security-Policy that lets one script run: its SHA-256."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
