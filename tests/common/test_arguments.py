"""Arguments of public functions: those of a wrong type are refused, all in one error."""

import numpy as np
import pytest

import tolstat
from tolstat.common.arguments import checked
from tolstat.common.errors import InputError
from tolstat.display.options import Load, Loads, Top

STUDY = "studies/clearance.toml"


def ask(view: object, top: Top, by: Load = None, level: float = 1.0, loads: Loads = None) -> tuple[object, ...]:
    """Stand in for a question."""
    return view, top, by, level, loads


@pytest.mark.parametrize("top", [3, np.int64(3), np.uint8(3)])
@pytest.mark.parametrize("level", [1, 1.5, np.float32(1.5), np.int16(2)])
@pytest.mark.parametrize(
    ("by", "loads"), [(None, None), ("cross1.F", ["cross1.F"]), ("cross1.F", ("cross1.F", "cross1.T"))]
)
def test_right_types_pass(top, level, by, loads):
    assert checked(ask)("any", top, by, level=level, loads=loads) == ("any", top, by, level, loads)


def test_wrong_types_are_told_together():
    with pytest.raises(InputError) as caught:
        checked(ask)("any", "3", 7, level="high", loads="cross1.F")
    assert str(caught.value).splitlines()[::2] == [
        "top: '3' is of type str",
        "by: 7 is of type int",
        "level: 'high' is of type str",
        "loads: 'cross1.F' is of type str",
    ]
    assert "give a text or None" in str(caught.value)


@pytest.mark.parametrize(
    "call",
    [
        lambda: tolstat.open(None),
        lambda: tolstat.extend("absent.h5", "80"),
        lambda: tolstat.run(STUDY, "absent.h5", workers="2"),
        lambda: tolstat.write_page("absent.h5", "page.html", accepted="1 %"),
        lambda: tolstat.replay("absent.h5", "5"),
        lambda: tolstat.load(STUDY, n=3.5),
        lambda: tolstat.plan(STUDY, pilot="9"),
    ],
)
def test_public_functions_refuse_them_first(call):
    with pytest.raises(InputError, match="is of type"):
        call()
