"""Wording: rows of a drive shaft's study are shafts; what is a joint stays one."""

from __future__ import annotations

import pytest

from tolstat.common.cardan import CARDAN, SHAFT
from tolstat.common.wording import AS_WRITTEN, Wording

STUDY = """
[fatigue.point."rear joint"]
load = "cross1.F"

[[variant]]
name = "Joint of 1998"
"""
ROWS = {
    "17 % of the joints exceed 1000 N": "17 % of the shafts exceed 1000 N",
    "Joints above each limit": "Shafts above each limit",
    "joints": "shafts",
    "128 of 513 joints, 2.9 joints/s, 2:12 left": "128 of 513 shafts, 2.9 shafts/s, 2:12 left",
    "w.h5: 25 joints, 0 failed": "w.h5: 25 shafts, 0 failed",
    "the joint without errors; nominal joint": "the shaft without errors; nominal shaft",
    "in every joint a bearing of joint2 swings": "in every shaft a bearing of joint2 swings",
    "the worst joint 17, joint2.fork3.T": "the worst shaft 17, joint2.fork3.T",
    "(joints) that joints' lives": "(shafts) that shafts' lives",
    "rear joint: fails in 3 joints": "rear joint: fails in 3 shafts",
    "Joint of 1998 is another joint": "Joint of 1998 is another shaft",
    "joint study_limits.csv of 2 joints": "joint study_limits.csv of 2 shafts",
}
KEPT = [
    *("joint1", "joint*.cross*.F", "joint.contact.law=sliced", "[joint.bearing]", "fork of joint 1, joint 2 of 6 deg"),
    *("both joints", "a Cardan joint", "Universal joints", "between the joints", "a drive shaft of two joints"),
    *("the joint file", "centre of the joint", "from the joint's centre", "contact.clearance of the joint"),
    *(
        "The joint from its own dimensions",
        "keys of the joint",
        "add to [bearing] of the joint",
        "give the joint friction.mu",
        "at the joint's speed and misalignment",
    ),
    *("--joints 24", "/data/joint/a.toml", "joints/pin25.toml", "joint.h5", "joints_per_lot", "'joint'", "shafts"),
]


@pytest.fixture
def wording():
    return Wording.of(SHAFT, STUDY, ["joint study", "joint"])


@pytest.mark.parametrize("text", ROWS)
def test_a_row_is_a_shaft(wording, text):
    assert wording(text) == ROWS[text]
    assert wording(ROWS[text]) == ROWS[text]


@pytest.mark.parametrize("text", KEPT)
def test_what_is_no_row_keeps_its_name(wording, text):
    assert wording(text) == text


@pytest.mark.parametrize("text", [*ROWS, *KEPT])
def test_single_joints_are_told_as_written(text):
    assert Wording.of(CARDAN, STUDY) is AS_WRITTEN
    assert AS_WRITTEN(text) == text


def test_a_study_that_cannot_be_read_names_nothing():
    assert Wording.of(SHAFT, "[joint") == Wording("shaft")


def test_pins_of_linkages_are_in_eyes() -> None:
    told = Wording("mechanism")
    assert told("hole angles of 3 joints, larger than its hole") == "eye angles of 3 mechanisms, larger than its eye"
    assert told("the whole of hole1.tilt_t, hole*.diameter") == "the whole of hole1.tilt_t, hole*.diameter"
