"""Cost of a joint: operations counted by hand, tables with known rates, and the program."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measure import cost, kernel_parts
from tests.measure.operations import Counting, count_apart
from tests.support.environment import ROOT
from tests.support.kernel_states import sample, snapshots
from tolstat import study

STUDY = ROOT / "studies" / "rigid_shafts.toml"


def counted(function):
    Counting.done = 0
    value = function(Counting(3.0), Counting(2.0))
    return float(value), Counting.done


def test_numbers_count_what_is_done_with_them():
    array = np.array([2.0, 5.0])
    assert counted(lambda a, b: a * b + 1.0 - 2 / a) == pytest.approx((7 - 2 / 3, 4))
    assert counted(lambda a, b: array[1] * a - array[0]) == (13.0, 2)
    assert counted(lambda a, b: (a - b).sqrt()) == (1.0, 2)
    assert counted(lambda a, b: max(-a, abs(b))) == (2.0, 0)
    assert counted(lambda a, b: 1.0 if a > b and a != b else 0.0) == (1.0, 0)


@pytest.fixture(scope="module")
def these():
    return sample(study.load(STUDY), 8)


@pytest.mark.slow
def test_operations_are_those_of_the_structure(these):
    """The elimination does the same for any joint: counted along `linsolve`, block by block."""
    counts = count_apart(list(snapshots(these, 2)))
    three, six = 5, 11  # scalar products
    scaled = 3 + 6 + 1  # trace and its reciprocal, entries, factor of the inverse
    inverse = 2 * (18 + three + 7 + scaled) + 2 * 3 * 3 * three + 2 * 6 * (three + 1)  # of a block, by its 3 x 3 blocks
    lump = inverse + 6 * 6 * six + 21 * (six + 1)  # and the block of the one that follows
    corner = 2 * 6 * six + 3 * (six + 1)  # psi and s, of one lump
    output = 2 * 2 * 6 * (six + 1) + 2 * corner
    for count in counts:
        assert count["elimination"] == 8 * lump + 2 * output + inverse + corner + 5
        assert count["contact"] < count["residual"]
    assert counts[0]["substitution"] == counts[1]["substitution"]


@pytest.mark.slow
def test_parts_are_timed_and_the_program_prints_tables(monkeypatch, capsys):
    monkeypatch.setattr(cost, "workers", lambda *_: ("Workers", [["workers"]]))
    monkeypatch.setattr(kernel_parts, "TIMES", 100)
    cost.main([str(STUDY), "--quick", "--joints", "8"])
    lines = capsys.readouterr().out.splitlines()
    rows = {line.partition(" ")[0]: line.split() for line in lines if line}
    assert "8 joints on one core, 8 settled" in lines[2]
    assert all(float(rows[part][1]) > 0 for part in ("start", "contact", "bodies", "factor", "all"))
    (solver,) = (line.split() for line in lines if line.startswith("LAPACK's"))
    assert float(solver[-1]) > 1  # LAPACK does not know the structure
    assert lines[-1].startswith("first joint, kernels in the cache")
