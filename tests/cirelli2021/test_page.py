"""The paper's study end to end on few joints: its answers pinned, its page complete, its pictures real."""

from __future__ import annotations

import base64
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from studies.cirelli2021 import page_checks as paper_checks
from studies.cirelli2021 import page_equations as paper_equations
from studies.cirelli2021 import page_source as paper_source
from studies.cirelli2021 import reproduce
from studies.cirelli2021.page import context
from tests.support import reports
from tolstat import study
from tolstat.campaign import run as campaign
from tolstat.common.tables import Status
from tolstat.store import ResultFile

VARIANTS = """
[[variant]]
name = "mode"

[[variant]]
name = "as printed"
joint.base = "cirelli2021_as_printed"
cases = ["Pos fork +z", "Ang cross +t"]

[[variant]]
name = "clearance"
points = 2
vary.contact.D_P = { from = "75.8 mm", to = "75.2 mm" }

[[variant]]
name = "search"
design = "sobol"
points = 2
seed = 1
vary.contact.D_P = { from = "75.9 mm", to = "75.4 mm" }
vary.cross.R = { from = "60 mm", to = "90 mm" }
"""


pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result(tmp_path_factory) -> Path:
    """File of the study with all of its cases but few of its variants."""
    folder = tmp_path_factory.mktemp("paper")
    whole = reproduce.STUDY.read_text(encoding="utf-8")
    (folder / "small.toml").write_text(whole[: whole.index("[[variant]]")] + VARIANTS, encoding="utf-8")
    campaign.run(study.load(folder / "small.toml"), folder / "small.h5", workers=1)
    return folder / "small.h5"


@pytest.fixture(scope="module")
def small(result) -> paper_source.PaperStudy:
    with ResultFile.open(result) as store:
        assert paper_source.matching(store)
        return paper_source.read(store)


def test_all_joints_of_the_first_variant_settle(small):
    assert (small.main.results["status"] == Status.OK).all()
    assert len(small.main.case) == 42


def test_answers_to_the_paper_s_statements(small):
    assert {a.key: a.yes for a in small.answers} == {
        "output_side": False,  # an offset along z loads all eight bushings alike
        "input_springs": False,
        "one_pin": False,
        "angular_torque": True,
        "force_size": True,
        "torque_size": True,
        "together": False,  # a tilt about z raises forces, one about t torques
        "milder_force": False,
        "milder_torque": False,
        "spectrum": False,  # odd orders come up
        "marginal": True,
        "psi_grows": True,
        "analytic": True,
        "settling": True,
        "settling_printed": False,
    }


def test_figures_in_the_answers(small):
    said = {a.key: a.figures for a in small.answers}
    assert "largest increase +15.2 % (Ang fork +z at 15°)" in said["force_size"]
    assert "largest increase +28.9 % (Ang cross -t at 15°)" in said["torque_size"]
    assert "at most 1.6 % in 32 of 40 joints" in said["output_side"]
    assert "order 1 of a torque" in said["spectrum"]


def test_output_pins_carry_equal_forces_at_0_degrees(small):
    """Statics, for position errors; a tilt turns the contact's direction a little."""
    for row in np.flatnonzero(small.main.alpha == 0.0):
        first, second = small.main.results["F_max"][row, :2]
        name = small.cases[small.main.case[row]]
        assert first == pytest.approx(second, rel=2e-2 if name.startswith("Ang") else 1e-3)


def test_contact_of_the_ideal_joint_at_0_degrees_is_statics(small):
    row = small.ideal(0.0)
    arm = small.joint.cross.R + 0.5 * small.joint.contact.z
    assert small.main.contact[row, 0, :, 0] == pytest.approx(100.0 / (2.0 * arm), rel=2e-4)
    assert small.main.couple[row] == pytest.approx(100.0, rel=1e-5)


def test_distances_from_the_printed_tables(small):
    found = {d.table: d for d in context(small)["distances"]}
    assert found[0].mean == pytest.approx(3.62, abs=0.02)
    assert found[0].worst == pytest.approx(18.5, abs=0.1)
    assert found[-1].mean == pytest.approx(6.90, abs=0.03)
    assert found[0].correlation == pytest.approx(0.66, abs=0.02)
    assert {m.case for m in small.matches} >= {"Ang fork +z", "Ang cross -z"}


def test_mobility_and_misprints(small):
    rows = {(r[0], r[1]): r[2:] for r in paper_equations.mobility(small)}
    assert rows["RRRR", "ideal"] == (-2, 20, "17", "1")
    assert rows["RCCC", "ideal"] == (1, 17, "17", "1")
    said = " ".join(f"{c.printed} {c.computed}" for c in paper_checks.misprints(small))
    for text in ("1.18e+04 N s/m", "3.73e+08", "28956 mm", "8.78e-12", "38.0 mm"):
        assert text in said


def test_rigid_linkage_with_inertia_and_flexible_joint_pass_the_same_couple(small):
    rows = paper_equations.linkage(small)
    assert [row.printed for row in rows[:5]] == ["ideal", "Pos fork", "Ang fork", "Pos cross", "Ang cross"]
    for row in rows:
        assert row.couple_flexible == pytest.approx(row.couple_inertia, rel=1e-4 if row.alpha == 0.0 else 0.01)
        quasi = pytest.approx(row.couple_rigid, rel=0.01)
        assert (row.couple_flexible == quasi) == (row.alpha == 0.0)  # the shaft's inertia counts


