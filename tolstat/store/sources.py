"""What functions for users take as a campaign: a path, an open file, or a view."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tolstat.store.reader import Reader
from tolstat.store.view import View


@contextmanager
def viewed(source: str | Path | Reader | View) -> Iterator[View]:
    """View of a result file: of its path, which is opened and closed, or of the open file; a view stays as it is."""
    if isinstance(source, View):
        yield source
    elif isinstance(source, Reader):
        yield source.view()
    else:
        with Reader.open(source) as store:
            yield store.view()
