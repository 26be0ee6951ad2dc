"""What a verdict stands on: which variations are simulated, when they turn the verdict, and what is said of it."""

from __future__ import annotations

from functools import cache, partial

import numpy as np
import pytest

import tolstat
from tests.support import synthetic
from tests.support.mechanisms import bushing_kind
from tolstat.analysis.binomial import clopper_pearson
from tolstat.campaign import blocks
from tolstat.campaign import what_if as sets
from tolstat.campaign.work import Work
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError, NotApplicable, StoreError
from tolstat.common.tables import Simulation, Status, tables
from tolstat.display.answer import Sentence
from tolstat.questions.assumptions import answer as run
from tolstat.questions.assumptions import sentences, variations
from tolstat.questions.assumptions.variations import BETTER, evaluate
from tolstat.report import headline
from tolstat.solver import stationary
from tolstat.store import ResultFile, what_if

ASSUMED = """
[[assumed]]
name = "mounting"
values = [{ shaft.axial = "free" }]
because = "nobody knows"

[[assumed]]
name = "arm length"
values = [{ arm.l_f = "30 mm" }, { arm.l_f = "45 mm" }]
because = "a fork is no beam"

[[assumed]]
name = "place of the cross bushings"
values = [{ cross.r_b = "30 mm" }]
because = "nobody knows"

[[assumed]]
name = "damping, oil film and hub"
values = [{ contact.c_t = "20 N*s/m" }]
because = "it moves nothing"
varied = false
"""
GIVEN = 'contact.law = "mode"\ncontact.H = 6.9\ncontact.D_H = "76.2 mm"\nshaft.Js = "0.01 kg*m^2"\n'
TEXT = (
    synthetic.HEAD.replace('base = "cirelli2021"\n', f'base = "cirelli2021"\n{GIVEN}')
    + """[tolerances]
"pin*.offset_z" = { iso2768 = "f", nominal = "72.8 mm", distribution = "normal", cpk = 1.0 }

[sampling]
n = 600
seed = 3

[output]
results = ["cross1.F_max"]

[limits]
"cross1.F" = "700 N"
"""
    + ASSUMED
)
PLACE = "r_b 30 mm"
NAMES = ["shaft slides", "arm length (l_f 30 mm)", "arm length (l_f 45 mm)", PLACE]


def stand_in(params, options, slides=0.0, arm=0.0, **given):
    """Loads at 100 N m from an offset, 40 N a sigma above 640 N; `slides` N where the shaft does, `arm` N a mm."""
    results = np.zeros(len(params), tables(CARDAN).RESULT)
    offset = params["pin_point"][:, 1, 2] / 5e-5
    length = params["marker"][:, bushing_kind("output fork"), 0, 2]
    load = 640.0 + 40.0 * np.abs(offset) + slides * params["slides"] + arm * 1e3 * (length - 0.03749)
    results["F_max"][:] = (params["torque"] / 100.0 * load)[:, None]
    results["status"], results["settled"] = Status.OK, 1
    stationary.fill_intervals(results)
    return Simulation(results, {})


def made(folder, text=TEXT, solver=stand_in):
    """Campaign of a stand-in for the solver."""
    return synthetic.simulated_by(solver, folder, text)


def stand_in_with(patch, **effects):
    patch.setattr(blocks, "simulate_rows", partial(stand_in, **effects))
    patch.setattr("tolstat.questions.shares.warm_up", lambda **_: None)


@pytest.fixture
def quick(monkeypatch):
    """A stand-in takes the place of the solver, in this process."""
    use = partial(stand_in_with, monkeypatch)
    use()
    return use


def simulated(path, **options):
    """Simulate the variations; returns what is told at the end."""
    told = []
    assert run.simulate(path, Work(workers=1, tell=told.append), **options) == [path]
    return told[-1]


@pytest.fixture(scope="module")
def varied(tmp_path_factory):
    """Campaign of a stand-in with these effects and all variations of it, made once; not to be written."""

    @cache
    def campaign(**effects):
        path = made(tmp_path_factory.mktemp("varied"))
        with pytest.MonkeyPatch.context() as patch:
            stand_in_with(patch, **effects)
            assert simulated(path).startswith(f"simulated {600 * len(standing(path).rows)} joints in ")
        return path

    return campaign


def standing(path, accepted=np.nan):
    with ResultFile.open(path) as store:
        return evaluate(store.view(), accepted)


