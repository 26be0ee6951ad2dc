"""Registry of the questions: public names, commands and sections of the page come from here, in this order.

A question is one file of this package (a folder where parts are shared or figures are large) with a function of its
name that takes views and returns an `Answer`. Beside it the file may have ``NAME_on_page(view, asked)``, the answer
that the page shows, and ``simulate(source, work, ...)``, which simulates what the answer is about. Files are imported
on first use.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tolstat.common.errors import NotApplicable, StoreError
from tolstat.display.blocks import Section

if TYPE_CHECKING:
    from tolstat.display.answer import Answer
    from tolstat.display.asked import Asked
    from tolstat.questions.allocate.query import allocated as allocated
    from tolstat.questions.bearing_life.lives import lives_of as lives_of
    from tolstat.questions.compare.query import compared as compared
    from tolstat.questions.fatigue.parts import part_failures as part_failures
    from tolstat.questions.fatigue.pylife import pylife_series as pylife_series
    from tolstat.questions.fatigue.query import equivalent_loads as equivalent_loads
    from tolstat.questions.fatigue.query import load_cycles as load_cycles
    from tolstat.questions.fatigue.stress import load_stresses as load_stresses
    from tolstat.questions.lots.query import lots_of as lots_of
    from tolstat.questions.orders.query import orders_of as orders_of
    from tolstat.questions.rare.query import rare_event as rare_event
    from tolstat.questions.reweight.query import reweighted as reweighted
    from tolstat.questions.selective.query import assembled as assembled
    from tolstat.questions.show.rendering import draw_errors as draw_errors
    from tolstat.questions.show.rendering import draw_joint as draw_joint
    from tolstat.questions.show.rendering import draw_row as draw_row
    from tolstat.questions.sorting.query import sorted_joints as sorted_joints
    from tolstat.questions.time_above.query import time_above as time_above
    from tolstat.store.view import View


class Question(NamedTuple):
    """A question.

    Attributes
    ----------
    name : str
        Its function, and with ``-`` for ``_`` its command.
    heading : str
        Heading of ``tolstat --help`` that lists its command; empty if it has none.
    summary : str
        First line of its docstring.
    page : str
        ``open`` or ``folded`` where the page shows it, else empty.
    file : str
        File or folder of this package, if not named as the question.
    counted : bool
        Whether the JSON of all statistics has it.
    """

    name: str
    heading: str
    summary: str
    page: str = ""
    file: str = ""
    counted: bool = False

    def functions(self) -> tuple[Callable[..., Answer], Callable[..., list[Path]] | None]:
        """The function that answers the question, and the one that simulates for it, if any."""
        found = self._module()
        return getattr(found, self.name), getattr(found, "simulate", None)

    def on_page(self, view: View, asked: Asked) -> Answer:
        """Answer that the page shows.

        Raises
        ------
        NotApplicable
            When the page shows none.
        """
        found = self._module()
        own = getattr(found, f"{self.name}_on_page", None)
        answer: Answer = own(view, asked) if own else getattr(found, self.name)(view)
        return answer

    def _module(self) -> Any:
        return import_module(f"tolstat.questions.{self.file or self.name}")


class Folder(NamedTuple):
    """One folder of this package.

    Attributes
    ----------
    name : str
        The folder.
    public : tuple of str
        ``module.function`` in the folder that `tolstat` offers under the function's name.
    heading : str
        Heading of ``tolstat --help`` that lists its commands.
    commands : tuple of str
        Files of `tolstat.cli` with its commands, each with a function of the same name.
    has_section : bool
        Whether the page shows it: ``section.sections(view, asked)``.
    has_summary : bool
        Whether the JSON of all statistics has it: ``query.summary(view, confidence)``.
    """

    name: str
    public: tuple[str, ...] = ()
    heading: str = ""
    commands: tuple[str, ...] = ()
    has_section: bool = False
    has_summary: bool = False


QUESTIONS = (
    Question("lines", "", "List what each line of the drawing would change.", "open", file="causes.lines"),
    Folder("exceedance", has_section=True, has_summary=True),
    Folder("known_parts", has_section=True),
    Folder("sorting", ("query.sorted_joints",), "Decide", ("sorting",), has_section=True),
    Folder("histograms", has_section=True),
    Question("capability", "Read", "Compute yield and Cpk against each limit of the study.", "folded", counted=True),
    Folder("lots", ("query.lots_of",), "Read", ("lots",), has_section=True, has_summary=True),
    Question("pairs", "Read", "Find which errors of pin and hole together cause a load.", "folded", "causes.pairs"),
    Question("causes", "Read", "Print which tolerances and errors cause the largest loads.", "folded", "causes.errors"),
    Question(
        "angles", "Read", "Compute which errors make a load scatter at each input angle.", "folded", "causes.angles"
    ),
    Question("worst", "Read", "List the joints with the largest load and their errors.", "folded", "causes.worst"),
    Folder(
        "show",
        ("rendering.draw_joint", "rendering.draw_errors", "rendering.draw_row"),
        "Plan",
        ("show",),
        has_section=True,
    ),
    Folder(
        "fatigue",
        (
            *("query.load_cycles", "query.equivalent_loads", "pylife.pylife_series"),
            *("stress.load_stresses", "parts.part_failures"),
        ),
        "Read",
        ("fatigue",),
        has_section=True,
    ),
    Folder("bearing_life", ("lives.lives_of",), "Read", ("bearing_life",), has_section=True, has_summary=True),
    Folder("orders", ("query.orders_of",), "Read", ("orders",), has_section=True),
    Folder("accuracy", has_section=True, has_summary=True),
    Folder("joints", has_section=True),
    Folder("time_above", ("query.time_above",), "Read", ("time_above",)),
    Folder("reweight", ("query.reweighted",), "Decide", ("reweight",)),
    Folder("allocate", ("query.allocated",), "Decide", ("allocate",)),
    Folder("compare", ("query.compared",), "Decide", ("compare",)),
    Folder("rare", ("query.rare_event",), "Decide", ("rare",)),
    Folder("selective", ("query.assembled",), "Decide", ("selective",), has_section=True),
)

PUBLIC = {
    function: f"tolstat.questions.{question.name}.{module}"
    for question in QUESTIONS
    if isinstance(question, Folder)
    for module, _, function in (name.partition(".") for name in question.public)
} | {q.name: f"tolstat.questions.{q.file or q.name}" for q in QUESTIONS if isinstance(q, Question)}
"""Public names, and the modules that they come from."""


def commands(heading: str) -> tuple[str, ...]:
    """Files of `tolstat.cli` with the commands of the questions that a heading of the help lists."""
    return tuple(
        name
        for question in QUESTIONS
        if isinstance(question, Folder) and question.heading == heading
        for name in question.commands
    )


def sections(view: View, asked: Asked) -> list[Section]:
    """Sections of the page, in the order of `QUESTIONS`; questions that the file cannot answer have none."""
    found: list[Section] = []
    for question in QUESTIONS:
        if isinstance(question, Folder):
            if question.has_section:
                asked.stage(f"page: {question.name}")
                found += _module(question, "section").sections(view, asked)
        elif question.page:
            asked.stage(f"page: {question.name}")
            with asked.noting(f"{question.name} is left out"), suppress(NotApplicable):
                answer = question.on_page(view, asked)
                found.append(Section(question.name, answer.title, answer.blocks()))
    return found


def summary(view: View) -> dict[str, Any]:
    """JSON values of the questions that are counted, by name; null where one does not apply, or is refused."""
    found: dict[str, Any] = {}
    for question in QUESTIONS:
        if isinstance(question, Folder):
            if question.has_summary:
                found |= _module(question, "query").summary(view, 0.95)
        elif question.counted:
            found[question.name] = None
            with suppress(StoreError):
                found[question.name] = question.functions()[0](view).values()
    return found


def _module(question: Folder, name: str) -> Any:
    return import_module(f"tolstat.questions.{question.name}.{name}")
