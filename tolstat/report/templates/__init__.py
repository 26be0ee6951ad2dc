"""Templates of the pages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from tolstat.display.unseen import visible

FOLDER = Path(__file__).parent


def environment() -> jinja2.Environment:
    """Make the Jinja environment of the templates: inserted values are escaped, unseen characters shown."""
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(FOLDER), autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_shown
    )


def _shown(value: Any) -> Any:
    return visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value
