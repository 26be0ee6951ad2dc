"""Orders of the shafts' loads: closed forms transformed by NumPy, orbits, and where the page shows them."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import tolstat
from tests.support import synthetic
from tolstat import cli, sampling, study
from tolstat.common.load_kinds import SHAFTS
from tolstat.common.tables import Options, Simulation
from tolstat.display.asked import Asked
from tolstat.kernel.revolution.orders import semi_major
from tolstat.questions.orders import query, rendering, section
from tolstat.solver.simulation import history_specs
from tolstat.store import Reader, ResultStore

ALPHA, TORQUE = np.radians(15.0), 100.0
STEPS = 360


def text(*, limit="cross1.F", output="", sampling="n = 60"):
    value = "1000 N"
    return (
        f'{synthetic.HEAD}\n[sampling]\n{sampling}\nmethod = "random"\n[limits]\n"{limit}" = "{value}"\n'
        f'[output]\n{output}\n[tolerances]\n"hole2.offset_t" = {{ plus_minus = "0.05 mm", distribution = "uniform" }}\n'
    )


def invented(folder, name, source, histories=None):
    """File of a study with invented results."""
    path = folder / f"{name}.toml"
    path.write_text(source, encoding="utf-8")
    plan = study.load(path)
    specs = {} if histories is None else {"shafts": history_specs(Options(steps_per_rev=STEPS), "full", 0)["shafts"]}
    with ResultStore.create(folder / f"{name}.h5", plan, sampling.draw(plan), specs) as store:
        kept = {} if histories is None else {"shafts": histories(plan.rows)}
        store.write(np.arange(plan.rows), Simulation(synthetic.results(plan.rows), kept))
        store.finish()
    return folder / f"{name}.h5"


def circles(rows):
    """Forces on the input shaft that turn with 10 N and the joint's row, on the output shaft that swing so."""
    angle, radius = 2 * np.pi * np.arange(STEPS) / STEPS, 10.0 + np.arange(rows)[:, None]
    loads = np.zeros((rows, STEPS, 2, 6), np.float32)
    loads[:, :, 0, 0], loads[:, :, 0, 1] = radius * np.cos(angle), radius * np.sin(angle)
    loads[:, :, 1, 0] = radius * np.cos(angle)
    return loads


@pytest.fixture(scope="module")
def turning(tmp_path_factory):
    source = text(output='histories = "full"\n', limit="output.lateral").replace(
        "[output]", f"[solver]\nsteps_per_rev = {STEPS}\n[output]"
    )
    return invented(tmp_path_factory.mktemp("orders"), "turning", source, circles)


def test_amplitudes_of_the_ideal_joint_are_those_of_its_closed_forms(tmp_path):
    """Moment T sin(beta) / cos(gamma) along the pins of the input shaft's fork, which turns by theta."""
    source = text().replace("[limits]", '[solver]\nfidelity = "ideal"\n[limits]').replace("500 rpm", "1 rpm")
    path = tmp_path / "ideal.toml"
    path.write_text(source, encoding="utf-8")
    tolstat.run(study.load(path), tmp_path / "ideal.h5", workers=1)
    theta = 2 * np.pi * np.arange(STEPS) / STEPS
    below = 1.0 - (np.sin(ALPHA) * np.cos(theta)) ** 2
    tau = np.cos(ALPHA) / below
    beta = np.arctan(np.tan(ALPHA) * np.sin(theta))
    moment = TORQUE * np.sin(beta) / np.sqrt(below)  # along x of the fork
    turned = moment * np.exp(1j * theta)
    expected = {}
    plus, drive = np.fft.fft(turned) / STEPS, np.fft.fft(TORQUE * tau) / STEPS
    for n in (1, 2, 3, 4):
        expected[f"input.moment_{n}x"] = abs(plus[n]) + abs(plus[-n])
        expected[f"input.drive_{n}x"] = 2.0 * abs(drive[n])
    with Reader.open(tmp_path / "ideal.h5") as store:
        table = query.orders_of(store.view(), orbits=False).table.set_index("load")
    assert expected["input.moment_2x"] > 5.0
    for name, value in expected.items():
        assert table.loc[name, "nominal"] == pytest.approx(value, rel=1e-4, abs=1e-6 * TORQUE), name