def verdict(path, accepted):
    with ResultFile.open(path) as store:
        return headline.headline(store.view(), accepted)


def of(found, label):
    return next(row for row in found.rows if row["label"] == label)


def test_every_value_is_simulated_and_then_all_together(varied, quick):
    path = varied(slides=-60.0, arm=4.0)
    found = standing(path)
    assert {row["label"] for row in found.rows} == {*NAMES, BETTER}  # one assumption alone is worse
    assert of(found, BETTER)["because"] == "shaft slides, arm length (l_f 30 mm)"
    assert {row["n"] for row in found.rows} == {600}
    assert found.still == ["place of the cross bushings"]
    assert [own.name for own in found.fixed] == ["damping, oil film and hub"]
    assert simulated(path) == "all 5 variations are in the file, 600 joints of each"


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("fixed", [False, True])
def test_a_rigid_shaft_is_varied_without_the_axial_force_and_says_so(tmp_path, fixed):
    scatter = '[tolerances]\noperation.axial_force = { plus_minus = "500 N", distribution = "uniform" }\n'
    free = 'shaft.axial = "free"\nshaft.mass = "5 kg"\nshaft.axial_damping = "2e4 N*s/m"\n'
    text = TEXT.replace(GIVEN, GIVEN + free).replace('axial = "free" }', 'axial = "rigid" }')
    change = (
        ('torque = "100 N*m"\n', 'torque = "100 N*m"\naxial_force = "200 N"\n')
        if fixed
        else ("[tolerances]\n", scatter)
    )
    path = made(tmp_path, text.replace(*change))
    simulated(path)
    found = standing(path)
    assert of(found, "shaft rigid")["n"] == 600
    assert found.idle == ("shaft rigid",)
    assert sentences.idle(found) == (
        "shaft rigid: simulated without operation.axial_force and its tolerance, which do nothing to an output shaft "
        "that is rigid along its axis"
    )
    with ResultFile.open(path) as store:
        assert sentences.idle(found) in [
            str(part.text) for part in tolstat.assumptions(store.view()).parts if isinstance(part, Sentence)
        ]


@pytest.mark.usefixtures("quick")
def test_a_value_that_the_joint_has_is_not_varied(tmp_path):
    other = '[{ shaft.axial = "free" }, { shaft.axial = "rigid" }]'
    free = TEXT.replace(GIVEN, f'{GIVEN}shaft.axial = "free"\n')
    both, alone = synthetic.load(tmp_path, free.replace('[{ shaft.axial = "free" }]', other)), made(tmp_path, free)
    assert [one.label for one in variations.singles(both) if one.name == "mounting"] == ["shaft rigid"]
    assert simulated(alone).endswith("600 of each of 3 variations")
    found = standing(alone)
    assert "mounting" not in {*found.still, *found.missing, *found.names}
    assert found.confidence == 1.0 - 0.05 / len(found.rows)
    assert "Mounting: only as drawn is listed; give other values in [[assumed]]." in sentences.still(found)


@pytest.mark.usefixtures("quick")
def test_fewer_joints_than_the_campaign_has_are_an_answer(tmp_path):
    path = made(tmp_path)
    simulated(path, joints=100)
    assert {row["n"] for row in standing(path).rows} == {100}


@pytest.mark.usefixtures("quick")
def test_more_joints_than_the_campaign_has_are_drawn(tmp_path):
    path = made(tmp_path)
    simulated(path, joints=700)
    assert {row["n"] for row in standing(path).rows} == {700}


@pytest.mark.usefixtures("quick")
def test_a_long_campaign_gives_its_first_thousand_joints(tmp_path):
    path = made(tmp_path, TEXT.replace("n = 600", "n = 1200"))
    simulated(path)
    assert {row["n"] for row in standing(path).rows} == {1000}
    simulated(path, joints=1500)
    found = standing(path)
    assert {row["n"] for row in found.rows} == {1500}
    with ResultFile.open(path) as store:
        drawn = [one for one in what_if.read(store).values() if one.about["kind"] == sets.AS_DRAWN]
    assert [(one.first, one.end) for one in drawn] == [(1200, 1500)]


