"""Time above a level within a revolution: known waves, coverage, and the table of a campaign."""

import json

import numpy as np
import pandas as pd
import pytest
from scipy.stats import norm
from typer.testing import CliRunner

import tolstat
from tests.support import synthetic
from tolstat import cli, sampling, study
from tolstat.analysis import binomial
from tolstat.common.channels import CHANNELS
from tolstat.common.errors import InputError, StoreError
from tolstat.common.load_kinds import BUSHINGS, SHAFTS
from tolstat.common.loads import LOADS
from tolstat.common.tables import Options, Simulation, Status
from tolstat.questions.time_above import LEVELS, time_above
from tolstat.solver.histories import history_specs
from tolstat.store import ResultFile, Writer

SEEDS = 500
SAMPLES = 720
TEXT = synthetic.STUDY.replace("n = 60", "n = 200").replace("[output]", '[output]\nhistories = "full"')


def wave(tops):
    """Loads of joints: cross1.F a sine about 500 N that rises to `tops`, other loads none."""
    loads = np.zeros((len(tops), SAMPLES, 8, 6), np.float32)
    angle = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    loads[:, :, 0, 1] = 500.0 + (np.asarray(tops) - 500.0)[:, None] * np.sin(angle)
    return loads


def turning(tops):
    """Loads of shafts: a lateral force of the output shaft that turns, and swings about 500 N up to `tops`."""
    shafts = np.zeros((len(tops), SAMPLES, 2, 6), np.float32)
    angle = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    modulus = 500.0 + (np.asarray(tops) - 500.0)[:, None] * np.sin(angle)
    shafts[:, :, 1, 0], shafts[:, :, 1, 1] = modulus * np.cos(3 * angle), modulus * np.sin(3 * angle)
    shafts[:, :, 1, 2] = -modulus
    return shafts


def time_of(level, tops):
    return np.arccos(np.clip((level - 500.0) / (np.asarray(tops) - 500.0), -1, 1)) / np.pi


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    folder = tmp_path_factory.mktemp("time_above")
    source = folder / "waves.toml"
    source.write_text(TEXT, encoding="utf-8")
    plan = study.load(source)
    specs = history_specs(Options(steps_per_rev=SAMPLES), "full", 0)
    specs = {name: specs[name] for name in ("loads", "shafts")}
    with Writer.create(folder / "waves.h5", plan, [sampling.draw(plan)], specs) as store:
        rows = np.arange(plan.rows)
        histories = {"loads": wave(tops(plan.rows)), "shafts": turning(tops(plan.rows))}
        store.write(rows, Simulation(synthetic.results(plan.rows, failed=2), histories))
        store.finish()
    return folder / "waves.h5"


def tops(n):
    return np.linspace(600.0, 800.0, n)


def run(*arguments):
    return CliRunner().invoke(cli.app, ["time-above", *map(str, arguments)])


def test_times_of_known_waves_and_joints_told_apart_from_them(path):
    with ResultFile.open(path) as store:
        found = time_above(store.view(), ["cross1.F", "cross1.F_t", "output.lateral", "output.axial"], ["0.75 kN"])
    own = tops(201)[1:-2]  # row 0 is the nominal joint, the last two have failed
    expected = time_of(750.0, own)
    assert found.facts == {"joints": 198, "left_out": 2}
    for row in found.tables["levels"].rows:
        assert row["time"] == pytest.approx(expected.mean(), abs=1e-3), row["load"]
        assert row["time_90"] == pytest.approx(np.quantile(expected, 0.9, method="inverted_cdf"), abs=1e-3)
        assert row["joints_above"] == pytest.approx(np.mean(own > 750.0))
        ends = [float(end) for end in binomial.clopper_pearson(198 * row["time"], 198, 0.95)]
        assert (row["time_lower"], row["time_upper"]) == pytest.approx(ends)
        assert row["time_lower"] < row["time"] < row["time_upper"] < row["joints_above"]
        assert row["time_50"] == 0.0


def test_joints_that_are_pending_are_not_left_out(path, tmp_path):
    """Of 30 joints, 20 are simulated; the file of an interrupted campaign says nothing about the others."""
    text = TEXT.replace("n = 200", "n = 30").replace("[sampling]", f"{synthetic.SOLVER}\n[sampling]")
    (tmp_path / "part.toml").write_text(text, encoding="utf-8")
    plan = study.load(tmp_path / "part.toml")
    tolstat.run(plan, tmp_path / "part.h5", workers=1, until_row=21, check=False)
    with ResultFile.open(tmp_path / "part.h5") as store:
        settled = int((store.status()[1:21] == Status.OK).sum())
    found = json.loads(run(tmp_path / "part.h5", "--json").stdout)
    assert found["facts"] == {"joints": settled, "left_out": 20 - settled}
    assert settled > 0


def test_the_mean_time_is_covered_where_few_joints_exceed_a_level_and_students_interval_is_not():
    """Times of joints whose largest load is normal; some one in fifty is above the level at all."""
    rng, level = np.random.default_rng(9), 2.0
    truth = np.mean(np.arccos(np.clip(level / norm.ppf((np.arange(100_000) + 0.5) / 100_000, 1.0, 0.5), -1, 1)) / np.pi)
    covered, student = [], []
    for top in rng.normal(1.0, 0.5, (SEEDS, 100)):
        time = np.where(top > level, np.arccos(np.clip(level / top, -1, 1)) / np.pi, 0.0)
        lower, upper = binomial.clopper_pearson(time.sum(), time.size)
        covered.append(lower <= truth <= upper)
        student.append(abs(time.mean() - truth) <= 1.98 * time.std(ddof=1) / 10.0)
    least = 0.95 - 3.0 * np.sqrt(0.95 * 0.05 / SEEDS)
    assert np.mean(covered) >= least
    assert np.mean(student) < least


