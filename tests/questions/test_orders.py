"""Orders of the shafts' loads: quantiles by NumPy and SciPy, closed form of the ideal joint, known orbits, the page."""

import warnings

import numpy as np
import pytest
from scipy.stats import binom
from typer.testing import CliRunner

import tolstat
from tests.support import synthetic
from tolstat import cli, sampling, study
from tolstat.common.cardan import CARDAN
from tolstat.common.load_kinds import ORDERS, kinds
from tolstat.common.loads import loads_of
from tolstat.common.tables import Options, Simulation
from tolstat.display import drawing
from tolstat.display.answer import Asked
from tolstat.questions import orders as module
from tolstat.questions.orders import orders
from tolstat.report import page
from tolstat.solver.histories import history_specs
from tolstat.store import ResultFile, Writer

ASKED = synthetic.WHOLE.replace("[limits]", '[limits]\n"output.lateral_1x" = "200 N"')
OTHERS = "'*.[FT]_max', 'pin1.contact_*', 'psi_max'"
"""Columns that the limits of the invented campaigns need."""
SAMPLES = 180
THETA = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
SLOW = (
    synthetic.HEAD.replace("15 deg", "25 deg").replace("500 rpm", "1 rpm")
    + """[tolerances]
"pin*.offset_t" = { plus_minus = "0.05 mm", distribution = "normal", cpk = 1.0 }
"hole*.tilt_t" = { plus_minus = "0.1 deg", distribution = "normal", cpk = 1.0 }
[sampling]
n = 24
seed = 5
[solver]
fidelity = "quasistatic"
"""
)


def run(*arguments):
    return CliRunner().invoke(cli.app, ["orders", *map(str, arguments)])


def orbits_of(answer):
    """Orbits of an answer: shaft, near, row, point, and force at each angle, (k, 2)."""
    frame = answer.frame("orbits")
    groups = frame.groupby(["shaft", "near", "row", "point"], sort=False)
    return [module.Orbit(*names, part[["f_x", "f_y"]].to_numpy()) for names, part in groups]


def semi_major(force, n):
    """Amplitude of order n of points of an orbit, (k, 2), by NumPy's FFT."""
    spectrum = np.fft.fft(force[:, 0] + 1j * force[:, 1]) / len(force)
    return abs(spectrum[n]) + abs(spectrum[-n])


@pytest.fixture(scope="module")
def invented(tmp_path_factory):
    return synthetic.store(tmp_path_factory.mktemp("orders"), ASKED, failed=3)


@pytest.fixture(scope="module")
def slow(tmp_path_factory):
    """Files of the same joints, slowly turned: without histories, and with full ones."""
    folder = tmp_path_factory.mktemp("slow")
    found = []
    for name, text in (("none", SLOW), ("full", SLOW + '[output]\nhistories = "full"\n')):
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
        tolstat.run(tolstat.load(folder / f"{name}.toml"), folder / f"{name}.h5", workers=1)
        found.append(folder / f"{name}.h5")
    return found


def test_quantiles_of_each_amplitude_with_their_order_statistics(invented):
    with ResultFile.open(invented) as store:
        found = orders(store.view())
        own = store.results(slice(1, 58))  # row 0 is the nominal joint, the last three have failed
        nominal = store.results(slice(0, 1))
    assert found.facts == {"joints": 57, "left_out": 3}
    assert list(found.tables) == ["amplitudes"]
    assert len(found.tables["amplitudes"].rows) == 6 * len(ORDERS)
    for row in found.tables["amplitudes"].rows:
        values = np.sort(loads_of(CARDAN)[row["load"]].of(own))
        assert row["nominal"] == loads_of(CARDAN)[row["load"]].of(nominal)[0]
        assert row["load"] == f"{row['quantity']}_{row['order']}x"
        for key, share in (("q5", 0.05), ("qmedian", 0.5), ("q95", 0.95)):
            assert row[key] == np.quantile(values, share, method="inverted_cdf")
        low = int(binom.ppf(0.025, 57, 0.5))
        assert row["qmedian_lower"] == values[low - 1]
        assert row["qmedian_upper"] == values[57 - low]
        assert (row["q5_lower"], row["q95_upper"]) == (0.0, np.inf)  # too few joints


