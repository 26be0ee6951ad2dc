"""Templates of the pages."""

from __future__ import annotations

import jinja2


def environment() -> jinja2.Environment:
    """Make the Jinja environment of the templates; inserted values are escaped."""
    loader = jinja2.PackageLoader("tolstat.report", "templates")
    return jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
