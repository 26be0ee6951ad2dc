"""A page about drive shafts: its own words say shaft, those of the user stay, and joints are told as written."""

from __future__ import annotations

import json

import pytest

from tests.golden_output.page import as_text
from tolstat.common.wording import AS_WRITTEN, Wording
from tolstat.display import html, rewording
from tolstat.display.answer import Answer
from tolstat.display.blocks import Decision, Listing, Page, Panel, Panels, Reader, Section, Sentence
from tolstat.display.table import Column, Table
from tolstat.display.verdict import Verdict

SHAFTS = Wording("shaft", ("rear joint",))
ROWS = [{"joints": 3, "part": "rear joint"}, {"joints": None, "part": "joint1"}]


def drawn(ax):
    ax.plot([0, 1], [0, 1], label="nominal joint")
    ax.set(xlabel="share of the joints")
    ax.text(0.5, 0.5, "no joint with a valid result")


@pytest.fixture
def parts():
    panel = Panel("a", "cross1.F: joints above x", "Half of the joints", drawn, rows=["joint1.pin1", "all joints"])
    columns = [Column("part", lambda row: row["part"]), Column("joints", lambda row: str(row["joints"] or "no joint"))]
    return [
        Sentence("no joint has a rating: a bearing of joint2 swings", "lead"),
        Table("joints", "Joints above each limit", columns, ROWS),
        Panels([panel]),
        Reader({"cross1.F": {}}),
    ]


@pytest.fixture
def written(parts, tmp_path):
    """Page with these parts in a wording."""

    def write(wording):
        head = Decision("do joints hold?", [Verdict("", "5 %", "of the joints", ("few joints",))], [])
        sections = [Section("verdict", "Verdict", [head]), Section("joints", "The worst joints", parts)]
        listing = Listing("The study as it was run", "# Question: do joints hold?")
        page = Page("seat of a joint", "joint of steel", ["joint 1"], sections, "3 joints", [listing])
        html.write(rewording.page(page, wording), tmp_path / "a.html")
        return (tmp_path / "a.html").read_text(encoding="utf-8")

    return write


def test_a_page_about_shafts(written):
    page = written(SHAFTS)
    text = as_text(page)
    told = ("Tolerance analysis of a drive shaft", "Question: do joints hold?", "5 % of the shafts", "Few shafts.")
    told += (
        "seat of a joint",
        "joint of steel",
        "joint 1",
        "## The worst shafts",
        "Shafts above each limit",
        "3 shafts",
    )
    told += ("part | shafts", "rear joint | 3", "joint1 | no shaft", "Read the share of the shafts above a load")
    for words in (*told, "# Question: do joints hold?", "no shaft has a rating: a bearing of joint2 swings"):
        assert words in text, words
    for words in ("cross1.F: shafts above x", "Half of the shafts", "all shafts", "joint1.pin1", "nominal shaft"):
        assert words in page, words
    for words in ("share of the shafts<", "no shaft with a valid result", '" of the shafts exceed "'):
        assert words in page, words
    assert "shaft" not in as_text(written(AS_WRITTEN))


def test_numbers_and_keys_stay(parts):
    facts = {"joints": 3, "verdict": {"sentence": "5 % of the joints", "answer": "joint", "notes": ["few joints"]}}
    answer = Answer("joints", "The worst joints", parts, facts)
    assert rewording.answer(answer, AS_WRITTEN) is answer
    told = rewording.answer(answer, SHAFTS)
    assert (told.name, told.title) == ("joints", "The worst shafts")
    values = told.values()
    assert values["facts"] == {
        "joints": 3,
        "verdict": {"sentence": "5 % of the shafts", "answer": "joint", "notes": ["few shafts"]},
    }
    assert values["tables"]["joints"]["rows"] == ROWS
    assert values["sentences"][0]["text"] == "no shaft has a rating: a bearing of joint2 swings"
    json.dumps(values)
