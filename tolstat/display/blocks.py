"""What a report page is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

from matplotlib.axes import Axes


@dataclass(frozen=True)
class Text:
    """A paragraph; `small` for what is to be read after the rest."""

    kind: ClassVar[str] = "text"
    text: str
    small: bool = False


@dataclass(frozen=True)
class Card:
    """One figure of the headline.

    Attributes
    ----------
    value, label, note : str
        The number, what it is of, and its interval.
    verdict : str
        ``yes``, ``no``, ``open``, or empty where nothing is judged.
    """

    value: str
    label: str
    note: str
    verdict: str = ""


@dataclass(frozen=True)
class Cards:
    """The figures that the reader came for."""

    kind: ClassVar[str] = "cards"
    cards: Sequence[Card]


@dataclass(frozen=True)
class Table:
    """A table of texts.

    Attributes
    ----------
    title : str
        What it shows.
    head : sequence of str
        Headings of the columns.
    rows : sequence of sequence of str
        Cells; the first column names the row.
    words : frozenset of int
        Columns of words, which are aligned to the left.
    verdicts : sequence of str
        For each row ``yes``, ``no``, ``open`` or nothing: how its last cell is set off. Empty where nothing is judged.
    """

    kind: ClassVar[str] = "table"
    title: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: frozenset[int] = frozenset({0})
    verdicts: Sequence[str] = ()


@dataclass(frozen=True)
class Panel:
    """One picture.

    Attributes
    ----------
    key : str
        Short name, the only one of its kind on the page.
    title : str
        What it shows.
    description : str
        What it says to somebody who cannot see it.
    draw : callable
        Draws into axes that it is given.
    size : tuple of float
        Width and height in inches at its natural scale.
    left : float
        Room for the labels of the y axis, inches.
    reads : tuple of str
        Loads whose exceedance it shows, for the cursor.
    """

    key: str
    title: str
    description: str
    draw: Callable[[Axes], None]
    size: tuple[float, float] = (5.0, 3.5)
    left: float = 0.72
    reads: tuple[str, ...] = ()


@dataclass(frozen=True)
class Panels:
    """Pictures beside each other."""

    kind: ClassVar[str] = "panels"
    panels: Sequence[Panel]


@dataclass(frozen=True)
class Reader:
    """Tool that reads exceedances at a load; `curves` as `loads.readings` gives them."""

    kind: ClassVar[str] = "reader"
    curves: Mapping[str, Any]


@dataclass(frozen=True)
class Facts:
    """Names and values, one below the other."""

    kind: ClassVar[str] = "facts"
    items: Sequence[tuple[str, str]]


@dataclass(frozen=True)
class Listing:
    """A text as it stands in a file; folded until asked for."""

    kind: ClassVar[str] = "listing"
    title: str
    text: str


Block = Text | Cards | Table | Panels | Reader | Facts | Listing


@dataclass(frozen=True)
class Section:
    """A part of the page with a heading."""

    key: str
    title: str
    blocks: Sequence[Block] = field(default_factory=tuple)


@dataclass(frozen=True)
class Page:
    """The whole page.

    Attributes
    ----------
    title, subtitle : str
        Name of the study, and what the page stands on.
    sections : sequence of Section
        In the order of reading; none is empty.
    """

    title: str
    subtitle: str
    sections: Sequence[Section]
