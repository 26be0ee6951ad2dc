"""Cycles of whole campaigns: counted in the worker or from histories, as a duty cycle, for pyLife, in a report."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import tolstat
from tests.questions.test_fatigue import needs
from tests.support import synthetic
from tests.support.environment import ROOT
from tests.support.of_cardan import BUSHING_LOADS, COMPONENTS
from tests.support.reports import call
from tolstat.analysis.cycles import damage, equivalent_load, moment
from tolstat.analysis.strength import SNLine
from tolstat.common.cardan import CARDAN, MECHANISMS, named
from tolstat.common.channels import signals_of, unit_of
from tolstat.common.errors import InputError, NotApplicable, StoreError
from tolstat.common.tables import SIMULATED
from tolstat.display.answer import Asked
from tolstat.display.blocks import Panels
from tolstat.questions.fatigue import loads as fatigue
from tolstat.questions.fatigue.answer import fatigue_on_page, life_verdicts
from tolstat.questions.fatigue.counting import of_slots
from tolstat.questions.fatigue.loads import channels, pylife_frame
from tolstat.solver import histories
from tolstat.store import ResultFile
from tolstat.study import load
from tolstat.study.fatigue import of_text
from tolstat.study.rewriting import as_text

SCATTER = (
    synthetic.HEAD.replace("15", "{alpha}")
    + """[tolerances]
"pin*.offset_t" = {{ plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }}
"pin*.diameter" = {{ lower = "-0.1 mm", upper = "0.22 mm", distribution = "uniform" }}
[sampling]
n = 12
seed = {seed}
[output]
histories = "{histories}"
"""
)
"""A study to be filled in; not all of its joints have results."""
STUDY = (
    SCATTER
    + """harmonics = 4
