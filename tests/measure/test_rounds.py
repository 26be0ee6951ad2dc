"""The counts by cause add up to all evaluations of the lanes."""

from __future__ import annotations

import pytest

from tests.measure.rounds import causes
from tests.support.environment import ROOT
from tests.support.kernel_states import sample
from tolstat.study import load

STUDY = ROOT / "studies" / "rigid_shafts.toml"


@pytest.mark.slow
def test_shares_of_all_causes_sum_to_one():
    rows = causes(sample(load(STUDY).at(""), 24), 12)
    shares = [float(row[2].rstrip("%")) for row in rows[1:] if row[2].endswith("%")]
    assert sum(shares) == pytest.approx(100, abs=0.5)
    assert min(shares) >= 0