def test_channels_are_components_and_moduli():
    rng = np.random.default_rng(1)
    loads = {"loads": rng.normal(size=(2, 5, 8, 6)), "shafts": rng.normal(size=(2, 5, 2, 6))}
    for name in CHANNELS:
        assert CHANNELS[name].of(loads).shape == (2, 5)
    np.testing.assert_array_equal(CHANNELS["fork2.T_t"].of(loads), loads["loads"][:, :, 5, 4])
    np.testing.assert_allclose(CHANNELS["cross3.T"].of(loads) ** 2, (loads["loads"][:, :, 2, 3:] ** 2).sum(axis=-1))
    output = loads["shafts"][:, :, 1]
    np.testing.assert_array_equal(CHANNELS["output.m_z"].of(loads), output[..., 5])
    np.testing.assert_array_equal(CHANNELS["output.axial"].of(loads), np.abs(output[..., 2]))
    np.testing.assert_allclose(CHANNELS["output.lateral"].of(loads), np.hypot(output[..., 0], output[..., 1]))
    np.testing.assert_allclose(CHANNELS["output.moment"].of(loads), np.hypot(output[..., 3], output[..., 4]))
    np.testing.assert_array_equal(CHANNELS["input.drive"].of(loads), np.abs(loads["shafts"][:, :, 0, 5]))
    assert "output.drive" not in CHANNELS


def test_every_load_at_an_instant_of_a_bushing_or_shaft_is_a_channel():
    """By name and unit, with no list of them: the kinds that have one value at each place at an instant."""
    for name, load in LOADS.items():
        at_instant = not load.kind.orders and not load.kind.parts and load.place.name in {*BUSHINGS, *SHAFTS}
        assert (name in CHANNELS) == at_instant, name
        assert not at_instant or CHANNELS[name].unit == load.unit


@pytest.mark.slow
def test_command_prints_limits_and_writes_curves(path, tmp_path):
    done = run(path, "--by", "cross1.F", "--curves", "--out", tmp_path / "out")
    assert done.exit_code == 0
    assert "cross1.F > 700 N" in done.stdout
    assert len(done.stdout.splitlines()) == 2
    assert "198 joints, 2 without" in done.stderr
    pictures = [f"{name}-cross1-F.{kind}" for name in ("joints", "time") for kind in ("png", "svg")]
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        f"waves_time_above_{name}" for name in ("curves.csv", *pictures[:2], "levels.csv", *pictures[2:])
    ]
    curve = pd.read_csv(tmp_path / "out" / "waves_time_above_curves.csv")
    assert (np.diff(curve["time"]) <= 0).all()
    assert (curve["time"] <= curve["joints_above"]).all()
    found = json.loads(run(path, "--by", "cross1.F", "--json").stdout)["tables"]["levels"]["rows"][0]
    assert found["level"] == 700.0
    # without options: the limits of bushings
    assert {line.split()[0] for line in run(path).stdout.splitlines()[1:]} == {
        "cross1.F",
        *(f"fork{i}.T" for i in (1, 2, 3, 4)),
    }


def test_shares_have_their_unit_with_intervals_and_without(path):
    with ResultFile.open(path) as store:
        table = time_above(store.view(), ["cross1.F"], ["700 N"]).frame("levels")
    without = table.assign(**{name: np.nan for name in table if name.endswith(("_lower", "_upper"))})
    cells = []
    for shown in (table, without):
        cells = [cell(row) for row in shown.to_dict("records") for _, cell, *_ in LEVELS[1:]]
        assert all(cell.endswith(" %") for cell in cells), cells
    assert "(" not in "".join(cells)


def test_faults_are_told_together_and_files_without_histories_refused(path, tmp_path):
    with ResultFile.open(path) as store:
        with pytest.raises(InputError) as found:
            time_above(store.view(), ["psi", "fork1.F"], ["700 mm"])
        for words in ("'psi' is no load over the input angle", "'700 mm' cannot be a value in N"):
            assert words in str(found.value)
        with pytest.raises(InputError, match="neither a level nor a limit"):
            time_above(store.view(), ["fork1.F"])
        both = time_above(store.view(), ["cross1.F", "cross1.T"], ["1 N*m", "2 N", "1 N"]).frame("levels")
        assert list(zip(both["load"], both["level"], strict=True)) == [
            ("cross1.F", 2.0),
            ("cross1.F", 1.0),
            ("cross1.T", 1.0),
        ]
    with ResultFile.open(path) as store:
        del store.history_specs["shafts"]
        with pytest.raises(StoreError, match="holds no histories of shafts\n  hint: run the campaign again"):
            time_above(store.view(), ["output.moment"], ["1 N*m"])
    with ResultFile.open(synthetic.store(tmp_path)) as store, pytest.raises(StoreError, match="no load histories"):
        time_above(store.view())
    done = run(synthetic.store(tmp_path, synthetic.SWEEP, "sweep"))
    assert done.exit_code == 2
    assert "no sample of a production" in done.stderr
