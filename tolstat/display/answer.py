"""The answer to a question: tables, figures and sentences in reading order, and facts by name.

A question returns an `Answer`; terminal, page, JSON, CSV and notebook are generic functions of it. It imports from here
all that an answer is made of, and what the reader of a page asks for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from tolstat.common.errors import TolstatError
from tolstat.common.files import write_text
from tolstat.common.late import pandas as pd
from tolstat.display import drawing, progress, style, text
from tolstat.display.blocks import Artist, Axes, Block, Facts, Figure, Listing, Panel, Panels, Reader, Sentence
from tolstat.display.table import Column, Row, Rows, Table, by_share, has, has_unresolved, of_shares, plain

__all__ = ["Answer", "Artist", "Asked", "Axes", "Column", "Document", "Figure", "Listing", "Panel", "Panels", "Part"]
__all__ += ["Reader", "Row", "Rows", "Sentence", "Sheet", "Table", "by_share", "has"]
__all__ += ["has_unresolved", "of_shares", "plain"]


@dataclass(frozen=True)
class Document:
    """File that `Answer.write` writes, such as a study with other tolerances.

    Attributes
    ----------
    ending : str
        Ends its name.
    text : callable
        Path of the file -> its text: names of other files in it start from its folder.
    """

    ending: str
    text: Callable[[Path], str]


@dataclass(frozen=True)
class Sheet:
    """A picture of several panels that `Answer.write` writes in their place; `name` ends the names of its files."""

    name: str
    draw: Callable[[], Figure]


Part = Sentence | Table | Panels | Reader | Sheet | Listing | Document


@dataclass(frozen=True, repr=False)
class Answer:
    """The answer to a question.

    Attributes
    ----------
    name : str
        Name of the question.
    title : str
        Heading on the page.
    parts : sequence of Sentence, Table, Panels, Listing or Document
        In reading order.
    facts : mapping
        Single values by name: numbers in SI units, words, None if unknown.
    """

    name: str
    title: str
    parts: Sequence[Part]
    facts: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        names = [f"{kind} {', '.join(keys)}" for kind, keys in (("frames", self.tables), ("facts", self.facts)) if keys]
        return f"<answer {self.name!r}: {'; '.join([self.title, *names])}>"

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Pickle sentences and numbers: pictures, and columns as people see them, are functions."""
        parts = (part for part in self.parts if isinstance(part, Sentence | Table))
        kept = [replace(part, columns=()) if isinstance(part, Table) else part for part in parts]
        return Answer, (self.name, self.title, kept, dict(self.facts))

    @property
    def tables(self) -> dict[str, Table]:
        """Tables by name."""
        return {part.name: part for part in self.parts if isinstance(part, Table)}

    def frame(self, name: str) -> pd.DataFrame:
        """Rows of a table as a frame.

        Raises
        ------
        KeyError
            When there is no table of this name.
        """
        return pd.DataFrame(list(self.tables[name].rows))

    def values(self) -> dict[str, Any]:
        """JSON values: ``facts``, ``sentences`` and ``tables``; numbers that are not finite are None."""
        sentences = [{"place": part.place, "text": part.text} for part in self.parts if isinstance(part, Sentence)]
        tables = {
            name: {"units": dict(table.units), "rows": text.plain(table.rows)} for name, table in self.tables.items()
        }
        return {"facts": text.plain(self.facts), "sentences": sentences, "tables": tables}

    def blocks(self) -> list[Block]:
        """Blocks of a page."""
        others = Document | Sheet
        shown = (part for part in self.parts if not isinstance(part, Table) or part.columns)
        return [part for part in shown if not isinstance(part, others)]

    def write(self, stem: Path) -> list[Path]:
        """Write each table with rows as ``STEM_TABLE.csv``, pictures as PNG and SVG beside them, and documents.

        Returns
        -------
        list of Path
            The files written.

        Raises
        ------
        OSError
            When a file cannot be written.
        """
        files: list[Path] = []
        sheets = [part for part in self.parts if isinstance(part, Sheet)]
        for part in self.parts:
            if isinstance(part, Table) and part.rows:
                files.append(text.csv(text.columns_of(part.rows), stem, part.name))
            elif isinstance(part, Panels) and not sheets:
                for panel in part.panels:
                    files += style.save(drawing.sheet([panel]), stem.with_name(f"{stem.name}_{panel.key}"))
            elif isinstance(part, Sheet):
                files += style.save(part.draw(), stem.with_name(f"{stem.name}_{part.name}"))
            elif isinstance(part, Document):
                path = stem.with_name(f"{stem.name}{part.ending}")
                write_text(path, part.text(path))
                files.append(path)
        return files

    def write_picture(self, stem: Path) -> list[Path]:
        """Write the first sheet alone, as PNG, see `write`; nothing without one."""
        for part in self.parts:
            if isinstance(part, Sheet):
                return style.save(part.draw(), stem.with_name(f"{stem.name}_{part.name}"), (".png",))
        return []

    def write_documents(self, path: Path) -> list[Path]:
        """Write the documents alone, see `write`; the ending of `path`, if it has one, is written as it is there."""
        documents = [part for part in self.parts if isinstance(part, Document)]
        documents = [
            replace(part, ending=path.suffix) if part.ending == path.suffix.lower() else part for part in documents
        ]
        return replace(self, parts=documents).write(path.with_suffix(""))

    def _repr_html_(self) -> str:
        from tolstat.display import html

        def words(value: Any) -> str:
            if isinstance(value, list | tuple):
                return ", ".join(map(words, value))
            return f"{value:.4g}" if isinstance(value, float) else str(value)

        items = [(key.replace("_", " "), words(value)) for key, value in self.facts.items()]
        return html.fragment(self.title, [*self.blocks(), *([Facts(items)] if items else [])])


@dataclass(frozen=True)
class Asked:
    """Settings of a page that its sections follow.

    Attributes
    ----------
    path : Path
        The result file.
    accepted : float
        Accepted share: share of the joints that may be above a limit; NaN if none is given.
    replay : int
        Number of joints whose load histories are evaluated; without stored histories they are simulated again. With 0
        the page shows no histories.
    notes : list of str
        Remarks that concern the whole page; sections append to it.
    stage : callable
        Called with the name of each part of the page when its computation begins.
    processes : int
        Number of processes that make the page, whose bytes do not depend on it.
    """

    path: Path
    accepted: float = math.nan
    replay: int = 0
    notes: list[str] = field(default_factory=list)
    stage: progress.Tell = progress.silent
    processes: int = 1

    @contextmanager
    def noting(self, what: str) -> Iterator[None]:
        """Turn a `TolstatError` into a note that begins with `what`, so that the rest of the page is still made.

        The note names the file without its folder, so that the page does not depend on the folder.
        """
        try:
            yield
        except TolstatError as error:
            self.notes.append(f"{what}: {str(error).splitlines()[0].replace(str(self.path), self.path.name)}")