def test_a_variation_has_the_results_of_a_study_with_that_key(tmp_path, varied):
    path = varied(slides=-60.0, arm=4.0)
    text = TEXT.replace("[operation]", 'arm.l_f = "30 mm"\n[operation]')
    own = made(tmp_path, text, partial(stand_in, slides=-60.0, arm=4.0))
    with ResultFile.open(path) as store, ResultFile.open(own) as other:
        held = what_if.read(store)[what_if.key(sets.about_joint(store.view().study, {"arm.l_f": "30 mm"}))]
        assert held.valid(["cross1.F"]).tobytes() == other.view().load("cross1.F").values.tobytes()
        assert held.valid(["cross1.F"]).tobytes() != store.view().load("cross1.F").values.tobytes()


@pytest.mark.slow
def test_the_solver_gives_a_variation_and_a_study_with_that_key_the_same_bytes(tmp_path):
    text = TEXT.replace("n = 600", "n = 24").replace("[sampling]", f"{synthetic.SOLVER}[sampling]")
    own = text.replace("[operation]", 'shaft.axial = "free"\n[operation]')
    for name, written in (("made", text), ("own", own)):
        (tmp_path / f"{name}.toml").write_text(written, encoding="utf-8")
        tolstat.run(tolstat.load(tmp_path / f"{name}.toml"), tmp_path / f"{name}.h5", workers=1)
    simulated(tmp_path / "made.h5")
    with ResultFile.open(tmp_path / "made.h5") as store, ResultFile.open(tmp_path / "own.h5") as other:
        held = what_if.read(store)[what_if.key(sets.about_joint(store.view().study, {"shaft.axial": "free"}))]
        loads = {name: other.view().load(name).values for name in held.names}
        assert all(held.valid([name]).tobytes() == values.tobytes() for name, values in loads.items())
        assert held.valid(["cross1.F"]).tobytes() != store.view().load("cross1.F").values.tobytes()


def test_a_verdict_turns_only_where_share_and_difference_are_beyond_doubt(varied):
    path = varied(slides=-60.0, arm=4.0)
    share = of(standing(path), "shaft slides")["share"]
    n = len(standing(path).rows)
    low, high = (float(end) for end in clopper_pearson(round(600 * share), 600, 1.0 - 0.05 / n))
    assert of(standing(path), "shaft slides")["share_upper"] == pytest.approx(high)
    assert of(standing(path, high + 1e-4), "shaft slides")["turns"]
    assert not of(standing(path, high - 1e-4), "shaft slides")["turns"]
    assert of(standing(path, high - 1e-4), "shaft slides")["side"] == "open"
    assert clopper_pearson(round(600 * share), 600, 0.95)[1] < high - 1e-4  # which one variation alone would decide
    assert low < share < high
    assert standing(path, high + 1e-4).turning[0]["label"] == "shaft slides"


def test_what_moves_nothing_turns_nothing(varied, monkeypatch):
    path = varied(slides=-60.0)
    monkeypatch.setattr(variations, "total_interval", lambda *given: (0.0, 0.01))
    found = standing(path, 0.02)
    row = of(found, PLACE)
    assert (found.side, row["side"], row["moves"], row["turns"]) == ("yes", "no", False, False)
    assert of(found, "shaft slides")["moves"]


def test_joints_without_a_load_count_on_both_sides(tmp_path, quick, monkeypatch):
    path = made(tmp_path)

    def failing(params, options, **given):
        made = stand_in(params, options)
        lost = (params["slides"] > 0) & (params["pin_point"][:, 1, 2] > 1e-4)
        made.results["status"][lost] = Status.NEWTON_FAILED
        return made

    monkeypatch.setattr(blocks, "simulate_rows", failing)
    simulated(path)
    row, other = (of(standing(path), label) for label in ("shaft slides", PLACE))
    assert row["n_failed"] > 5
    assert row["share_lower"] < other["share_lower"]
    assert row["share_upper"] - row["share"] > row["n_failed"] / 600
    assert row["change_lower"] < 0.0 < row["change_upper"]
    with ResultFile.open(path) as store:
        told = [part.text for part in run.assumptions(store.view()).parts if isinstance(part, Sentence)]
    assert any(each.startswith(f"joints without a result: {row['n_failed']} of 600 with ") for each in told)


