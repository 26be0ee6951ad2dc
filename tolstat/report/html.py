"""The page as one self-contained HTML file: styles, pictures and script are embedded, and no other script runs."""

from __future__ import annotations

import base64
import hashlib
from pathlib import Path

from markupsafe import Markup

import tolstat
from tolstat.common.files import atomic_write
from tolstat.display.blocks import Page
from tolstat.display.html import TEMPLATES, environment, figures

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
    script = (TEMPLATES / "page.js").read_text(encoding="utf-8")
    template = environment(drawn).get_template("page.html.j2")
    text = template.render(
        page=page, version=tolstat.__version__, script=Markup(script), policy=POLICY.format(allowed(script))
    )
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def allowed(script: str) -> str:
    """Source of a Content-Security-Policy that lets one script run: its SHA-256."""
    return f"'sha256-{base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()}'"
