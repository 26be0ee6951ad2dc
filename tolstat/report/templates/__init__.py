"""Templates of the pages."""

from __future__ import annotations

import jinja2


def environment() -> jinja2.Environment:
    """Make an environment that reads them; what is put into a page is escaped."""
    loader = jinja2.PackageLoader("tolstat.report", "templates")
    return jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
