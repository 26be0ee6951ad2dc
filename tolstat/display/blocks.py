"""Blocks that a report page is composed of: the decision, sentences, tables, pictures."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from tolstat.common.wording import AS_WRITTEN, Wording
from tolstat.display.table import Table
from tolstat.display.verdict import Verdict

if TYPE_CHECKING:
    from matplotlib.artist import Artist as Artist
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:
    Artist = Axes = Figure = Any  # annotations, for which matplotlib is not imported


@dataclass(frozen=True)
class Sentence:
    """One or several sentences.

    Attributes
    ----------
    text : str
        The words; of a note, capital letter and full stop may be missing.
    place : str
        ``lead`` (part of the answer itself) or ``note`` (definitions, restrictions).
    """

    text: str
    place: Literal["lead", "note"] = "note"


@dataclass(frozen=True)
class Decision:
    """The head of the page: what was asked, the verdicts, what they stand on, and a drawing beside them.

    Attributes
    ----------
    question : str
        The question; empty if the study has none.
    verdicts : sequence of Verdict
        The verdicts.
    cards : sequence of Verdict
        Other numbers in the form of verdicts: the number, what it means, and a note, such as its interval.
    picture : Panel, optional
        The drawing.
    chart : Panel, optional
        What the verdict stands on.
    below : sequence of str
        Paragraphs below the chart.
    """

    question: str
    verdicts: Sequence[Verdict]
    cards: Sequence[Verdict]
    picture: Panel | None = None
    chart: Panel | None = None
    below: Sequence[str] = ()


@dataclass(frozen=True)
class Panel:
    """One picture.

    Attributes
    ----------
    key : str
        Short name, unique on the page; what cannot stand in the name of an anchor becomes ``-``.
    title : str
        What it shows.
    description : str
        Text alternative for readers who cannot see the picture.
    draw : callable
        Function that draws the picture into given axes; artists with labels are named in a legend above these.
    size : tuple of float
        Width and height in inches at its natural scale.
    left : float
        Least room for the labels of the y axis, inches.
    top : float
        Least room above the axes, inches.
    rows : sequence of str
        Labels of the horizontal rows of the picture, the first on top; none for a picture with a y axis.
    reads : tuple of str
        Loads whose exceedance the picture shows, for the cursor.
    bare : bool
        Whether the axes fill the picture: a drawing without scales beside it.
    switches : sequence of (str, str)
        Parts of the picture that are hidden until the reader asks for them: the name that `drawing.switched` gives
        them, and the words beside the switch.
    """

    key: str
    title: str
    description: str
    draw: Callable[[Axes], None]
    size: tuple[float, float] = (5.0, 3.5)
    left: float = 0.72
    top: float = 0.26
    rows: Sequence[str] = ()
    reads: tuple[str, ...] = ()
    bare: bool = False
    switches: Sequence[tuple[str, str]] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "key", re.sub(r"[^\w-]+", "-", self.key))


@dataclass(frozen=True)
class Panels:
    """Pictures side by side: two in a row where there is room, `small` ones four; blocks `beside` a single one."""

    panels: Sequence[Panel]
    small: bool = False
    beside: Sequence[Table | Sentence] = ()


@dataclass(frozen=True)
class Reader:
    """Interactive tool that shows the exceedance at a chosen load.

    Attributes
    ----------
    curves : mapping
        As `questions.exceedance.rows.readings` returns them.
    start : str
        The load shown first; empty for the first of `curves`.
    wording : Wording
        Tells its own words.
    """

    curves: Mapping[str, Any]
    start: str = ""
    wording: Wording = AS_WRITTEN


@dataclass(frozen=True)
class Facts:
    """Names and values, one below the other; with a title they are collapsed until the reader opens them."""

    items: Sequence[tuple[str, str]]
    title: str = ""


@dataclass(frozen=True)
class Listing:
    """Verbatim text of a file, collapsed until the reader opens it."""

    title: str
    text: str


Block = Sentence | Decision | Table | Panels | Reader | Facts | Listing


@dataclass(frozen=True)
class Section:
    """A part of the page with a heading; a `folded` one shows its heading until the reader opens it."""

    key: str
    title: str
    blocks: Sequence[Block] = field(default_factory=tuple)
    folded: bool = False


@dataclass(frozen=True)
class Page:
    """The whole page.

    Attributes
    ----------
    title, description : str
        Name of the study, and text about its joint.
    scene : sequence of str
        Lines on the operating point and the joint.
    sections : sequence of Section
        In reading order, the verdict first; none is empty.
    provenance : str
        One line on how the numbers were made.
    listings : sequence of Facts or Listing
        What they were made from, always printed.
    full : bool
        Whether folded sections are open.
    wording : Wording
        Tells the words of the page itself.
    """

    title: str
    description: str
    scene: Sequence[str]
    sections: Sequence[Section]
    provenance: str = ""
    listings: Sequence[Facts | Listing] = ()
    full: bool = False
    wording: Wording = AS_WRITTEN