[fatigue]
exponents = [4]
revolutions = 1e7
line."cross*.F_[et]" = {{ m = 5, S0 = "1 kN", N0 = 2e6 }}
"""
)
LINE = SNLine(5.0, 5.0, 2e6, 1000.0)
SHOWN = tuple(signal.name for signal in COMPONENTS.values() if signal.history == BUSHING_LOADS)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    """Result file of the study with these histories, operating point and seed; run once."""
    folder = tmp_path_factory.mktemp("fatigue")

    def run(histories: str = "cycles", alpha: float = 15.0, seed: int = 1) -> Path:
        source = folder / f"{histories}_{alpha:g}_{seed}.toml"
        out = source.with_suffix(".h5")
        if not out.exists():
            source.write_text(STUDY.format(histories=histories, alpha=alpha, seed=seed), encoding="utf-8")
            if histories == "none":
                source.write_text(source.read_text(encoding="utf-8").split("[fatigue]")[0], encoding="utf-8")
            tolstat.run(tolstat.load(source), out, workers=1)
        return out

    return run


def cycles(path):
    """Cycles of all joints of a file, the nominal joint included, and their status."""
    with ResultFile.open(path) as store:
        status = store.status()
        return cycles_of(store, np.flatnonzero(np.isin(status, SIMULATED))).spread(
            np.flatnonzero(np.isin(status, SIMULATED)), store.n
        ), status


def cycles_of(store, slots, names=SHOWN):
    return of_slots(store, slots, [signal for name in names for signal in signals_of(name, CARDAN)])[0]


def load_cycles(file, names=None, samples=None):
    with ResultFile.open(file) as store:
        return fatigue.load_cycles(store.view(), names, samples)


@pytest.mark.slow
def test_the_same_cycles_from_worker_and_histories(campaign):
    counted, status = cycles(campaign("cycles"))
    with ResultFile.open(campaign("cycles")) as store:
        assert set(store.history_specs) == set(histories.cycle_specs())
    assert (status != tolstat.Status.OK).any()
    assert np.isnan(counted.number[status != tolstat.Status.OK]).all()
    valid = status == tolstat.Status.OK
    assert counted.number[valid].max() >= 2
    both, _ = cycles(campaign("harmonics+cycles"))
    np.testing.assert_array_equal(both.ranges, counted.ranges)
    load = equivalent_load(counted, 4.0)[valid]
    torque = np.array([unit_of(name, CARDAN) != "N" for name in counted.channels])
    scale = np.where(torque, load[:, torque].max(), load[:, ~torque].max())
    for kind, tolerance in (("full", 1e-6), ("harmonics", 5e-3)):
        other, _ = cycles(campaign(kind))
        difference = np.abs(equivalent_load(other, 4.0)[valid] - load) / scale
        assert difference.max() < tolerance
        if kind == "harmonics":
            assert difference.max() > 1e-6  # truncation shows: the comparison sees a difference


def test_cycles_are_of_what_is_asked_for(campaign, tmp_path):
    """Stored components are read; directions are counted from histories, or from joints that are simulated again."""
    asked = [
        "output.m_x",
        "input.f_x",
        "cross1.F_t",
        "output.moment at 90 deg",
        "cross1.F at worst",
        "cross1.F at 0 deg",
    ]
    found = {kind: load_cycles(campaign(kind), asked) for kind in ("cycles", "full", "none")}
    whole = {kind: equivalent_load(loading.cycles.worst(4.0), 4.0) for kind, loading in found.items()}
    valid = found["cycles"].status == tolstat.Status.OK
    assert (whole["cycles"][valid] > 0).all()
    np.testing.assert_allclose(whole["full"][valid], whole["cycles"][valid], rtol=1e-5)
    np.testing.assert_allclose(whole["none"][valid], whole["full"][valid], rtol=1e-12)
    with ResultFile.open(campaign("full")) as store:
        settled = np.flatnonzero(store.status() == tolstat.Status.OK)
        moments = store.histories("shafts", settled)[..., 1, 3:5].astype(float)
        largest = [histories.periodic(own)[0].max() for own in moments[..., 1]]
        assert cycles_of(store, settled, asked[3:4]).ranges[:, 0, 0] == pytest.approx(largest)
    _, _, component, _, worst, along = whole["full"][valid].T
    np.testing.assert_allclose(along, component, rtol=1e-12)
    assert (worst >= component).all()
    assert not set(load_cycles(campaign()).cycles.channels) & set(asked[:2])

    source, out = tmp_path / "line.toml", tmp_path / "line.h5"
    text = STUDY.format(histories="cycles", alpha=15, seed=1)
    source.write_text(text + 'line."output.m_x" = { m = 5, S0 = "20 N*m", N0 = 2e6 }\n', encoding="utf-8")
    tolstat.run(tolstat.load(source), out, workers=1)
    loading = load_cycles(out)
    line = SNLine(5.0, 5.0, 2e6, 20.0)
    sums = damage(found["cycles"].cycles.of("output.m_x"), line, 1e7)[:, 0]
    row = pd.DataFrame(fatigue.damages(loading)).set_index("channel").loc["output.m_x"]
    assert row["median"] == pytest.approx(np.quantile(sums[valid], 0.5, method="inverted_cdf"))


SEQUENCE = """
[joint]
base = "cirelli2021"
[[operation]]
name = "fwd"
share = 0.4
alpha = "10 deg"
speed = "500 rpm"
torque = "300 N*m"
[[operation]]
name = "rev"
share = 0.4
alpha = "10 deg"
speed = "500 rpm"
torque = "-300 N*m"
[[operation]]
name = "straight"
share = 0.2
alpha = "{alpha}"
speed = "500 rpm"
torque = "100 N*m"
[tolerances]
"pin*.offset_t" = {{ plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }}
[sampling]
n = 6
seed = 3
[output]
histories = "{histories}"
[fatigue]
revolutions = 1e11
sequence = {{ points = "fwd rev straight", revolutions = 1e4 }}
line."cross1.F_t" = {{ m = 5, S0 = "4 kN", N0 = 2e6 }}
"""


def rainflow_damage(store, place, component, line):
    """Damage of each joint in the service life, by the package rainflow on the stored histories one after the other.

    Each visit is of whole revolutions, from the largest load to the same again: two of them, and cycles of the others.
    """
    import rainflow

    def moment(values):
        return sum(number * size**line.k for size, _, number, *_ in rainflow.extract_cycles([*values, values[0]]))

    view = store.view()
    settings = view.study.fatigue
    visits, numbers = np.unique(settings.visits, return_counts=True)
    revolutions = dict(zip(view.points, settings.turns * view.shares_of_revolutions, strict=True))
    sums = []
    for joint in range(1, store.n):
        signals = {}
        for point in view.points:
            values = store.at(point).histories("loads", np.array([joint]))[0, :, place, component].astype(float)
            signals[point] = np.roll(values, -int(np.argmax(values)))
        course = np.concatenate([[*np.tile(signals[point], 2), signals[point][0]] for point in settings.visits])
        whole = moment(np.roll(course, -int(np.argmax(course))))
        seen = dict(zip(visits, 2 * numbers, strict=True))
        whole += sum((revolutions[point] - seen.get(point, 0)) * moment(signal) for point, signal in signals.items())
        sums.append(settings.revolutions / settings.turns * whole / (line.N_D * line.S_D**line.k))
    return np.array(sums)


@needs("rainflow")
@pytest.mark.parametrize("alpha", ["0.5 deg", "0 deg"])
def test_a_point_with_a_constant_load_keeps_the_cycles_between_points(tmp_path, alpha):
    line, sums = SNLine(5.0, 5.0, 2e6, 4e3), {}
    for kind in ("full", "cycles"):
        source = tmp_path / f"{kind}.toml"
        source.write_text(SEQUENCE.format(alpha=alpha, histories=kind), encoding="utf-8")
        tolstat.run(tolstat.load(source), source.with_suffix(".h5"), workers=1)
        loading = load_cycles(source.with_suffix(".h5"))
        sums[kind] = damage(loading.cycles.of("cross1.F_t"), line, 1e11)[:, 0]
        assert loading.valid.all()
    with ResultFile.open(tmp_path / "full.h5") as store:
        loads = store.at("straight").histories("loads", np.arange(1, 7))[:, :, 0, 1]
        assert np.ptp(loads, axis=1).max() < 1e-3 * np.abs(loads).max()
        expected = rainflow_damage(store, 0, 1, line)
    np.testing.assert_allclose(sums["full"], expected, rtol=1e-9)
    np.testing.assert_allclose(sums["cycles"], sums["full"], rtol=2e-6)
    assert (sums["full"] > 1.0).all()


@needs("rainflow")
def test_a_spectrum_made_from_a_signal_counts_the_same(tmp_path):
    torque, alpha = np.array([(300, 10), (-300, 10), (100, 0.2), (300, 10), (100, 0.2), (-250, 5)] * 2).T
    seconds = np.arange(0.0, 5.0, 0.1)
    rows = [(s + 5.0 * i, t, 600, a) for i, (t, a) in enumerate(zip(torque, alpha, strict=True)) for s in seconds]
    signal, study, full = tmp_path / "signal.csv", tmp_path / "cycle.toml", tmp_path / "full.toml"
    signal.write_text(
        "time [s],torque [N*m],speed [rpm],alpha [deg]\n" + "\n".join(",".join(map(str, r)) for r in rows)
    )
    assert call("new", study, "--signal", signal).exit_code == 0
    text = study.read_text(encoding="utf-8").replace('histories = "cycles"', 'histories = "full"')
    text = re.sub(r"\[limits\]\n(?:[^\n\[]+\n)*", "", re.sub(r"\nn = \d+", "\nn = 3", text))
    full.write_text(text, encoding="utf-8")
    tolstat.run(tolstat.load(full), full.with_suffix(".h5"), workers=1)
    loading = load_cycles(full.with_suffix(".h5"), ["cross1.F_t", "fork1.T_e"])
    assert len(loading.settings.visits) > 4
    line = SNLine(5.0, 5.0, 2e6, 4e3)
    with ResultFile.open(full.with_suffix(".h5")) as store:
        for channel, where in (("cross1.F_t", (0, 1)), ("fork1.T_e", (4, 3))):
            found = damage(loading.cycles.of(channel), line, loading.settings.revolutions)[:, 0]
            np.testing.assert_allclose(found, rainflow_damage(store, *where, line), rtol=1e-9)


def test_a_sequence_with_fewer_revolutions_than_visits_is_refused():
    text = SEQUENCE.format(alpha="1 deg", histories="none").replace("revolutions = 1e4", "revolutions = 4")
    with pytest.raises(InputError, match=r"sequence\.revolutions: 1 visits of straight in 0\.8 revolutions, its share"):
        load(Path("sequence.toml"), text=text)


def test_starts_count_for_lines_of_loads(campaign):
    with ResultFile.open(campaign()) as store:
        steady = fatigue.load_cycles(store.view(), ["cross1.F_t", "fork1.F_z"])
        store.study_text = store.study_text.replace("revolutions = 1e7", "revolutions = 1e7\nstarts = 1e6")
        started = fatigue.load_cycles(store.view(), ["cross1.F_t", "fork1.F_z"])
    line, valid = SNLine(5.0, 5.0, 2e6, 1000.0), steady.status == tolstat.Status.OK
    reach = np.maximum(steady.cycles.high, 0.0) - np.minimum(steady.cycles.low, 0.0)
    largest = steady.cycles.ranges[..., 0].astype(float)
    expected = damage(steady.cycles, line, 1e7) + 1e6 / 2e6 * (reach**5 - largest**5) / 1000.0**5
    np.testing.assert_allclose(damage(started.cycles, line, 1e7)[valid], expected[valid])
    assert (damage(started.cycles, line, 1e7)[valid] > 2 * damage(steady.cycles, line, 1e7)[valid]).any()


def test_the_verdict_on_loads_is_on_those_with_a_line(campaign):
    with ResultFile.open(campaign()) as store:
        view = store.view()
        row = tolstat.fatigue(view, by=["cross*.F_[et]"]).tables["damages"].rows[-1]
        (found,) = life_verdicts(view, 0.999)
        assert (found.answer, found.lower, found.upper) == ("yes", row["outer_lower"], row["outer_upper"])
        assert "of the joints have a damage sum above 1 within 1e+07 revolutions (" in found.sentence
        store.study_text = store.study_text.replace("revolutions = 1e7", "")
        assert life_verdicts(store.view(), 0.999) == []


def test_the_section_may_be_edited_after_the_run(campaign, tmp_path):
    source, out = tmp_path / "a.toml", tmp_path / "a.h5"
    out.write_bytes(campaign().read_bytes())
    text = campaign().with_suffix(".toml").read_text(encoding="utf-8")
    source.write_text(text.replace("exponents = [4]", "exponents = [7]"), encoding="utf-8")
    tolstat.run(tolstat.load(source), out, workers=1)
    assert load_cycles(out).settings.exponents == (7.0,)


def test_a_campaign_without_a_valid_joint(tmp_path):
    source, out = tmp_path / "a.toml", tmp_path / "a.h5"
    text = STUDY.format(histories="cycles", alpha=15, seed=1) + '[errors]\npin1.diameter = "0.5 mm"\n'
    source.write_text(text.replace("pin*.diameter", "pin2.diameter"), encoding="utf-8")
    tolstat.run(tolstat.load(source, n=3), out, workers=1)
    done = call("fatigue", out)
    assert done.exit_code == 0, done.output
    assert len(done.stdout.splitlines()) == 1 + 48 + 3 + 9
    with ResultFile.open(out) as store:
        answer = tolstat.fatigue(store.view())
        with pytest.raises(NotApplicable):
            fatigue_on_page(store.view(), Asked(out))
    assert not any(isinstance(part, Panels) for part in answer.parts)
    assert answer.frame("loads")["estimate"].isna().all()


def test_channels_are_selected_by_patterns():
    assert channels(["cross2.F_t", "cross[12].F_?", "output.lateral at 0.5 rad", "cross*.T at worst"], CARDAN) == (
        *(f"cross{i}.F_{axis}" for i in (1, 2) for axis in "etz"),
        "output.lateral at 28.6478898 deg",
        *(f"cross{i}.T at worst" for i in (1, 2, 3, 4)),
    )  # fmt: skip
    asked = "pin1.contact, cross1.F_e, fork1.F, output.axial, cross1.F at 3 mm, input.drive at worst, fork9.F_e"
    with pytest.raises(InputError) as error:
        channels(asked.split(", "), CARDAN)
    found = {fault.place: (fault.found, fault.remedy) for fault in error.value.faults}
    unsigned = "has no sign: its cycles are not those of the load"
    directions = 'fork1.F_e, fork1.F_t, fork1.F_z, or "fork1.F at 30 deg", "fork1.F at worst"'
    assert found["--by: fork1.F"] == (f"fork1.F {unsigned}", f"write {directions}")
    assert found["--by: output.axial"] == (f"output.axial {unsigned}", "write output.f_z")
    not_counted = "its cycles are not counted"
    assert found["--by: pin1.contact"][0] == found["--by: input.drive at worst"][0] == not_counted
    assert found["--by: fork9.F_e"][0] == "selects nothing"
    with pytest.raises(InputError, match=f"--by: input.bearing_a: {not_counted}"):
        channels(["input.bearing_a"], MECHANISMS[named(CARDAN, ["input_bearings"])])
    assert len(found) == 6


def test_every_fault_of_the_section_is_told():
    section = {
        "exponents": [0, "a"],
        "revolution": 1e8,
        "line": {
            "cross*.F_e": {"m": 5, "S0": "3 N*m", "N0": 1e6},
            "cross1": {"F_e": {"m": 0.5, "S0": "3 N", "N0": 1e6}, "X": 3},
            "fork1.T_e": {"m": 5, "S0": "-3 N*m", "N0": 1e6},
            "fork1.T": {"m": 5, "S0": "3 N*m", "N0": 1e6},
        },
    }
    with pytest.raises(InputError) as error:
        of_text(as_text({"fatigue": section}), "a.toml")
    places = [fault.place.removeprefix("a.toml: fatigue.") for fault in error.value.faults]
    assert places == [
        *("exponents[0]", "exponents[1]", "revolution", "line.cross*.F_e.S0", "line.cross1.X"),
        *("line.cross1.F_e", "line.fork1.T_e.S0", "line.fork1.T"),
    ]
    lines = {key: {"m": 3, "S0": "1 N", "N0": 1} for key in ("*.F_z", "fork1.F_z")}
    with pytest.raises(InputError, match="is set by"):
        of_text(as_text({"fatigue": {"line": lines}}), "a.toml")


def test_the_frame_for_pylife_holds_every_cycle(campaign):
    with ResultFile.open(campaign()) as store:
        frame, samples = pylife_frame(store.view(), nominal=True), pylife_frame(store.view())
        counted = cycles(campaign())[0]
    assert list(frame) == ["joint", "channel", "unit", "range", "mean", "cycles"]
    assert frame.groupby("joint")["cycles"].sum().to_dict() == {
        i: n for i, n in enumerate(counted.number.sum(axis=1)) if n > 0
    }
    assert set(samples["joint"]) == set(frame["joint"]) - {0}
    one, here = frame[(frame["joint"] == 3) & (frame["channel"] == "fork1.F_z")], counted.of("fork1.F_z")
    np.testing.assert_array_equal(one["range"], here.ranges[3, 0][here.ranges[3, 0] > 0])
    np.testing.assert_array_equal(one["mean"], here.means[3, 0][here.ranges[3, 0] > 0])
    assert set(one["unit"]) == {"N"}


def test_joints_that_are_listed_are_exported_but_not_estimated(campaign, tmp_path):
    source, out = tmp_path / "sweep.toml", tmp_path / "sweep.h5"
    text = STUDY.format(histories="cycles", alpha=15, seed=1)
    head, tail = text.partition("[tolerances]")[0], text.partition("[output]")[2]
    sweep = '[sampling]\nmethod = "sweep"\n[sweep]\n"pin1.offset_t" = { from = "0 mm", to = "0.1 mm", points = 3 }\n'
    source.write_text(f"{head}{sweep}[output]{tail}", encoding="utf-8")
    tolstat.run(tolstat.load(source), out, workers=1)
    with ResultFile.open(out) as store:
        frame = pylife_frame(store.view(), ["cross1.F_t"])
        with pytest.raises(StoreError, match="no sample of a production"):
            tolstat.fatigue(store.view())
    assert frame["joint"].nunique() == 3


def test_the_lines_of_the_document_read_the_export(campaign, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = call("export", campaign(), "--pylife", "cycles.csv")
    assert done.exit_code == 0, done.stderr
    document = (ROOT / "docs" / "questions" / "fatigue.md").read_text(encoding="utf-8")
    found = re.findall(r"```python\n(.*?)```", document, flags=re.DOTALL)
    code = next(code for code in found if "cycles.csv" in code).split("# with pyLife")[0]
    names: dict[str, Any] = {}
    exec(code, names)
    with ResultFile.open(campaign()) as store:
        expected = pylife_frame(store.view()).set_index(["joint", "channel"])
    pd.testing.assert_frame_equal(names["frame"], expected)


@needs("pylife")
def test_pylifes_own_damage(campaign, tmp_path):
    """Of every joint, over a duty cycle with its sequence, too."""
    import pylife.strength.fatigue
    import pylife.stress.collective  # noqa: F401

    source = tmp_path / "sequence.toml"
    source.write_text(SEQUENCE.format(alpha="0.5 deg", histories="cycles"), encoding="utf-8")
    tolstat.run(tolstat.load(source), source.with_suffix(".h5"), workers=1)
    curve = pd.Series({"k_1": LINE.k, "ND": LINE.N_D, "SD": LINE.S_D / 2})  # amplitudes
    for path in (campaign(), source.with_suffix(".h5")):
        with ResultFile.open(path) as store:
            frame = pylife_frame(store.view(), ["cross1.F_t"]).set_index("joint")[["range", "mean", "cycles"]]
        loading = load_cycles(path, ["cross1.F_t"])
        sums = damage(loading.cycles, LINE, 1e7)[:, 0]
        theirs = curve.fatigue.miner_elementary().damage(frame.load_collective).groupby("joint").sum()
        valid = np.flatnonzero(np.isfinite(sums))
        assert theirs.index.tolist() == (1 + valid).tolist()
        np.testing.assert_allclose(1e7 * theirs.to_numpy(), sums[valid], rtol=1e-9)


@pytest.mark.slow
def test_command_prints_loads_and_damage(campaign, tmp_path):
    out = tmp_path / "out"
    done = call("fatigue", campaign(), "--out", out)
    assert done.exit_code == 0, done.stderr
    assert len(done.stdout.splitlines()) == 1 + 16 + 3 + 9
    assert "share of the joints where it exceeds 1" in done.stdout
    stem = f"{campaign().stem}_fatigue"
    assert len(list(out.glob(f"{stem}_spectrum-*.png"))) == 4
    frame = pd.read_csv(out / f"{stem}_loads.csv")
    assert len(frame) == 48 * 3
    loading = load_cycles(campaign())
    median = frame[(frame["channel"] == "fork1.F_z") & (frame["share"] == 0.5)].iloc[0]
    values = equivalent_load(loading.cycles.of("fork1.F_z"), 4.0, 1e7, 1e6)[:, 0]
    ordered = np.sort(values[loading.status == tolstat.Status.OK])
    assert median["estimate"] == pytest.approx(ordered[(len(ordered) + 1) // 2 - 1])
    only = call("fatigue", campaign(), "--by", "fork*.F_z")
    assert len(only.stdout.splitlines()) == 1 + 4


def test_spectra_fall_and_four_are_drawn(campaign):
    loading = load_cycles(campaign())
    table = pd.DataFrame(fatigue.spectrum(loading, "fork1.F_z"))
    for _, part in table.groupby("share"):
        assert (np.diff(part["cycles"]) > 0).all()
        assert (np.diff(part["estimate"]) <= 0).all()
        assert (part["lower"] <= part["estimate"]).all()
        assert (part["estimate"] <= part["upper"]).all()
    assert [name[:4] for name in fatigue.leading(fatigue.equivalent_loads(loading), CARDAN)] == [
        "cros",
        "cros",
        "fork",
        "fork",
    ]
    assert fatigue.most_loaded(fatigue.equivalent_loads(loading), CARDAN)[-1].startswith("fork4.T_")


def test_a_slice_of_a_campaign_has_the_rows_of_the_campaign(campaign, tmp_path):
    part = tmp_path / "part.h5"
    tolstat.run(tolstat.load(campaign().with_suffix(".toml")), part, workers=1, rows=range(4, 9), check=False)
    assert load_cycles(part).status.tolist() == load_cycles(campaign()).status[3:8].tolist()
    joints = []
    for path in (campaign(), part):
        with ResultFile.open(path) as store:
            joints.append(set(pylife_frame(store.view())["joint"]))
    assert joints[1] == joints[0] & set(range(4, 9))
    assert joints[1]


def test_only_the_first_samples_are_read(campaign):
    whole, part = load_cycles(campaign()), load_cycles(campaign(), samples=5)
    assert part.status.tolist() == whole.status[:5].tolist()
    assert np.array_equal(moment(part.cycles, 3.0), moment(whole.cycles, 3.0)[:5], equal_nan=True)
    assert np.array_equal(moment(part.nominal, 3.0), moment(whole.nominal, 3.0))
