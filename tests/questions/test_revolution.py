"""Loads over the input angle: read or simulated again, their band, and the error that scatters them at the peak."""

import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.support import synthetic
from tolstat import study
from tolstat.campaign import run as campaign
from tolstat.common.cardan import CARDAN
from tolstat.common.channels import channels
from tolstat.common.load_kinds import kinds
from tolstat.common.loads import loads_of
from tolstat.display.answer import Asked, Panels, Sentence
from tolstat.questions.causes.errors import causes, causes_on_page
from tolstat.questions.causes.revolution import followed, over_angle
from tolstat.store import ResultFile, revolutions
from tolstat.store.revolutions import Revolutions

TEXT = synthetic.STUDY.replace("n = 60", "n = 900").replace("offset_t", "offset_[tz]")
SIGMA = 1e-4 / 3


@pytest.fixture(scope="module")
def stores(tmp_path_factory):
    """The same few joints with whole histories, with harmonics, and with none."""
    folder = tmp_path_factory.mktemp("revolutions")
    found = {}
    for kind in ("full", "harmonics", "none"):
        source = folder / f"{kind}.toml"
        text = synthetic.WHOLE.replace("n = 60", "n = 4") + f'\n[output]\nhistories = "{kind}"\nharmonics = 60\n'
        source.write_text(text, encoding="utf-8")
        campaign.run(study.load(source), folder / f"{kind}.h5", workers=1)
        found[kind] = folder / f"{kind}.h5"
    return found


FORCES = [f"{place}.F" for place in kinds(CARDAN)["F"].places]
SHAFTS = ["input.f_x", "output.lateral", "output.moment", "output.axial", "input.drive"]


def of(found, names):
    """Values of several channels, (m, k, names)."""
    return np.stack([found.loads[name] for name in names], axis=-1)


def test_loads_are_the_same_wherever_they_are_from(stores):
    rows = np.array([0, 2, 4])
    found = {}
    for kind, path in stores.items():
        with ResultFile.open(path) as store:
            found[kind] = revolutions.read(store, rows, FORCES + SHAFTS, 180)
            results = store.results()[rows]
    assert [found[kind].origin for kind in stores] == ["stored", "harmonics", "simulated again"]
    assert found["none"].apart == 0.0
    largest = results["F_max"]
    assert of(found["full"], FORCES).max(axis=1) == pytest.approx(largest, rel=1e-4)  # between the samples
    for name in SHAFTS[1:]:
        top = found["full"].loads[name].max(axis=1)
        load = loads_of(CARDAN)[name]
        own, scale = load.of(results), largest.max() if load.unit == "N" else results["T_max"].max()
        assert top == pytest.approx(own, abs=2e-3 * scale), name
    assert all(np.array_equal(found["full"].loads[name], found["none"].loads[name]) for name in FORCES + SHAFTS)
    np.testing.assert_allclose(of(found["harmonics"], FORCES), of(found["full"], FORCES), rtol=0.02)
    scale = largest.max()  # shafts' forces are small differences of bushing forces
    np.testing.assert_allclose(of(found["harmonics"], SHAFTS), of(found["full"], SHAFTS), atol=0.01 * scale)
    assert found["full"].angles[1] == pytest.approx(np.radians(2.0))
    with ResultFile.open(stores["none"]) as store:
        coarse = revolutions.read(store, rows, SHAFTS, 60)
    assert np.array_equal(of(coarse, SHAFTS), of(found["none"], SHAFTS)[:, ::3])


@pytest.fixture
def known(tmp_path, monkeypatch):
    """Campaign whose load cross2.F is made by one error at 0 and by another one at 90 degrees."""

    def invented(store, slots, names, most_angles=60):
        theta = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False)
        errors = store.errors()[slots]
        one, other = (errors[name][:, None] / SIGMA for name in ("pin1.offset_t", "pin3.offset_z"))
        load = 600.0 + 20.0 * one * np.cos(theta) + 10.0 * other * np.sin(theta)
        loads = {name: load if channels(CARDAN)[name].unit == "N" else 0.1 * load for name in names}
        return Revolutions(theta, loads, "stored", 0.0)

    monkeypatch.setattr(revolutions, "read", invented)
    return synthetic.store(tmp_path, TEXT, "known", failed=5)


def of_loads(path, loads, joints=800):
    """Panels by key, and the sentence, of some loads over the input angle."""
    with ResultFile.open(path) as store:
        panels, sentence = over_angle(store.view(), loads, joints)
    return {panel.key: panel for panel in panels.panels}, sentence.text


def test_the_error_at_the_peak_is_named_with_its_share(known):
    """At the peak, 0 or 180 degrees, one error makes the load; the other one acts at 90 degrees only."""
    _, said = of_loads(known, ["cross2.F"])
    angle, error, share = re.search(r"peak at (\d+)°.*; (\S+) scatters it most there, (\d+) %", said).groups()
    assert (int(angle) in (0, 180), error) == (True, "pin1.offset_t")
    assert int(share) >= 95
    assert "the first 800 settled joints, from the histories in the file" in said


def test_the_band_holds_ninety_per_cent_of_the_joints(known):
    panels, _ = of_loads(known, ["cross2.F"])
    ax = Figure().subplots()
    panels["angle-cross2-F"].draw(ax)
    median, nominal = (line.get_ydata() for line in ax.get_lines())
    assert nominal == pytest.approx(np.full(13, 600.0))
    assert median == pytest.approx(600.0, abs=4.0)
    (band,) = ax.collections
    low, _, high, _ = band.get_datalim(ax.transData).get_points()[:, 1].repeat(2)
    assert high - low == pytest.approx(2 * 1.645 * 20.0, rel=0.15)


def test_causes_tell_the_peak_where_the_file_holds_histories(known, monkeypatch):
    def sentences():
        with ResultFile.open(known) as store:
            return " ".join(part.text for part in causes(store.view(), "cross2.F").parts if isinstance(part, Sentence))

    assert "has its peak at" not in sentences()
    monkeypatch.setattr("tolstat.questions.causes.errors.held", lambda store, histories: "stored")
    assert "cross2.F has its peak at" in sentences()


def test_page_draws_the_leading_loads_over_the_input_angle(known):
    asked, without = Asked(known, replay=800), Asked(known, replay=0)
    with ResultFile.open(known) as store:
        view = store.view()
        found, none = causes_on_page(view, asked), causes_on_page(view, without)
        followed = [name for name in view.leading if name in channels(view.mechanism)]
    keys = [panel.key for block in found.blocks() if isinstance(block, Panels) for panel in block.panels]
    assert asked.notes == []
    assert [key for key in keys if not key.startswith("tornado")] == [f"angle-{x.replace('.', '-')}" for x in followed]
    assert not [part for part in none.parts if isinstance(part, Sentence) and "peak" in part.text]


def test_few_settled_joints_and_other_loads_have_no_picture(known, tmp_path):
    few = synthetic.store(tmp_path)
    with ResultFile.open(few) as store:
        (said,) = over_angle(store.view(), ["cross1.F"])
        assert "60 settled joints to evaluate, 100 are needed" in said.text
        assert over_angle(store.view(), []) == []
        assert followed(store.view(), ["cross1.F", "pin1.contact", "any limit"]) == ["cross1.F"]
