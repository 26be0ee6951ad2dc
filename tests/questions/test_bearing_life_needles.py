"""Load along the needles of the joint with the shortest life: against ISO/TS 16281 by its letter, and its picture."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import gamma

import tolstat
from tests.questions.test_bearing_life import held, view
from tests.support import synthetic
from tests.support.laminae import Needles
from tolstat import joint as joints
from tolstat.common.cardan import CARDAN
from tolstat.common.tables import Status
from tolstat.display.answer import Asked, Panels
from tolstat.joint import Operation
from tolstat.joint.laminae import relief
from tolstat.questions.bearing_life.answer import bearing_life_on_page
from tolstat.questions.bearing_life.needles import line_loads, pressed

NEEDLES = {"needles": 32, "needle_length": "22 mm", "needle_diameter": "4 mm", "pitch_diameter": "42 mm"}
OPERATION = Operation.model_construct(alpha=0.26, speed=50.0, torque=100.0)
STUDY = synthetic.HEAD + (
    "[joint.bearing]\n"
    'C = "33 kN"\nneedles = 32\nneedle_length = "22 mm"\nneedle_diameter = "4 mm"\npitch_diameter = "42 mm"\n'
    '[solver]\nfidelity = "quasistatic"\nsteps_per_rev = 36\n'
    '[tolerances]\n"pin1.tilt_z" = { plus_minus = "0.1 deg", distribution = "uniform" }\n'
    "[sampling]\nn = 4\nseed = 1\n"
)


def needle(force, end=0.0, turn=0.0, clearance=0.0, **profile):
    """Loads by length of a needle's laminae, N/mm, and all that the standard has, (laminae, positions); mm, N."""
    made = joints.load("cirelli2021", {"bearing": NEEDLES | profile}, "x.toml")
    par = joints.perturb(made, OPERATION, joints.nominal_errors(1, CARDAN)).view(np.recarray)[0]
    twin = Needles(profile=lambda x: 1e3 * relief(made.bearing, 0.022, x))
    r = twin.displaced(force, end, turn, clearance)
    ends = 1e-3 * np.array([r, end * np.cos(turn), end * np.sin(turn)])
    return 1e-3 * line_loads(tuple(ends), 1e-3 * clearance, 0, par), twin.loads(r, end, turn, clearance)[0] * 30 / 22


@pytest.mark.parametrize("profile", [{}, {"profile": "crowned", "end_relief": "5 um"}])
@pytest.mark.parametrize(("end", "turn"), [(1e-3, 0.0), (1e-2, 0.0), (5e-3, 0.7), (3e-2, 1.4), (5e-3, 2.5)])
def test_it_is_the_needle_with_the_most_loaded_lamina(profile, end, turn):
    """At the displacement at which all laminae of all needles together carry the force."""
    found, every = needle(3400.0, end, turn, 0.02, **profile)
    most = every.max(axis=0).argmax()
    np.testing.assert_allclose(found, every[:, most], atol=2e-3 * every.max())
    np.testing.assert_allclose(found.max(), every.max(), rtol=1e-5)


def test_in_line_the_needle_carries_its_share_of_the_force_evenly():
    """4.085 F/Z without clearance: over the mean of cos^(19/9) over a full turn where needles are loaded."""
    found, _ = needle(3400.0)
    share = gamma(14 / 9) / (2 * np.sqrt(np.pi) * gamma(37 / 18))
    np.testing.assert_allclose(found * 22 / 30, 3400.0 / (32 * share * 30), rtol=1e-4)


@pytest.mark.parametrize("clearance", [0.0, 0.02])
def test_without_tilt_it_is_symmetric(clearance):
    found, _ = needle(3400.0, clearance=clearance, profile="crowned", end_relief="5 um")
    np.testing.assert_allclose(found, found[::-1])
    assert found[15] > 1.2 * found[0]


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """Three joints tilted at pin 1 that are really simulated."""
    folder = tmp_path_factory.mktemp("needles")
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    tolstat.run(tolstat.load(folder / "study.toml"), folder / "study.h5", workers=1)
    return folder / "study.h5"


def test_the_joint_simulated_again_has_the_line_loads_of_the_file(file):
    with tolstat.open(file) as store:
        stored, tilt = (store.results()[name] for name in ("line_load", "tilt"))
        assert (store.results()["status"] == Status.OK).all()
        found = np.array([pressed(store, slot) for slot in range(len(stored))])
    assert np.ptp(tilt[:, 0]) > 5e-4
    np.testing.assert_allclose(found[:, :, 1].max(axis=2), stored, rtol=0.01)
    np.testing.assert_allclose(found[:, :, 0], np.broadcast_to(11e-3 * Needles().places(), (5, 4, 30)))


def drawn(answer):
    return [panel for part in answer.parts if isinstance(part, Panels) for panel in part.panels]


def test_the_picture_is_that_of_the_joint_with_the_shortest_life(file, tmp_path):
    with tolstat.open(file) as store:
        answer = tolstat.bearing_life(store.view())
        worst = int(store.results()["equivalent_load"][1:, 0].argmax()) + 1
        line = store.results()["line_load"][worst, 0]
        assert len(drawn(bearing_life_on_page(store.view(), Asked(file, replay=1)))) == 2
        assert len(drawn(bearing_life_on_page(store.view(), Asked(file)))) == 1  # nothing is simulated for it
        assert tmp_path / "x_needles.png" in answer.write(tmp_path / "x")
    (panel,) = (panel for panel in drawn(answer) if panel.key == "needles")
    assert f"row {worst} (shortest life)" in panel.title
    assert f"at most pin1 {1e-3 * line:.4g} N/mm" in panel.description


def test_no_picture_without_tilt_or_without_a_life():
    def ideal(results):
        results["line_load"] = np.nan

    unsettled = drawn(tolstat.bearing_life(view(5, failed=2, unsettled=2)))
    assert [panel.key for panel in drawn(tolstat.bearing_life(view(9)))] == ["lives", "needles"]
    assert [panel.key for panel in drawn(tolstat.bearing_life(view(9, change=ideal)))] == ["lives"]
    assert [panel.key for panel in drawn(tolstat.bearing_life(view(9, joint=held(), alpha=0.0)))] == []
    assert [panel.key for panel in unsettled] == []