def test_a_run_that_is_stopped_goes_on(tmp_path, varied, quick, monkeypatch):
    path, taken, solver = made(tmp_path), [], partial(stand_in, slides=-60.0)

    def failing(*arguments, **options):
        taken.append(1)
        if len(taken) == 9:
            raise KeyboardInterrupt
        return solver(*arguments, **options)

    monkeypatch.setattr(blocks, "simulate_rows", failing)
    with pytest.raises(KeyboardInterrupt):
        simulated(path)
    assert standing(path).missing
    assert "not varied: tolstat assumptions made.h5 --run" in verdict(path, 0.5).sentence
    monkeypatch.setattr(blocks, "simulate_rows", solver)
    simulated(path)
    with ResultFile.open(path) as store, ResultFile.open(varied(slides=-60.0)) as whole:
        found, expected = what_if.read(store), what_if.read(whole)
    assert {name: one.loads.tobytes() for name, one in found.items()} == {
        name: one.loads.tobytes() for name, one in expected.items()
    }


def test_sentences_of_each_case(tmp_path, varied):
    path = varied(slides=-60.0, arm=4.0)
    before = verdict(made(tmp_path), 0.5)
    assert before.answer == "yes"
    assert before.sentence.endswith("; 3 assumptions not varied: tolstat assumptions made.h5 --run")
    assert before.stands_on["answer"] is None
    share = of(standing(path), "shaft slides")["share"]
    shown = tolstat.display.text.percent

    kept = verdict(path, 0.6)
    assert kept.sentence.startswith("kept: at most 60 % exceed 700 N on cross1.F (")
    assert kept.sentence.endswith(", also in all 5 variations of what is assumed")
    assert (kept.stands_on["answer"], kept.shade) == ("kept", "yes")

    turned = verdict(path, 0.05)
    drawn = standing(path).drawn[0]
    assert turned.sentence == (
        f"not kept as drawn ({shown(drawn)}), kept if the shaft slides ({shown(share)}): more joints do not decide it; "
        "find out how the shaft is held"
    )
    assert turned.values()["answer"] == "not kept"
    assert turned.values()["stands_on"] | {"answer": "open", "variations": 5} == turned.values()["stands_on"]
    assert turned.shade == "open"

    opened = verdict(path, drawn + 0.002)
    assert opened.sentence.startswith(f"open: {shown(drawn)} exceed 700 N on cross1.F (")
    assert "is the true share. Of 5 variations of what is assumed: kept in " in opened.sentence


def test_a_verdict_that_nothing_turns_names_the_least_share(tmp_path, quick):
    quick(slides=-20.0, arm=1.0)
    path = made(tmp_path)
    simulated(path)
    found = verdict(path, 0.001)
    least = min(standing(path).rows, key=lambda row: row["share"])
    assert found.sentence == (
        f"not kept: {tolstat.display.text.percent(standing(path).drawn[0])} exceed 700 N on cross1.F "
        f"({tolstat.display.text.span(*standing(path).drawn[1:])}); 0.1 % is accepted. "
        f"Least of 5 variations: {tolstat.display.text.percent(least['share'])}, {least['label']}"
    )
    assert found.stands_on["answer"] == "not kept"


def test_the_same_words_for_a_verdict_that_is_kept_as_drawn(tmp_path, quick):
    quick(slides=60.0, arm=0.0)
    path = made(tmp_path)
    simulated(path)
    found = verdict(path, 0.3)
    assert found.sentence.startswith("kept as drawn (")
    assert ", not kept if the shaft slides (" in found.sentence
    assert (found.answer, found.stands_on["answer"]) == ("yes", "open")


def test_a_share_near_the_accepted_one_takes_more_joints(varied):
    path = varied(slides=-60.0)
    share = of(standing(path), "shaft slides")["share"]
    found = standing(path, share + 0.004)
    assert [row["label"] for row in found.undecided] == ["shaft slides"]
    said = sentences.more(found, "made.h5")
    assert said.startswith("undecided: shaft slides (")
    assert " --run --joints " in said


def test_more_joints_decide_what_the_first_ones_leave_open(tmp_path, varied, quick):
    """Only of this variation; all intervals are then those of two looks at each variation, and the same call ends."""
    quick(slides=-60.0)
    path = tmp_path / "made.h5"
    path.write_bytes(varied(slides=-60.0).read_bytes())
    first = standing(path)
    accepted = of(first, "shaft slides")["share_upper"] - 0.002
    assert standing(path, accepted).side == "no"
    assert [row["label"] for row in standing(path, accepted).undecided] == ["shaft slides"]
    told = simulated(path, accepted=accepted)
    second = standing(path, accepted)
    row = of(second, "shaft slides")
    assert 600 < row["n"] <= 2400
    assert told.endswith(f", {row['n']} of shaft slides")
    assert {other["n"] for other in second.rows if other is not row} == {600}
    assert row["turns"]
    assert second.confidence == 1.0 - (1.0 - first.confidence) / 2.0
    assert simulated(path, accepted=accepted).startswith("all 4 variations are in the file")