def test_ideal_joint_has_the_even_orders_of_its_closed_forms(tmp_path):
    """Moment T|sin(beta)|/cos(gamma) along the pins of the input fork, which turns by theta; torque T tau."""
    path = tmp_path / "ideal.toml"
    path.write_text(SLOW.replace("quasistatic", "ideal").replace("n = 24", "n = 2"), encoding="utf-8")
    tolstat.run(tolstat.load(path), tmp_path / "ideal.h5", workers=1)
    with ResultFile.open(tmp_path / "ideal.h5") as store:
        table = orders(store.view()).frame("amplitudes").set_index("load")
    alpha = np.radians(25.0)
    below = 1.0 - (np.sin(alpha) * np.cos(THETA)) ** 2
    moment = 100.0 * np.sin(np.arctan(np.tan(alpha) * np.sin(THETA))) / np.sqrt(below)
    curves = {
        "input.moment": np.column_stack([-moment * np.sin(THETA), moment * np.cos(THETA)]),
        "input.drive": np.column_stack([100.0 * np.cos(alpha) / below, 0.0 * THETA]),
    }
    for name, curve in curves.items():
        assert semi_major(curve, 2) > 5.0
        for n in ORDERS:
            own = table.loc[f"{name}_{n}x", "nominal"]
            assert own == pytest.approx(semi_major(curve, n), rel=1e-4, abs=1e-4), (name, n)
    assert max(table.loc[f"output.lateral_{n}x", "nominal"] for n in ORDERS) < 1e-3


def test_orbits_simulated_again_are_those_of_the_histories_and_have_the_stored_orders(slow):
    found = []
    for path in slow:
        with ResultFile.open(path) as store:
            found.append(orders(store.view(), orbits=True))
            load = {shaft: store.view().load(f"{shaft}.lateral") for shaft in kinds(CARDAN)["lateral"].places}
            stored = {
                name: load.of(store.results(slice(0, None)))
                for name, load in loads_of(CARDAN).items()
                if "lateral_" in name
            }
    assert [one.facts["origin"] for one in found] == ["simulated again", "stored"]
    assert [one.facts["apart"] for one in found] == [0.0, 0.0]
    orbits = [orbits_of(one) for one in found]
    assert [orbit.near for orbit in orbits[0]] == ["nominal", "median", "95 %"] * 2
    for again, kept in zip(*orbits, strict=True):
        assert again[:4] == kept[:4]
        np.testing.assert_array_equal(again.force, kept.force)
        for n in ORDERS:
            own = stored[f"{again.shaft}.lateral_{n}x"][again.row]
            assert semi_major(again.force, n) == pytest.approx(own, rel=1e-4, abs=1e-4)
        if again.near != "nominal":
            share = module.NEAR[again.near]
            expected = np.quantile(load[again.shaft].valid, share, method="inverted_cdf")
            assert load[again.shaft].values[again.row - 1] == expected


def known(rows):
    """Loads on the shafts: on the output shaft 22 N of order 2 that turn (even rows) or swing, about 5 N; none else."""
    loads = np.zeros((rows, SAMPLES, 2, 6), np.float32)
    turns = np.arange(rows) % 2 == 0
    curve = np.where(turns[:, None], 22 * np.exp(2j * THETA), 22 * np.exp(0.7j) * np.cos(2 * THETA + 0.4)) + 5.0
    loads[:, :, 1, 0], loads[:, :, 1, 1] = curve.real, curve.imag
    return loads


def test_a_force_that_turns_and_one_that_swings_have_orbits_with_the_same_semi_axis(tmp_path):
    source = tmp_path / "known.toml"
    source.write_text(ASKED.replace("[limits]", '[output]\nhistories = "full"\n\n[limits]'), encoding="utf-8")
    plan = study.load(source)
    specs = {"shafts": history_specs(Options(steps_per_rev=SAMPLES), "full", 0)["shafts"]}
    results = synthetic.results(plan.rows)
    with Writer.create(tmp_path / "known.h5", plan, [sampling.draw(plan)], specs) as store:
        store.write(np.arange(plan.rows), Simulation(results, {"shafts": known(plan.rows)}))
        store.finish()
    with ResultFile.open(tmp_path / "known.h5") as store:
        orbits = orbits_of(orders(store.view(), orbits=True))
    for orbit in orbits:
        axes = np.linalg.svd(orbit.force - orbit.force.mean(axis=0))[1] * np.sqrt(2 / SAMPLES)
        if orbit.shaft == "input":
            assert not orbit.force.any()
        elif orbit.row % 2 == 0:
            assert axes == pytest.approx([22, 22], rel=1e-6)
        else:
            assert axes == pytest.approx([22, 0], abs=1e-5)
            assert np.ptp(np.linalg.norm(orbit.force - [5.0, 0.0], axis=1)) > 20
        if orbit.near == "95 %":
            largest = np.argsort(results["lateral_max"][1:, kinds(CARDAN)["lateral"].places.index(orbit.shaft)])
            assert orbit.row == 1 + largest[56]  # the 57th of 60 joints


