"""Commands made of questions: arguments, options and help from a signature and its docstring."""

from __future__ import annotations

import inspect
import json
from pathlib import Path
from typing import Annotated, Any

import pytest

from tests.support import synthetic
from tolstat import sampling
from tolstat.campaign.work import Work
from tolstat.cli import _command
from tolstat.cli._command import command_of, entries, prose, quantity
from tolstat.common.errors import InputError
from tolstat.display.answer import Answer
from tolstat.display.options import Opt
from tolstat.questions import QUESTIONS, Question
from tolstat.store import Writer
from tolstat.store.view import View
from tolstat.study import Study, load

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
    function = _command.function_of(question)
    parameters = inspect.signature(function).parameters.values()
    assert [p.name for p in parameters if not p.annotation.__metadata__[0].help] == []
    assert (function.__doc__ or "").partition("\n")[0] == question.summary


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
    parameters = inspect.signature(command_of(_command.function_of(question))).parameters
    own = ["file", "number", "accepted", "point", "study_file", "out", "wide", "as_json"]
    assert list(parameters) == [*own, "quiet", "verbose", "log"]
    number, accepted = parameters["number"], parameters["accepted"]
    assert (number.default, accepted.default) == (7, None)
    assert number.annotation.__metadata__[0].min == 1
    assert accepted.annotation.__metadata__[0].default == "--accept"
    assert accepted.annotation.__metadata__[0].help == "The share."


@pytest.mark.parametrize(("point", "shown"), [("", ["drive", "climb"]), ("climb", ["climb"]), ("valley", None)])
def test_a_study_is_simulated_whole_and_read_at_the_point_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], point: str, shown: Any
) -> None:
    _, _, keys = synthetic.HEAD.partition("[operation]")
    text = synthetic.STUDY.replace("[operation]", '[[operation]]\nname = "drive"')
    text = text.replace("[tolerances]", f'[[operation]]\nname = "climb"{keys}[tolerances]', 1)
    (tmp_path / "two.toml").write_text(text, encoding="utf-8")
    plan = load(tmp_path / "two.toml")
    with Writer.create(tmp_path / "two.h5", plan, [sampling.draw(plan)]):
        pass

    def known(view: View) -> Answer:
        """Know it."""
        return Answer("known", "Known", (), {"points": view.points})

    def simulate(study: Study, work: Work) -> list[Path]:
        """Know it."""
        assert [(own.name, work.point) for own in study.points] == [("drive", point), ("climb", point)]
        return [tmp_path / "two.h5"]

    question = Question("known", "Read", "Know it.")
    monkeypatch.setattr(Question, "functions", lambda self: (known, simulate))
    given = {"source": tmp_path / "two.toml", "point": point or None, "workers": None, "out": None, "wide": False}
    run = _command.function_of(question)
    if shown is None:
        with pytest.raises(InputError, match="valley"):
            run(**given, study_file=None, as_json=True)
        return
    run(**given, study_file=None, as_json=True)
    assert json.loads(capsys.readouterr().out)["facts"] == {"points": shown}
