"""An answer as JSON, files, blocks of a page and in a notebook: the same numbers in each."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes

from tests.support.cells import body, head
from tolstat.display import drawing
from tolstat.display.answer import Answer, Document, Sentence, Sheet, Table
from tolstat.display.blocks import Panel, Panels
from tolstat.display.table import Column

COLUMNS = (
    Column("load", lambda row: str(row["load"])),
    Column("largest", lambda row: f"{row['largest']:.0f} N"),
    Column("errors", lambda row: "?", shown=lambda rows: False),
)
ROWS = [
    {"load": "cross1.F", "largest": np.float64(700.25), "n": np.int64(3)},
    {"load": "=F", "largest": math.nan, "n": 0},
]


def draw(ax: Axes) -> None:
    ax.plot([0.0, 1.0], [0.0, 1.0])


@pytest.fixture
def answer() -> Answer:
    table = Table("loads", "Largest loads", COLUMNS, ROWS, {"largest": "N"}, seen=ROWS[:1])
    panels = Panels([Panel("curve", "A curve", "A line", draw)])
    study = Document(".toml", lambda path: f"n = 1  # {path.name}\n")
    parts = [Sentence("One load is known.", "lead"), table, panels, Sentence("n: joints"), study]
    return Answer("known", "What is known", parts, {"share": np.inf, "names": ("a", "b")})


def test_json_has_all_rows_in_plain_numbers_and_null_for_what_is_not_finite(answer: Answer) -> None:
    found = json.loads(json.dumps(answer.values(), allow_nan=False))
    assert found["facts"] == {"share": None, "names": ["a", "b"]}
    assert found["sentences"] == [
        {"place": "lead", "text": "One load is known."},
        {"place": "note", "text": "n: joints"},
    ]
    assert found["tables"] == {
        "loads": {
            "units": {"largest": "N"},
            "rows": [{"load": "cross1.F", "largest": 700.25, "n": 3}, {"load": "=F", "largest": None, "n": 0}],
        }
    }


def test_people_see_the_rows_meant_for_them_in_columns_that_have_something_to_show(answer: Answer) -> None:
    lead, table, panels, note = answer.blocks()
    assert (lead, note) == (Sentence("One load is known.", "lead"), Sentence("n: joints"))
    assert isinstance(table, Table)
    assert (head(table), body(table)) == (["load", "largest"], [["cross1.F", "700 N"]])
    assert isinstance(panels, Panels)


def test_files_hold_every_row_and_no_formula(answer: Answer, tmp_path: Path) -> None:
    files = answer.write(tmp_path / "file_known")
    assert [path.name for path in files] == [
        "file_known_loads.csv",
        "file_known_curve.png",
        "file_known_curve.svg",
        "file_known.toml",
    ]
    assert files[0].read_text("utf-8") == "load,largest,n\ncross1.F,700.25,3\n'=F,,0\n"
    assert "A curve" in files[2].read_text("utf-8")
    assert files[3].read_text("utf-8") == "n = 1  # file_known.toml\n"


def test_the_picture_alone_is_a_png(answer: Answer, tmp_path: Path) -> None:
    (panels,) = (part for part in answer.parts if isinstance(part, Panels))
    whole = replace(answer, parts=[*answer.parts, Sheet("all", lambda: drawing.sheet(panels.panels))])
    assert [path.name for path in whole.write_picture(tmp_path / "file")] == ["file_all.png"]
    assert [path.name for path in tmp_path.iterdir()] == ["file_all.png"]
    assert answer.write_picture(tmp_path / "file") == []


def test_frame_has_the_rows_by_name(answer: Answer) -> None:
    assert answer.frame("loads")["n"].tolist() == [3, 0]
    with pytest.raises(KeyError):
        answer.frame("others")


def test_the_prompt_shows_what_an_answer_has(answer: Answer) -> None:
    assert repr(answer) == "<answer 'known': What is known; frames loads; facts share, names>"
    assert repr(Answer("empty", "Nothing", [])) == "<answer 'empty': Nothing>"


def test_a_notebook_shows_tables_pictures_and_facts(answer: Answer) -> None:
    shown = answer._repr_html_()
    for piece in (
        "<h3>What is known</h3>",
        "<table",
        "<svg",
        "<dt>share</dt><dd>inf</dd>",
        "<dd>a, b</dd>",
        "N: joints.",
    ):
        assert piece in shown
    assert "<script" not in shown