def test_quantiles_are_those_of_the_columns_and_lie_in_their_intervals(turning):
    with Reader.open(turning) as store:
        found = query.orders_of(store.view())
        own = store.results()["lateral_orders_max"][1:, 1, 1]
        first = store.results()["lateral_orders_max"][0, 1, 1]
    row = found.table.set_index("load").loc["output.lateral_2x"]
    assert (found.joints, found.left_out, len(found.table)) == (60, 0, 24)
    assert row["nominal"] == first
    for key, share in query.SHARES.items():
        assert row[f"q{key}"] == np.quantile(own, share, method="inverted_cdf")
        assert row[f"q{key}_lower"] < row[f"q{key}"] < row[f"q{key}_upper"]


def test_orbits_are_those_of_the_joints_nearest_to_the_quantiles(turning):
    with Reader.open(turning) as store:
        found = query.orders_of(store.view())
        largest = store.results()["lateral_max"]
    assert [(own.shaft, own.near) for own in found.orbits] == [
        (shaft, near) for shaft in SHAFTS for near in ("nominal", "median", "95 %")
    ]
    for own in found.orbits:
        shaft = SHAFTS.index(own.shaft)
        if own.near != "nominal":
            level = np.quantile(largest[1:, shaft], query.NEAR[own.near], method="inverted_cdf")
            assert largest[own.row, shaft] == level
        size = np.linalg.norm(own.force, axis=1)
        assert size.max() == pytest.approx(10.0 + own.row)
        assert size.min() == pytest.approx(10.0 + own.row if own.shaft == "input" else 0.0, abs=1e-4)
    assert not found.again


def test_joints_without_histories_are_simulated_again(tmp_path):
    """The orbit's ellipse at each order has the amplitude in the file; its farthest point is the largest load."""
    path = tmp_path / "again.toml"
    path.write_text(text(sampling="n = 8"), encoding="utf-8")
    tolstat.run(study.load(path), tmp_path / "again.h5", workers=1)
    with Reader.open(tmp_path / "again.h5") as store:
        found, results = query.orders_of(store.view()), store.results()
    assert found.again
    assert len(found.orbits) == 6
    for own in found.orbits:
        shaft = SHAFTS.index(own.shaft)
        c = np.fft.fft(own.force[:, 0] + 1j * own.force[:, 1]) / len(own.force)
        kept = results["lateral_orders_max"][own.row, shaft]
        assert [abs(c[n]) + abs(c[-n]) for n in (1, 2, 3, 4)] == pytest.approx(kept, rel=1e-3, abs=1e-3)
        size = np.linalg.norm(own.force, axis=1).max()
        assert size == pytest.approx(results["lateral_max"][own.row, shaft], rel=1e-2, abs=1e-3)


@pytest.mark.parametrize(
    ("limit", "output", "shown"),
    [
        ("cross1.F", "", False),
        ("output.lateral", "", True),
        ("input.lateral_2x", "", True),
        ("cross1.F", 'results = ["cross*.F_max", "input.moment_*x_max"]', True),
        ("cross1.F", 'results = ["cross*.F_max"]', False),
    ],
)
def test_the_page_shows_orders_where_the_study_asks_for_loads_of_shafts(tmp_path, limit, output, shown):
    path = invented(tmp_path, "asked", text(limit=limit, output=output))
    with Reader.open(path) as store:
        found = section.sections(store.view(), Asked(path))
    assert [own.key for own in found] == (["orders"] if shown else [])


def test_the_command_prints_json_and_writes_pictures(turning, tmp_path):
    done = CliRunner().invoke(cli.app, ["orders", str(turning), "--json", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.stderr
    rows = json.loads(done.stdout)["orders"]
    assert [row["load"] for row in rows][:2] == ["input.lateral_1x", "input.lateral_2x"]
    assert {path.suffix for path in tmp_path.iterdir()} == {".csv", ".png", ".svg"}
    with Reader.open(turning) as store:
        own = rendering.points(query.orders_of(store.view()))
    assert len(own["theta"]) == 6 * STEPS
    assert own["f_x"][0] == pytest.approx(10.0)


@pytest.mark.parametrize(
    "vector", [lambda a: (np.cos(a), np.sin(a)), lambda a: (np.cos(a), -np.sin(a)), lambda a: (np.sin(a), 0.0 * a)]
)
def test_a_force_that_turns_and_one_that_swings_have_the_same_amplitude(vector):
    angle = 2 * np.pi * np.arange(STEPS) / STEPS
    x, y = (np.sum(22.0 * part * np.exp(-1j * angle)) for part in vector(angle))
    found = semi_major((x.real, x.imag), (y.real, y.imag), STEPS)
    assert found == pytest.approx(22.0, rel=1e-12)
