"""Cost of a joint: operations counted by hand, tables with known rates, and the program."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tests.measure import cost, kernel_parts
from tests.measure.cost import Stint
from tests.measure.kernel_parts import Once
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


def test_the_split_adds_up_by_hand():
    once = Once(residual=5.0, contact=2.0, assembly=7.0, elimination=11.0, substitution=3.0)
    found = kernel_parts.split(100.0, 6.0, once, np.array([4.0, 1.0, 3.0]))
    assert [spent for spent, _ in found.values()] == [6.0, 8.0, 12.0, 7.0, 4.0, 9.0, 54.0]
    assert [each for _, each in found.values()] == [6.0, 2.0, 3.0, 7.0, 4.0, 3.0, 54.0]
    assert once.iteration() == 19.0
    assert once.iteration(4.0, 1.0, 3.0) == 40.0


def test_efficiency_is_counted_while_all_workers_are_busy():
    alone = [Stint(1, 10, float(k), k + 1.0, 1.0, 100.0 + k) for k in range(4)]
    # the second process begins half a second later and takes twice as long by the clock, not in processor time
    both = [
        *(Stint(1, 10, float(k), k + 1.0, 1.0, 100.0) for k in range(4)),
        *(Stint(2, 10, 0.5 + 2 * k, 2.5 + 2 * k, 1.0, 90.0) for k in range(2)),
    ]
    _, one, two = cost.efficiency({1: alone, 2: both})
    assert one == ["1", "10", "1", "1", "103", "3"]
    assert two[:4] == ["2", "15", "0.75", "1"]


POINTS = pd.DataFrame(
    [
        ("BDF2", True, 36.0, 2.0, 5e-3),
        ("BDF2", True, 90.0, 3.0, 5e-4),
        ("BDF2, 64 joints at once", True, 36.0, 1.0, 5e-3),
        ("BDF2, 64 joints at once", True, 90.0, 1.5, 5e-4),
        ("BDF2, 64 joints at once", True, 180.0, 2.0, 1e-4),
        ("Radau", False, 1e-2, 100.0, np.inf),
        ("Radau", False, 1e-3, 600.0, 9e-4),
        ("CVODE", False, 1e-2, 100.0, 0.1),
        ("CVODE", False, 1e-3, 900.0, np.inf),
    ],
    columns=["contender", "ours", "setting", "ms", "loads_worst"],
)


def test_contenders_are_compared_at_the_cheapest_setting_that_meets_the_error():
    found = {name: row for name, *row in cost.contenders(POINTS, 180)}
    assert found["BDF2"] == ["90", "3", "5.0e-04", "2", "1.5"]
    assert found["Radau"] == ["0.001", "600", "9.0e-04", "400", "300"]
    assert found["CVODE"] == ["none met", "> 900", "-", "> 600", "> 450"]


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
