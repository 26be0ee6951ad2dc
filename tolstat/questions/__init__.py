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
    from tolstat.questions.causes.angles import against_angle as against_angle
    from tolstat.questions.causes.pairs import pairs_of as pairs_of
    from tolstat.questions.causes.query import causes_of as causes_of
    from tolstat.questions.causes.tail import worst_joints as worst_joints
    from tolstat.questions.show.rendering import draw_errors as draw_errors
    from tolstat.questions.show.rendering import draw_joint as draw_joint
    from tolstat.questions.show.rendering import draw_row as draw_row
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
    Question("limits", "", "Estimate the share of the joints above each limit.", "open", "exceedance.answer"),
    Question(
        "exceedance", "", "Estimate which share of the joints exceeds each load.", "open", "exceedance.answer", True
    ),
    Question("sweep", "", "Compare the largest loads of the joints of a sweep.", "open"),
    Question("quantiles", "", "Estimate quantiles and tolerance limits of each load.", "folded", "exceedance.answer"),
    Question("known_parts", "", "Estimate what measured parts leave open of each share.", "open"),
    Question("sorting", "Decide", "Compute yield and cost before and after parts are sorted.", "open"),
    Question("histograms", "", "Draw histograms of the loads, and of the errors drawn.", "folded"),
    Question("capability", "Read", "Compute yield and Cpk against each limit of the study.", "folded", counted=True),
    Question("lots", "Read", "Compute which share of a lot or of a delivery exceeds limits.", "folded", counted=True),
    Folder(
        "causes",
        ("query.causes_of", "angles.against_angle", "pairs.pairs_of", "tail.worst_joints"),
        "Read",
        ("worst", "causes"),
        has_section=True,
    ),
    Folder(
        "show",
        ("rendering.draw_joint", "rendering.draw_errors", "rendering.draw_row"),
        "Plan",
        ("show",),
        has_section=True,
    ),
    Question("fatigue", "Read", "Compute failures of parts, equivalent loads and damage.", "open", "fatigue.answer"),
    Question(
        "bearing_life",
        "Read",
        "Compute the rating life of the pins' bearings.",
        "open",
        file="bearing_life.answer",
        counted=True,
    ),
    Question("orders", "Read", "Estimate the orders of the loads that the shafts carry.", "open"),
    Question("accuracy", "", "Give the numerical error of the loads, from checks of joints.", "folded", counted=True),
    Question("modes", "", "Compute the shares of the revolution in which pins touch.", "folded", "joints"),
    Question("failed", "", "List joints without a valid load, and compare their errors.", "open", "joints"),
    Question("tolerances", "", "Explain the entries of the tolerances and correlations.", "open", "joints"),
    Question("time_above", "Read", "Estimate how much of a revolution loads are above levels."),
    Question("reweight", "Decide", "Estimate exceedances for changed tolerances."),
    Question("allocate", "Decide", "Propose the cheapest tolerances that meet the targets.", file="allocate.answer"),
    Question("compare", "Decide", "Compare the exceedances and loads of two campaigns."),
    Question("rare", "Decide", "Estimate a rare exceedance by subset simulation.", file="rare.answer"),
    Question("selective", "Decide", "Compute yield and unmatched parts of selective assembly.", "folded"),
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
                key = question.name.replace("_", "-")
                found.append(Section(key, answer.title, answer.blocks(), question.page == "folded"))
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
