"""Numbers of joints by name and by position: any order gives the same columns, and one message has all faults."""

import numpy as np
import pandas as pd
import pytest

from tolstat.campaign.inputs import MAX_NAMED, columns_of
from tolstat.common.errors import InputError

NEEDED, OTHERS = ["pin1.tilt_t", "pin1.offset_t", "hole2.diameter"], ["pin1.tilt_z", "operation.torque"]
X = np.array([[0.01, 1e-5, 2e-5], [0.02, 3e-5, 4e-5]])
FRAME = pd.DataFrame(X, columns=NEEDED)


def read(values):
    return columns_of(values, NEEDED, OTHERS, "names")


def mapping(frame):
    return {name: frame[name].tolist() for name in frame}


def test_other_columns_are_read_where_they_are():
    assert read(FRAME.assign(**{"operation.torque": [5.0, -5.0]}))["operation.torque"].tolist() == [5.0, -5.0]


def faults_of(values):
    with pytest.raises(InputError) as caught:
        read(values)
    return [(fault.found, fault.remedy) for fault in caught.value.faults]


def test_one_message_has_what_is_missing_and_unknown():
    found = faults_of(FRAME.rename(columns={"pin1.tilt_t": "pin1.tilt_tt"}).drop(columns="hole2.diameter"))
    assert found == [
        ("lack pin1.tilt_t, hole2.diameter", "give a column for each of f.names"),
        ("'pin1.tilt_tt' is unknown", "did you mean 'pin1.tilt_t'?"),
    ]


def test_many_unknown_columns_are_counted():
    many = {f"load{number}": X[:, 0] for number in range(MAX_NAMED + 3)}
    assert faults_of(FRAME.assign(**many)) == [
        ("have unknown ones: load0, load1, load2, load3, load4 and 3 more", "leave them out: x[f.names]")
    ]


def test_two_lines_of_headers():
    frame = FRAME.copy()
    frame.columns = pd.MultiIndex.from_tuples([(name, "m") for name in NEEDED])
    found = faults_of(frame)
    assert [text.split(":")[0] for text, _ in found] == [
        "lack pin1.tilt_t, pin1.offset_t, hole2.diameter",
        "have names that are no text",
    ]
    assert "droplevel(1, axis=1)" in found[1][1]
    assert list(read(frame.droplevel(1, axis=1))) == NEEDED


def test_columns_that_are_no_numbers_or_of_other_lengths():
    twice = pd.concat([FRAME, FRAME[["pin1.tilt_t"]]], axis=1)
    assert faults_of(twice) == [("have more than one pin1.tilt_t", "give one")]
    values = mapping(FRAME) | {"pin1.offset_t": [1.0], "hole2.diameter": ["a", "b"], "operation.torque": 5.0}
    assert faults_of(values) == [
        ("has values that are no real numbers", "give a number for each joint and error, in SI units"),
        ("has shape (1,)", "give one dimension of length 2"),
        ("has shape (1,)", "give one dimension of length 2"),
    ]
