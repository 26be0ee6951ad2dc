"""Registry of the questions: public names, commands and sections of the page follow it, in this order.

A question is one file of this package (a folder where parts are shared or figures are large) with a function of its
name that takes views and returns an `Answer`. Beside it the file may have ``NAME_on_page(view, asked)``, the answer
that the page shows, and ``simulate(source, work, ...)``, which simulates what the answer is about. Files are imported
on first use.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import cache, wraps
from importlib import import_module
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tolstat.common.errors import StoreError, input_error

if TYPE_CHECKING:
    from tolstat.analysis.sample import Sample
    from tolstat.display.answer import Answer, Asked
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
    at_once : bool
        Whether its command simulates what is missing without ``--run``.
    study : bool
        Whether it writes a study.
    """

    name: str
    heading: str
    summary: str
    page: str = ""
    file: str = ""
    counted: bool = False
    at_once: bool = False
    study: bool = False

    def functions(self) -> tuple[Callable[..., Answer], Callable[..., list[Path]] | None]:
        """The function that answers the question, and the one that simulates for it, if any."""
        module = self._module()
        return told(getattr(module, self.name)), getattr(module, "simulate", None)

    def on_page(self, view: View, asked: Asked) -> Answer:
        """Answer that the page shows, which words it as a whole.

        Raises
        ------
        NotApplicable
            When the page shows none.
        """
        module = self._module()
        for_page = getattr(module, f"{self.name}_on_page", None)
        answer: Answer = for_page(view, asked) if for_page else getattr(module, self.name)(view)
        return answer

    def _module(self) -> Any:
        return import_module(f"tolstat.questions.{self.file or self.name}")


@cache
def told(answer_of: Callable[..., Answer]) -> Callable[..., Answer]:
    """Let a function of views answer in the words of the first of them, see `common.wording`."""

    @wraps(answer_of)
    def answer(*views: View, **options: Any) -> Answer:
        from tolstat.display import rewording
        from tolstat.store.recorded import wording_of
        from tolstat.store.view import View

        first = views[0] if views else options[next(iter(signature(answer_of).parameters))]
        if not isinstance(first, View):
            raise input_error(answer_of.__name__, f"{type(first).__name__} is no view", "give store.view()")
        return rewording.answer(answer_of(*views, **options), wording_of(first.store))

    return answer


QUESTIONS = (
    Question("lines", "", "List what each line of the drawing would change.", "open", "causes.lines"),
    Question("limits", "", "Estimate the share of the joints above each limit.", "open", "exceedance.answer"),
    Question("exceedance", "", "Estimate the share of joints above each load.", "open", "exceedance.answer", True),
    Question("sweep", "", "Compare the largest loads of the joints of a sweep.", "open"),
    Question("cases", "", "Compare the largest loads of the listed joints.", file="sweep"),
    Question("orders", "Read", "Estimate the orders of the loads that the shafts carry.", "open"),
    Question("heat", "", "Estimate the power that friction takes, and the efficiency.", "open"),
    Question("bearing_life", "Read", "Compute the life of the pins' bearings.", "open", "bearing_life.answer", True),
    Question("fatigue", "Read", "Compute failures of parts, equivalent loads and damage.", "open", "fatigue.answer"),
    Question("tolerances", "", "Explain the entries of the tolerances and correlations.", "open", "joints"),
    Question("failed", "", "List joints without a valid load, and compare their errors.", "open", "joints"),
    Question("assumptions", "Read", "Compute what the verdict stands on.", "folded", "assumptions.answer"),
    Question("quantiles", "", "Estimate quantiles and tolerance limits of each load.", "folded", "exceedance.answer"),
    Question("capability", "Read", "Compute yield and Ppk against each limit of the study.", "folded", counted=True),
    Question("causes", "Read", "Compute which tolerances and errors cause a load.", "folded", "causes.errors"),
    Question("worst", "Read", "List the joints with the largest load and their errors.", "folded", "causes.worst"),
    Question("drawings", "", "Draw the joint, its errors and its worst rows.", "folded", "drawings.answer"),
    Question("histograms", "", "Draw histograms of the loads, and of the errors drawn.", "folded"),
    Question("modes", "", "Compute the shares of the revolution in which pins touch.", "folded", "joints"),
    Question("accuracy", "", "Give the numerical error of the loads, from checks of joints.", "folded", counted=True),
    Question("change", "Decide", "Simulate a change of the study on the same joints.", at_once=True, study=True),
    Question("allocate", "Decide", "Find the cheapest tolerances that meet the targets.", at_once=True, study=True),
    Question("compare", "Decide", "Compare the exceedances and loads of two campaigns."),
    Question("rare", "Decide", "Estimate a rare exceedance by subset simulation."),
)

PUBLIC = {question.name: f"tolstat.questions.{question.file or question.name}" for question in QUESTIONS}
"""Public names, and the modules that they come from."""


COMPUTED = {"life": "bearing_life.lives", "damage": "fatigue.by_joint"}
"""First word of what a question computes of each joint, and its module, whose `quantity` gives it."""


def is_computed(name: str) -> bool:
    """Whether a name is that of a quantity which a question computes: ``life pin1``, ``damage cross1.F_t``."""
    return name.partition(" ")[0] in COMPUTED


def quantity(view: View, name: str) -> Sample:
    """Load of each joint by its name, or what a question computes of it; raises as `View.load` and the question."""
    if not is_computed(name):
        return view.load(name)
    word, _, rest = name.partition(" ")
    module = import_module(f"tolstat.questions.{COMPUTED[word]}")
    found: Sample = view.kept(("quantity", name), lambda: module.quantity(view, rest))
    return found


def statistics(view: View) -> dict[str, Any]:
    """JSON values of the questions that are counted, by name; null where one does not apply, or is refused."""
    values: dict[str, Any] = {}
    for question in QUESTIONS:
        if question.counted:
            values[question.name] = None
            with suppress(StoreError):
                values[question.name] = question.functions()[0](view).values()
    return values
