"""Lots: marginals stay, joints of a lot are alike, and joint i depends on the seed and i alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from tests.support.synthetic import HEAD
from tolstat import sampling, study
from tolstat.common.errors import InputError
from tolstat.study import Study

LOT, SHARED = "lot = { share = 0.3 }", "lot = { share = 0.4, shared = true }"
OFFSET = '"hole*.offset_t" = {{ plus_minus = "0.1 mm", distribution = "normal"{} }}\n'
DIAMETER = '"pin*.diameter" = {{ lower = "-0.02 mm", upper = "0 mm", distribution = "uniform"{} }}\n'


def made(offset: str = LOT, diameter: str = SHARED, more: str = "joints_per_lot = 20", n: int = 4000) -> Study:
    entries = [entry.format(f", {key}" if key else "") for entry, key in ((OFFSET, offset), (DIAMETER, diameter))]
    text = f"{HEAD}[tolerances]\n{''.join(entries)}[sampling]\nn = {n}\nseed = 4\nnominal_first = false\n{more}\n"
    return study.load(Path("study.toml"), text=text)


def test_joints_of_a_lot_are_alike_and_the_marginals_stay() -> None:
    errors = sampling.draw(made(n=10_000))
    scores = stats.norm.ppf((errors["pin1.diameter"] + 2e-5) / 2e-5), errors["hole2.offset_t"] / (1e-4 / 3.0)
    for z, share in zip(scores, (0.4, 0.3), strict=True):
        assert stats.kstest(z.reshape(-1, 20)[:, 0], "norm").pvalue > 0.01  # one joint of each lot: independent
        lots = z.reshape(-1, 20)
        inside = lots.var(axis=1, ddof=1).mean()
        between = lots.mean(axis=1).var(ddof=1) - inside / 20
        assert inside == pytest.approx(1.0 - share, abs=0.02)
        assert between == pytest.approx(share, abs=0.08)


@pytest.mark.parametrize("more", ["", "joints_per_lot = 20"])
def test_errors_that_share_the_score_of_a_lot_are_correlated_in_each_joint(more: str) -> None:
    errors = sampling.draw(made(more=more, n=10_000))
    z = stats.norm.ppf((errors["pin1.diameter"] + 2e-5) / 2e-5), stats.norm.ppf((errors["pin3.diameter"] + 2e-5) / 2e-5)
    assert np.corrcoef(*z)[0, 1] == pytest.approx(0.4, abs=0.05)
    assert abs(np.corrcoef(errors["hole1.offset_t"], errors["hole3.offset_t"])[0, 1]) < 0.05


def test_a_joint_depends_on_neither_slices_nor_number_nor_other_entries() -> None:
    whole = sampling.draw(made())
    for rows in (range(37), range(37, 1003), range(1003, 4000)):  # slices cut lots
        np.testing.assert_array_equal(sampling.draw(made(), rows), whole[rows.start : rows.stop])
    np.testing.assert_array_equal(sampling.draw(made(n=600)), whole[:600])
    alone = sampling.draw(made(diameter=""))
    np.testing.assert_array_equal(alone["hole2.offset_t"], whole["hole2.offset_t"])
    assert not np.array_equal(alone["pin1.diameter"], whole["pin1.diameter"])


def test_where_each_joint_is_its_own_lot_nothing_changes_unless_errors_share_it() -> None:
    plain, own = sampling.draw(made("", "", "")), sampling.draw(made(more=""))
    np.testing.assert_array_equal(plain["hole2.offset_t"], own["hole2.offset_t"])
    assert not np.array_equal(plain["pin2.diameter"], own["pin2.diameter"])
    assert own.tobytes() == sampling.draw(made(more="joints_per_lot = 1")).tobytes()


def test_lots_are_part_of_the_identity_of_studies_that_have_them() -> None:
    identity = made().identity()
    assert identity["lots.pin3.diameter"] == [0.4, "pin1.diameter"]
    assert identity["lots.hole3.offset_t"] == [0.3, "hole3.offset_t"]
    assert identity["sampling.joints_per_lot"] == 20
    assert not [key for key in made("", "", "").identity() if "lot" in key]


def test_faults() -> None:
    offset, diameter = OFFSET.format(f", {LOT}"), DIAMETER.format(", lot = { share = 1.5 }")
    radial = '"hole1.offset_radial" = { plus_minus = "0.1 mm", distribution = "rayleigh", lot = { share = 0.3 } }\n'
    pair = '[[correlation]]\nbetween = ["hole1.offset_t", "hole2.offset_t"]\nrho = 0.5\n'
    few = f"{HEAD}[tolerances]\n{diameter}{radial}[sampling]\nn = 60\njoints_per_lot = 20\n"
    with pytest.raises(InputError) as found:
        study.load(Path("s.toml"), text=few)
    for words in ("lot.share", "offset_t and offset_z", "give n = 600"):
        assert words in str(found.value)
    with pytest.raises(InputError, match=r"hole1\.offset_t has a lot already"):
        study.load(Path("s.toml"), text=f"{HEAD}[tolerances]\n{offset}{pair}[sampling]\nn = 60\n")
    with pytest.raises(InputError, match="no tolerance has a lot"):
        made("", "")
    with pytest.raises(InputError, match="n is given with 'sweep'"):
        made(more='joints_per_lot = 20\nmethod = "sweep"')
