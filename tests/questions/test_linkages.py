"""Questions on campaigns of a mechanism from a study: what is changed, listed and refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import tolstat
from tests.support.environment import ROOT
from tolstat.campaign import replay
from tolstat.campaign.run import run
from tolstat.campaign.work import Work
from tolstat.common.errors import InputError, NotApplicable
from tolstat.questions.change import simulate
from tolstat.store import ResultFile, recorded
from tolstat.study import load

pytestmark = pytest.mark.slow
HINGES = (ROOT / "studies" / "hinge_line.toml").read_text(encoding="utf-8")
LISTED = """
[sampling]
method = "cases"

[[case]]
name = "off"
errors = { "middle_eye.offset_t" = "0.1 mm" }

[[variant]]
name = "as drawn"

[[variant]]
name = "loose"
joint = { contact = { clearance = "0.05 mm" } }

[limits]
"middle_eye.F" = "300 N"
"""


def made(folder: Path, text: str) -> Path:
    path = folder / "hinges.toml"
    path.write_text(text, encoding="utf-8")
    run(load(path), path.with_suffix(".h5"), workers=1, check=False)
    return path.with_suffix(".h5")


@pytest.fixture(scope="module")
def flaps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made(tmp_path_factory.mktemp("flaps"), HINGES.replace("n = 1000", "n = 128"))


def test_a_hinge_with_more_play_carries_less(flaps: Path) -> None:
    """0.1 mm is 3 sigma of the place of a hinge: with so much play the middle one hardly ever carries anything."""
    settings = ["mechanism.pair.middle.clearance=0.1 mm"]
    simulate(flaps, Work(workers=1, tell=lambda _: None), settings, most=128)
    with tolstat.open(flaps) as store:
        answer = tolstat.change(store.view(), settings)
    (row,) = answer.frame("limits").to_dict("records")
    assert row["after_upper"] < row["before_lower"]
    assert list(answer.facts["differs"].values()) == [pytest.approx(1e-4)]


def test_a_thinner_pin_of_one_hinge_is_a_change_of_the_same_mechanism(flaps: Path) -> None:
    """A pin of half the diameter is a sixteenth as stiff: the middle hinge carries less of what is left to it."""
    settings = ["mechanism.pair.middle.joint.pin.d=6 mm"]
    simulate(flaps, Work(workers=1, tell=lambda _: None), settings, most=128)
    with tolstat.open(flaps) as store:
        (row,) = tolstat.change(store.view(), settings).frame("limits").to_dict("records")
    assert row["after"] < row["before"]


def test_variants_change_pins_but_keep_what_a_pair_has_of_its_own(tmp_path: Path) -> None:
    """All hinges are loose in the second variant, but the lower one; replay computes it to the last bit."""
    own = 'joint.contact = { clearance = "0.03 mm", law = "sliced", n_stations = 3 }'
    middle = "\n[mechanism.pair.middle]"
    head, _, _ = HINGES.replace(middle, f"{own}\n{middle}").partition("[tolerances]")
    path = made(tmp_path, head + LISTED)
    with ResultFile.open(path) as store:
        clearances = recorded.parameters(store, np.arange(4))["clearance"]
        assert replay.replay(store, 3).differences == []
        assert recorded.in_words(store).endswith("contact laws sliced, uniform")
    np.testing.assert_allclose(clearances[:2], 3e-5)
    np.testing.assert_allclose(clearances[2:], [[3e-5, 5e-5, 5e-5]] * 2)


@pytest.mark.parametrize(
    ("setting", "found"),
    [
        ("mechanism.pair.middle.faces=both", "makes another mechanism: of the two one alone has middle_inner.F"),
        ("mechanism.pair.middle.colour=red", "unknown key"),
        ("mechanism.pair.middle.axis=[0, 1, 9]", "the drive cannot turn to"),
    ],
)
def test_a_change_makes_no_other_mechanism(flaps: Path, setting: str, found: str) -> None:
    with pytest.raises(InputError, match=found):
        simulate(flaps, Work(workers=1, tell=lambda _: None), [setting], most=128)


def test_bearings_of_a_linkage_have_no_rating_life(flaps: Path) -> None:
    with tolstat.open(flaps) as store, pytest.raises(NotApplicable, match="no Cardan joints"):
        tolstat.bearing_life(store.view())


def test_listed_mechanisms_have_their_table(tmp_path: Path) -> None:
    head, _, _ = HINGES.partition("[tolerances]")
    with tolstat.open(made(tmp_path, head + LISTED)) as store:
        view = store.view()
        table = tolstat.cases(view).frame("cases")
        assert "alpha [deg]" not in table
        forces = table["middle_eye.F [N]"].to_numpy()
        assert list(table["case"]) == ["ideal", "off"] * 2
        np.testing.assert_array_equal(forces, view.load("middle_eye.F").values)
        assert forces[1] > forces[3] > 100 * forces[2]