def test_a_law_changes_single_loads_and_misprints_say_their_effect(small):
    (law,) = small.laws
    assert law.name == "mode"
    effects = {m.what.split(",")[0]: m.effect for m in paper_checks.misprints(small)}
    assert "instead of 2.3 revolutions" in effects["ρ"]
    assert effects["clearance"].startswith("0.76 mm (radially 0.50 mm run): Pos 3.0 → ")


def test_statics_excludes_by_the_lever_that_each_joint_has(small):
    found = {x.case: x for x in small.exclusions()}
    assert all(x.joints == 6 for x in found.values())
    assert found["Pos fork"].excluded == found["Pos cross"].excluded == 6
    assert found["Pos fork"].out[0] < 0.5 < found["Pos fork"].out[1]


class Page(HTMLParser):
    """Text and pictures of a page; fails where a tag is not closed."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.pictures: list[bytes] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "img":
            self.pictures.append(base64.b64decode((dict(attrs)["src"] or "").removeprefix("data:image/png;base64,")))
        elif tag not in ("meta", "br", "p"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert tag == "p" or self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.mark.slow
def test_page_is_whole_and_stands_alone(result, tmp_path):
    assert "Table 4" in reproduce.build(result, tmp_path / "small")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["small_paper.html", "small_tables.csv"]
    source = (tmp_path / "small_paper.html").read_text(encoding="utf-8")
    page = Page()
    page.feed(source)
    assert page.open == []
    assert len(page.pictures) == 10
    assert all(p.startswith(b"\x89PNG") and len(p) > 10_000 for p in page.pictures)
    assert not re.search(r"(src|href)=\"(?!data:|#)", source)
    for text in ("Table 4", "Table 7", "Figures 5 and 12 to 22", "Does any choice", "RCCC", "Misprints"):
        assert text in page.text
    assert "nan" not in page.text.replace("Pennestrì", "").split()
    table = pd.read_csv(tmp_path / "small_tables.csv")
    assert len(table) == 128
    row = table[(table["case"] == "Ang fork") & (table["bushing"] == "cross1") & (table["load"] == "Gamma_T")]
    assert row["printed"].tolist() == [31.6, 24.9]


def test_other_cases_get_a_plain_table(result, tmp_path):
    text = result.with_suffix(".toml").read_text(encoding="utf-8")
    head = text[: text.index("[[case]]")]
    (tmp_path / "own.toml").write_text(
        head + '[[case]]\nname = "bent"\nerrors.pin1.tilt_z = "0.5 deg"\n', encoding="utf-8"
    )
    campaign.run(study.load(tmp_path / "own.toml"), tmp_path / "own.h5", workers=1)
    with pytest.raises(ValueError, match="does not hold the paper's cases"):
        reproduce.build(tmp_path / "own.h5", tmp_path / "own")
    built = reports.build(tmp_path / "own.h5")
    assert [p.name for p in built.files] == ["own_cases.csv"]
    table = pd.read_csv(built.files[0])
    assert table["case"].tolist() == ["ideal", "bent"] * 2
    expected = 100.0 * (table["cross1.T [N*m]"][1] / table["cross1.T [N*m]"][0] - 1.0)
    assert table["cross1.Gamma_T [%]"][1] == pytest.approx(expected)
    assert "bent" in built.table


@pytest.mark.slow
def test_another_joint_is_shown_beside_printed_constants(result, tmp_path):
    """The first variant's joint counts, a third misalignment does no harm, and without a search there is no section."""
    whole = result.with_suffix(".toml").read_text(encoding="utf-8")
    head = whole[: whole.index("[[variant]]")].replace('["0 deg", "15 deg"]', '["0 deg", "30 deg", "15 deg"]')
    own = 'joint.cross.r_b = "30 mm"\njoint.bushing.fork.k_x = "1e9 N/m"\njoint.contact.k1u = "5e7 N/mm^2"\n'
    (tmp_path / "own.toml").write_text(f'{head}[[variant]]\nname = "own"\n{own}', encoding="utf-8")
    campaign.run(study.load(tmp_path / "own.toml"), tmp_path / "own.h5", workers=1)
    with ResultFile.open(tmp_path / "own.h5") as store:
        own_study = paper_source.read(store)
    assert own_study.joint.cross.r_b == 0.03
    assert own_study.base.cross.r_b == 0.03641
    assert (len(own_study.results), own_study.joints) == (42, 63)
    assert own_study.main.couple[own_study.ideal(0.0)] == pytest.approx(100.0, rel=1e-5)
    shown = context(own_study)
    rows = {row.name: row.values for row in shown["equations"]["stiffness"] + shown["equations"]["contact"]}
    assert rows["k_x [N/m]"][3:5] == (2.14e9, 1e9)
    assert rows["k1u [N/m²]"][:2] == (7.5e13, 5e13)
    assert shown["search"] is None
    reproduce.build(tmp_path / "own.h5", tmp_path / "own")
    page = Page()
    page.feed((tmp_path / "own_paper.html").read_text(encoding="utf-8"))
    assert "Does any choice" not in page.text
    assert "7.5e+13" in page.text
    assert "-0.0 " not in page.text
