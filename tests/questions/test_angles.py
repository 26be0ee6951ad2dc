"""Loads over the input angle: read or simulated again, and the errors that make them scatter at each angle."""

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from tests.support import synthetic
from tolstat import study
from tolstat.campaign import run as campaign
from tolstat.cli import app
from tolstat.common.channels import CHANNELS
from tolstat.common.errors import InputError, StoreError
from tolstat.common.load_kinds import BUSHINGS
from tolstat.common.loads import LOADS, SHOWN_LOADS
from tolstat.display.answer import Asked, Panels
from tolstat.questions.causes import angles
from tolstat.questions.causes.angles import against_angle, angles_on_page
from tolstat.questions.causes.errors import causes_on_page
from tolstat.questions.causes.worst import drawn, joint_rows, worst_on_page
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


FORCES = [f"{place}.F" for place in BUSHINGS]
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
        own, scale = LOADS[name].of(results), largest.max() if LOADS[name].unit == "N" else results["T_max"].max()
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
        loads = {name: load if CHANNELS[name].unit == "N" else 0.1 * load for name in names}
        return Revolutions(theta, loads, "stored", 0.0)

    monkeypatch.setattr(revolutions, "read", invented)
    return synthetic.store(tmp_path, TEXT, "known", failed=5)


def test_each_error_has_its_share_where_it_acts(known):
    with ResultFile.open(known) as store:
        found = against_angle(store.view(), ["cross2.F"], 800)[0]
    assert (found.facts["joints"], found.names[:2]) == (800, ("pin1.offset_t", "pin3.offset_z"))
    assert found.nominal == pytest.approx(np.full(12, 600.0))
    square = np.stack([400.0 * np.cos(found.angles) ** 2, 100.0 * np.sin(found.angles) ** 2])
    assert found.first.estimate[:2] == pytest.approx(square / square.sum(axis=0), abs=0.1)
    assert found.overall.estimate[:2] == pytest.approx([0.8, 0.2], abs=0.05)
    assert np.abs(found.first.estimate[2:]).max() < 0.06
    assert found.overall.lower[0] < 0.8 < found.overall.upper[0]
    low, middle, high = found.spread
    assert middle == pytest.approx(600.0, abs=4.0)
    assert (high - low)[0] == pytest.approx(2 * 1.645 * 20.0, rel=0.15)


def test_command_writes_shares_and_picture(known, tmp_path):
    arguments = ["--by", "cross2.F", "--out", str(tmp_path / "out"), "--top", "2"]
    done = CliRunner().invoke(app, ["angles", str(known), *arguments])
    assert done.exit_code == 0
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines] == ["error", "pin1.offset_t", "pin3.offset_z"]
    assert lines[2].split()[-1] in ("90", "270")
    table = pd.read_csv(tmp_path / "out" / "known_angles_angles.csv")
    assert len(table) == 12 * 8
    assert table.groupby("theta")["share"].sum().to_numpy() == pytest.approx(1.0, abs=0.15)
    assert len(pd.read_csv(tmp_path / "out" / "known_angles_revolution.csv")) == 8
    for key in ("angle-cross2-F", "angle-shares-cross2-F"):
        assert (tmp_path / "out" / f"known_angles_{key}.png").read_bytes().startswith(b"\x89PNG")


def test_page_draws_loads_over_the_revolution(known):
    asked = Asked(known, replay=800)
    with ResultFile.open(known) as store:
        view = store.view()
        found = [on_page(view, asked) for on_page in (causes_on_page, angles_on_page, worst_on_page)]
        bushings = [name for name in view.leading if name in SHOWN_LOADS]
        worst, samples = joint_rows(view, bushings[0], 3), drawn(view, bushings[0])
        errors = view.errors(np.sort(samples))["pin1.offset_t"][np.argsort(np.argsort(samples))]
    assert asked.notes == []
    panels = {
        panel.key: panel
        for answer in found
        for block in answer.blocks()
        if isinstance(block, Panels)
        for panel in block.panels
    }
    keys = [name.replace(".", "-") for name in bushings]
    histories = [key for key in panels if not key.startswith("tornado")]
    assert histories == [f"angle{part}-{key}" for key in keys for part in ("", "-shares")] + [
        f"worst-{key}" for key in keys
    ]
    ax = Figure().subplots()
    panels[f"worst-{keys[0]}"].draw(ax)
    lines = ax.get_lines()[:3]
    assert [line.get_label() for line in lines] == [f"row {joint['row']}" for joint in worst]
    assert [line.get_ydata()[0] for line in lines] == pytest.approx(600.0 + 20.0 * errors / SIGMA)


def test_shares_that_are_no_more_than_chance_have_no_minus_before_zero():
    shares = [cell.cell for cell in angles.COLUMNS if cell.head == "revolution, %"]
    assert [cell({"share": x}) for cell in shares for x in (-1e-4, -6e-4, 0.1234)] == ["0.0", "-0.1", "12.3"]


def test_components_and_loads_of_shafts_have_shares_in_their_unit(known):
    with ResultFile.open(known) as store:
        found = against_angle(store.view(), ["fork1.T_e", "output.moment", "output.f_x"], 400)
    assert [angle.facts["unit"] for angle in found] == ["N*m", "N*m", "N"]
    assert all(angle.names[0] == "pin1.offset_t" for angle in found)


def test_what_has_no_shares_is_refused(known, tmp_path):
    few, sweep = synthetic.store(tmp_path), synthetic.store(tmp_path, synthetic.SWEEP, "sweep")
    with ResultFile.open(known) as store, pytest.raises(InputError, match="is not a load over the input angle"):
        against_angle(store.view(), ["pin1.contact"])
    for path, text in ((few, "100 are needed"), (sweep, "not drawn from tolerances")):
        with ResultFile.open(path) as store, pytest.raises(StoreError, match=text):
            against_angle(store.view(), ["cross1.F"])