def test_the_joint_without_errors_is_told_first(tmp_path, quick):
    path = made(tmp_path, TEXT.replace('"700 N"', '"600 N"'))
    assert verdict(path, 0.1).sentence.startswith(
        "not kept: the joint without errors exceeds 600 N on cross1.F (640 N). 100 % exceed 600 N on cross1.F ("
    )


SWEEP = synthetic.SWEEP.replace("points = 11", "points = 5") + '[limits]\n"cross1.F" = "700 N"\n'
REFUSED = {
    "no limits": (TEXT.partition("[limits]")[0] + ASSUMED, "has no limits"),
    "a sweep": (SWEEP, "holds several joints"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_files_of_another_kind_are_refused_with_the_reason(tmp_path, case):
    text, words = REFUSED[case]
    path = synthetic.store(tmp_path, text, name="other")
    before = path.read_bytes()
    with pytest.raises(StoreError, match=words):
        run.simulate(path, Work(workers=1))
    assert path.read_bytes() == before
    with ResultFile.open(path) as store:
        assert variations.applicable(store.view()) is None
        found = headline.headline(store.view(), 0.1)
        assert found is None or found.stands_on is None


@pytest.mark.usefixtures("quick")
def test_nothing_assumed_and_nothing_simulated_are_told(tmp_path):
    path = made(tmp_path)
    with ResultFile.open(path) as store, pytest.raises(NotApplicable, match="tolstat assumptions"):
        tolstat.assumptions(store.view())
    text = TEXT.replace(ASSUMED, "").replace("[operation]", 'shaft.axial = "free"\ncross.r_b = "36 mm"\n[operation]')
    path.unlink()
    bare = made(tmp_path, text)
    with pytest.raises(StoreError, match="lists no other values to try: neither the study nor its joint file has"):
        simulated(bare)
    assert verdict(bare, 0.5).sentence.endswith(")")


@pytest.mark.usefixtures("quick")
def test_values_that_make_no_joint_are_all_told_before_anything_is_simulated(tmp_path, monkeypatch):
    path = made(tmp_path)
    wrong = [
        variations.Variation("a", "b", {"contact.H": -1.0}, ""),
        variations.Variation("c", "d", {"pin.l": "-1 mm"}, ""),
    ]
    monkeypatch.setattr(variations, "singles", lambda study: wrong)
    before = path.read_bytes()
    with pytest.raises(InputError) as raised:
        simulated(path)
    assert len(raised.value.faults) == 2
    assert path.read_bytes() == before


def test_what_the_shop_must_hold_has_the_capability_of_zones_too(tmp_path):
    zone = '"pin*.position" = { zone = "⌀0.1 mm", over = "22 mm", distribution = "normal" }\n"pin*.offset_e"'
    with ResultFile.open(made(tmp_path, TEXT.replace('"pin*.offset_z"', zone))) as store:
        assert "Cp 1 in 1 tolerance and Cpk 1 in 1 tolerance." in sentences.shop(store.view())


@pytest.mark.parametrize(
    ("name", "keys", "label", "condition"),
    [
        ("mounting", {"shaft.axial": "free"}, "shaft slides", "if the shaft slides"),
        ("mounting", {"shaft.axial": "rigid"}, "shaft rigid", "if the shaft is held rigidly"),
        ("contact law", {"contact.law": "sliced"}, "law sliced", "with law sliced"),
        ("H", {"contact.H": 3.0}, "H 3", "with H 3"),
        ("clearance", {"contact.clearance": "0.05 mm", "contact.k1u": "1 N/m^2"}, "clearance 0.05 mm", None),
        ("inertia", {"shaft.Js": "0.1 kg*m^2"}, "inertia (Js 0.1 kg m²)", None),
    ],
)
def test_values_in_words(name, keys, label, condition):
    assert variations.label_of(name, keys) == label
    assert condition is None or sentences._condition(label) == condition
