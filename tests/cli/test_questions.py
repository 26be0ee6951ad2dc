"""Commands made of questions: arguments, options and help from a signature and its docstring."""

from __future__ import annotations

from typing import Annotated, Any

import pytest

from tolstat.cli import _questions
from tolstat.cli._questions import entries, prose, quantity
from tolstat.common.errors import InputError
from tolstat.display.options import Opt
from tolstat.questions import QUESTIONS, Question
from tolstat.store.view import View

OF_QUESTIONS = [question for question in QUESTIONS if isinstance(question, Question)]
DOCSTRING = """Do this.

Example: tolstat this

Parameters
----------
view : View
    A campaign.
one_in : list of float, optional
    Numbers
    of joints.
*views : View
    More.

Returns
-------
Answer
    Something : else.
"""


def test_help_is_the_prose_and_each_entry_of_the_docstring() -> None:
    assert prose(DOCSTRING) == "Do this.\n\nExample: tolstat this"
    assert entries(DOCSTRING) == {"view": "A campaign.", "one_in": "Numbers of joints.", "views": "More."}
    assert entries("Do this.") == {}


@pytest.mark.parametrize("question", OF_QUESTIONS, ids=lambda question: question.name)
def test_every_option_of_a_question_is_explained_in_its_docstring(question: Question) -> None:
    asked = _questions._Asked(question)
    assert [p.name for p in (*asked.options, *asked.simulated) if not asked.help.get(p.name)] == []
    assert asked.docstring.partition("\n")[0] == question.summary


@pytest.mark.parametrize(
    ("text", "unit", "value"), [("0.1 %", "1", 1e-3), ("1000 ppm", "1", 1e-3), ("0.5", "1", 0.5), ("2 min", "s", 120.0)]
)
def test_a_value_with_a_unit_is_si_in_python(text: str, unit: str, value: float) -> None:
    assert quantity(text, Opt("X", unit=unit), "--x") == pytest.approx(value)


@pytest.mark.parametrize(("text", "unit"), [("1.5", "1"), ("0", "1"), ("5", "s"), ("-1 s", "s"), ("a lot", "1")])
def test_a_value_that_cannot_be_used_is_refused_with_an_example(text: str, unit: str) -> None:
    with pytest.raises(InputError, match="hint: write --x ") as caught:
        quantity(text, Opt("X", 0.0, 1.0 if unit == "1" else None, unit), "--x")
    assert repr(text) in str(caught.value)


def test_options_have_the_name_limits_and_defaults_of_the_signature(monkeypatch: pytest.MonkeyPatch) -> None:
    def known(
        view: View,
        number: Annotated[int, Opt("N", least=1)] = 7,
        accepted: Annotated[float, Opt("SHARE", 0.0, 1.0, "1", "accept")] = 0.25,
    ) -> Any:
        """Know it.

        Parameters
        ----------
        number : int
            The number.
        accepted : float
            The share.
        """

    question = Question("known", "Read", "Know it.")
    monkeypatch.setattr(Question, "functions", lambda self: (known, None))
    parameters = _questions.command_of(question).__signature__.parameters  # type: ignore[attr-defined]
    assert list(parameters) == ["file", "number", "accepted", "point", "study_file", "out", "wide", "as_json"]
    number, accepted = parameters["number"], parameters["accepted"]
    assert (number.default, accepted.default) == (7, None)
    assert number.annotation.__metadata__[0].min == 1
    assert accepted.annotation.__metadata__[0].default == "--accept"
    assert accepted.annotation.__metadata__[0].help == "The share."
