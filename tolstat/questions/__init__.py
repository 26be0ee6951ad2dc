"""Registry of the questions: a folder each, whose query takes a `store.view.View`, a study to simulate, or a joint.

Public names, commands, sections of the page and the JSON summary come from here, in this order. Modules are imported
on first use.

A folder has `query.py` (computes), `rendering.py` (text, tables, figures) and, where
the page shows the question, `section.py` with ``sections(view, asked)``.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from tolstat.display.asked import Asked
    from tolstat.display.blocks import Section
    from tolstat.questions.allocate.query import allocated as allocated
    from tolstat.questions.bearing_life.lives import lives_of as lives_of
    from tolstat.questions.causes.angles import against_angle as against_angle
    from tolstat.questions.causes.pairs import pairs_of as pairs_of
    from tolstat.questions.causes.query import causes_of as causes_of
    from tolstat.questions.causes.tail import worst_joints as worst_joints
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
    from tolstat.questions.what_if.query import what_if as what_if
    from tolstat.store.view import View


class Question(NamedTuple):
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
    Question("what_if", ("query.what_if",), has_section=True),
    Question("exceedance", has_section=True, has_summary=True),
    Question("known_parts", has_section=True),
    Question("sorting", ("query.sorted_joints",), "Decide", ("sorting",), has_section=True),
    Question("histograms", has_section=True),
    Question("capability", (), "Read", ("capability",), has_section=True, has_summary=True),
    Question("lots", ("query.lots_of",), "Read", ("lots",), has_section=True, has_summary=True),
    Question(
        "causes",
        ("query.causes_of", "angles.against_angle", "pairs.pairs_of", "tail.worst_joints"),
        "Read",
        ("worst", "causes"),
        has_section=True,
    ),
    Question(
        "show",
        ("rendering.draw_joint", "rendering.draw_errors", "rendering.draw_row"),
        "Plan",
        ("show",),
        has_section=True,
    ),
    Question(
        "fatigue",
        (
            *("query.load_cycles", "query.equivalent_loads", "pylife.pylife_series"),
            *("stress.load_stresses", "parts.part_failures"),
        ),
        "Read",
        ("fatigue",),
        has_section=True,
    ),
    Question("bearing_life", ("lives.lives_of",), "Read", ("bearing_life",), has_section=True, has_summary=True),
    Question("orders", ("query.orders_of",), "Read", ("orders",), has_section=True),
    Question("accuracy", has_section=True, has_summary=True),
    Question("joints", has_section=True),
    Question("time_above", ("query.time_above",), "Read", ("time_above",)),
    Question("reweight", ("query.reweighted",), "Decide", ("reweight",)),
    Question("allocate", ("query.allocated",), "Decide", ("allocate",)),
    Question("compare", ("query.compared",), "Decide", ("compare",)),
    Question("rare", ("query.rare_event",), "Decide", ("rare",)),
    Question("selective", ("query.assembled",), "Decide", ("selective",), has_section=True),
)

PUBLIC = {
    function: f"tolstat.questions.{question.name}.{module}"
    for question in QUESTIONS
    for module, _, function in (name.partition(".") for name in question.public)
}
"""Public names, and the modules that they come from."""


def commands(heading: str) -> tuple[str, ...]:
    """Files of `tolstat.cli` with the commands of the questions that a heading of the help lists."""
    return tuple(name for question in QUESTIONS if question.heading == heading for name in question.commands)


def sections(view: View, asked: Asked) -> list[Section]:
    """Sections of the page, in the order of `QUESTIONS`; questions that the file cannot answer have none."""
    found: list[Section] = []
    for question in QUESTIONS:
        if question.has_section:
            asked.stage(f"page: {question.name}")
            found += _module(question, "section").sections(view, asked)
    return found


def summary(view: View, confidence: float) -> dict[str, Any]:
    """JSON values of all questions that have a summary, by key."""
    found: dict[str, Any] = {}
    for question in QUESTIONS:
        if question.has_summary:
            found |= _module(question, "query").summary(view, confidence)
    return found


def _module(question: Question, name: str) -> Any:
    return import_module(f"tolstat.questions.{question.name}.{name}")
