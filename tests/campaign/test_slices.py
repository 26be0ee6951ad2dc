"""Slices of a campaign: joints keep their number, whatever part of the campaign a file holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tolstat
from tests.support import synthetic
from tolstat import study
from tolstat.common.tables import Status
from tolstat.questions import compare

LIMITED = synthetic.REAL.partition("[limits]")[0] + '[limits]\n"cross1.F" = "700 N"\n'
OF_LOTS = (
    synthetic.HEAD
    + synthetic.SOLVER
    + """[tolerances]
"pin*.tilt_z" = { plus_minus = "0.5 deg", distribution = "normal", lot = { share = 0.6 } }
[limits]
"cross1.F" = "650 N"
[sampling]
n = 210
joints_per_lot = 5
"""
)


def load(folder: Path, text: str, name: str = "plan") -> study.Study:
    (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return study.load(folder / f"{name}.toml")


@pytest.mark.parametrize("rows", [range(25), range(6, 25), range(10, 20)])
def test_until_row_is_a_row_of_the_campaign(tmp_path: Path, rows: range) -> None:
    plan, path = load(tmp_path, LIMITED.replace("n = 60", "n = 24")), tmp_path / "a.h5"
    counts = tolstat.run(plan, path, workers=1, rows=rows, until_row=15, check=False)
    assert counts.done == 15 - rows.start
    with tolstat.open(path) as store:
        assert ((store.status() != Status.PENDING) == (np.array(rows) < 15)).all()
    assert tolstat.run(plan, path, workers=1, rows=rows, check=False).done == len(rows)


@pytest.mark.slow
def test_joints_of_slices_are_paired_by_their_number(tmp_path: Path) -> None:
    """The same study in slices that overlap, and without the nominal joint: the same joints have the same loads."""
    plan = load(tmp_path, LIMITED)
    bare = load(tmp_path, LIMITED.replace("n = 60", "n = 60\nnominal_first = false"), "bare")
    files = {
        "whole": (plan, range(61)),
        "first": (plan, range(40)),
        "last": (plan, range(20, 61)),
        "bare": (bare, range(10, 50)),
    }
    for name, (of, rows) in files.items():
        tolstat.run(of, tmp_path / f"{name}.h5", workers=1, rows=rows, check=False)
    common = {("whole", "last"): range(20, 61), ("first", "last"): range(20, 40), ("last", "bare"): range(20, 51)}
    for (one, other), rows in common.items():
        with tolstat.open(tmp_path / f"{one}.h5") as a, tolstat.open(tmp_path / f"{other}.h5") as b:
            sides, answer = compare.sides(a.view(), b.view()), tolstat.compare(a.view(), b.view(), ["cross1.F"])
            assert sides.rows.tolist() == list(rows), (one, other)
            of_a, of_b = (side.values for side in sides.load("cross1.F"))
        assert sides.paired
        np.testing.assert_array_equal(of_a, of_b)
        assert np.unique(of_a).size == len(rows)
        assert (answer.frame("loads")["estimate"] == 0.0).all()
        assert answer.frame("switched").empty


def test_lots_of_a_slice_are_those_of_the_campaign(tmp_path: Path) -> None:
    """A slice that begins and ends within a lot holds 34 of 42 lots, the first and the last of them in part."""
    plan, path = load(tmp_path, OF_LOTS), tmp_path / "part.h5"
    tolstat.run(plan, path, workers=1, rows=range(18, 185), check=False)
    with tolstat.open(path) as store:
        (row, *_) = tolstat.capability(store.view()).tables["lots"].rows
        above = store.results()["F_max"][:, 0] > 650.0
    samples = np.arange(17, 184)  # the nominal joint is row 0
    lot, n = np.unique(samples // 5, return_counts=True)
    shares = np.bincount(samples // 5, above)[lot] / n
    assert row["lots"] == len(lot)
    assert (row["median"], row["worst"]) == (np.median(shares), shares.max())
    assert 0 < above.sum() < len(above)