def test_of_several_points_an_amplitude_is_the_largest_and_an_orbit_that_of_the_point_that_matters_most(tmp_path):
    before, after = SLOW.split("[operation]")
    alpha, rest = after.split("[tolerances]")[0], "[tolerances]" + after.split("[tolerances]")[1]
    points = (("flat", alpha.replace("25", "5")), ("bent", alpha))
    text = before + "".join(f'[[operation]]\nname = "{name}"{own}' for name, own in points) + rest
    (tmp_path / "two.toml").write_text(text.replace("n = 24", "n = 8"), encoding="utf-8")
    tolstat.run(tolstat.load(tmp_path / "two.toml"), tmp_path / "two.h5", workers=1)
    with ResultFile.open(tmp_path / "two.h5") as store:
        view = store.view()
        found, bent, flat = (orders(part, orbits=True) for part in (view, view.at("bent"), view.at("flat")))
    tables = {
        name: one.frame("amplitudes").set_index("load")
        for name, one in (("all", found), ("bent", bent), ("flat", flat))
    }
    name = "input.moment_2x"
    assert tables["all"].loc[name, "qmedian"] == tables["bent"].loc[name, "qmedian"]
    assert tables["bent"].loc[name, "qmedian"] > 3 * tables["flat"].loc[name, "qmedian"]
    of_all, of_bent, of_flat = (orbits_of(one) for one in (found, bent, flat))
    for shaft in kinds(CARDAN)["lateral"].places:
        largest = {
            one[0].point: max(np.abs(own.force).max() for own in one if own.shaft == shaft)
            for one in (of_bent, of_flat)
        }
        shown = [own for own in of_all if own.shaft == shaft]
        assert {own.point for own in shown} == {max(largest, key=lambda point: largest[point])}
        of_point = of_bent if shown[0].point == "bent" else of_flat
        for own, alone in zip(shown, [own for own in of_point if own.shaft == shaft], strict=True):
            np.testing.assert_array_equal(own.force, alone.force)
    assert found.facts["apart"] == 0.0


def test_joints_of_a_sweep_are_simulated_again_each_at_its_own_operating_point(tmp_path):
    alpha = '"operation.alpha" = { from = "5 deg", to = "25 deg"'
    text = synthetic.SWEEP.replace('"pin*.diameter" = { from = "-0.1 mm", to = "0.1 mm"', alpha)
    (tmp_path / "sweep.toml").write_text(text.replace("points = 11", "points = 3"), encoding="utf-8")
    tolstat.run(tolstat.load(tmp_path / "sweep.toml"), tmp_path / "sweep.h5", workers=1)
    with ResultFile.open(tmp_path / "sweep.h5") as store:
        found = orders(store.view(), orbits=True)
        own = store.results()["lateral_max"]
    assert (found.facts["origin"], found.facts["apart"]) == ("simulated again", 0.0)
    assert found.frame("amplitudes")["q95_upper"].isna().all()
    for orbit in orbits_of(found):
        size = np.linalg.norm(orbit.force, axis=1).max()
        assert size == pytest.approx(
            own[orbit.row, kinds(CARDAN)["lateral"].places.index(orbit.shaft)], rel=1e-2, abs=1e-3
        )


@pytest.mark.parametrize(
    ("change", "asked"),
    [
        (("[limits]", "[limits]"), False),
        (("[limits]", '[limits]\n"input.moment_2x" = "1 N*m"'), True),
        (("[limits]", '[limits]\n"input.axial" = "1 kN"'), True),
        (("[limits]", f"[output]\nresults = [{OTHERS}, 'output.moment_max']\n[limits]"), True),
        (("[limits]", f"[output]\nresults = [{OTHERS}]\n[limits]"), False),
    ],
)
def test_the_page_shows_orders_where_the_study_asks_for_loads_of_the_shafts(tmp_path, change, asked):
    path = synthetic.store(tmp_path, synthetic.WHOLE.replace(*change))
    with ResultFile.open(path) as store:
        assert module.are_asked(store.view()) == asked
        remarks = Asked(path)
        found = [own.key for own in page.sections_of(store.view(), remarks) if own.key == "orders"]
    kept = "results" not in change[1]
    assert found == (["orders"] if asked and kept else [])
    left_out = [note for note in remarks.notes if note.startswith("orders is left out")]
    assert bool(left_out) == (asked and not kept)  # the study keeps no amplitudes


def test_a_slice_without_the_nominal_joint_is_drawn_without_warnings(invented):
    with ResultFile.open(invented) as store:
        rows = orders(store.view()).tables["amplitudes"].rows
    without = [{**row, "nominal": np.nan} for row in rows]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for panel in module._amplitude_panels(without):
            assert "<svg" in drawing.svg(panel)[0]
