"""Keys of a study changed in its text: every way to write a table, and all the rest as it was."""

import tomllib
from difflib import ndiff
from functools import reduce
from operator import getitem
from pathlib import Path

import pytest

from tolstat.common.errors import InputError
from tolstat.study.rewriting import with_keys, with_settings

TILT = ("tolerances", "pin1", "tilt_t")
QUOTED = ("tolerances", "pin*.tilt_t")
NEW = {"iso2768": None, "nominal": None, "plus_minus": "0.1 mm", "distribution": "uniform", "cpk": 1}
"""Keys removed, added, changed and left as they are."""
STUDIES = sorted(
    path
    for path in (Path(__file__).parents[2] / "studies").rglob("*.toml")
    if "sampling" in tomllib.loads(path.read_text(encoding="utf-8"))
)

FORMS = {
    "inline": (
        QUOTED,
        '[tolerances] # all\n"pin*.tilt_t" = { iso2768 = "f", nominal = "20 mm", distribution = "normal", cpk = 1.00 }'
        " # tilt\n# own\nhole1.diameter = {std='1 um'}\n",
        '[tolerances] # all\n"pin*.tilt_t" = { distribution = "uniform", cpk = 1.00, plus_minus = "0.1 mm" }'
        " # tilt\n# own\nhole1.diameter = {std='1 um'}\n",
    ),
    "dotted": (
        TILT,
        '[tolerances]\npin1.tilt_t.iso2768 = "f"\npin1.tilt_t.nominal = "20 mm"\n# kind\n'
        'pin1.tilt_t.distribution="normal" # d\npin1.tilt_t.cpk = 1.00\n\n# next\n[limits]\npsi = "1 deg"\n',
        '[tolerances]\n# kind\npin1.tilt_t.distribution="uniform" # d\npin1.tilt_t.plus_minus = "0.1 mm"\n'
        'pin1.tilt_t.cpk = 1.00\n\n# next\n[limits]\npsi = "1 deg"\n',
    ),
    "all in one line": (
        TILT,
        'tolerances = { pin1 = { tilt_t = {iso2768="f", nominal="20 mm", distribution="normal", cpk=1.00} } } # x\n',
        'tolerances = { pin1 = { tilt_t = { distribution = "uniform", cpk = 1.00, plus_minus = "0.1 mm" } } } # x\n',
    ),
    "header": (
        QUOTED,
        '[tolerances."pin*.tilt_t"] # tilt\n  iso2768 = "f"\nnominal = "20 mm"\n  "distribution" = \'normal\'  # d\n'
        "cpk = 1.00\n\n# next\n[[correlation]]\nrho = 0.5\n",
        '[tolerances."pin*.tilt_t"] # tilt\n  "distribution" = "uniform"  # d\ncpk = 1.00\nplus_minus = "0.1 mm"\n'
        "\n# next\n[[correlation]]\nrho = 0.5\n",
    ),
    "several headers": (
        TILT,
        '[tolerances.pin1.offset_t]\nstd = "1 um"\n[limits] # l\npsi = "1 deg"\n# tilt\n[tolerances.pin1.tilt_t]\n'
        'iso2768 = "f"\nnominal = "20 mm"\ndistribution = "normal"\ncpk = 1.00\n# pin 2\n[tolerances.pin2]\n',
        '[tolerances.pin1.offset_t]\nstd = "1 um"\n[limits] # l\npsi = "1 deg"\n# tilt\n[tolerances.pin1.tilt_t]\n'
        'distribution = "uniform"\ncpk = 1.00\nplus_minus = "0.1 mm"\n# pin 2\n[tolerances.pin2]\n',
    ),
    "array of tables": (
        ("case", 1, "errors"),
        '[[case]]\nname = "a" # 1\n[[case]]\n[case.errors]\niso2768 = 1\ndistribution = 2 # 2\n[[case]]\nname = "b"\n',
        '[[case]]\nname = "a" # 1\n[[case]]\n[case.errors]\ndistribution = "uniform" # 2\nplus_minus = "0.1 mm"\n'
        'cpk = 1\n[[case]]\nname = "b"\n',
    ),
}


@pytest.mark.parametrize("form", FORMS)
def test_each_way_to_write_a_table(form):
    path, before, after = FORMS[form]
    found = with_keys(before, {path: NEW}, "a.toml")
    assert found == after
    table = reduce(getitem, path, tomllib.loads(found))
    assert table == {"plus_minus": "0.1 mm", "distribution": "uniform", "cpk": 1}


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_of_each_study_only_the_line_changed_is_another(path):
    text = path.read_text(encoding="utf-8")
    seed = tomllib.loads(text)["sampling"].get("seed", 0) + 1
    found = with_keys(text, {("sampling",): {"seed": seed}}, "a.toml")
    assert tomllib.loads(found)["sampling"]["seed"] == seed
    differing = [line for line in ndiff(text.splitlines(), found.splitlines()) if line[0] in "+-"]
    assert [line[2:6] for line in differing] in (["seed"], ["seed", "seed"])


@pytest.mark.parametrize(
    "text",
    ["[a.b]\n[[c]]\n[a.d]\n[sampling]\n", "[[a]]\n[sampling]\n[[a]]\n", "[sampling]\nnot TOML\n"],
)
def test_what_tomlkit_would_move_or_cannot_read_is_refused(text):
    with pytest.raises(InputError, match=r"a\.toml: cannot be changed in place"):
        with_keys(text, {("sampling",): {"n": 4}}, "a.toml")


SETTABLE = """# A comment.
[joint]
base = "cirelli2021"
contact.clearance = "0.1 mm"  # why
shaft = { mass = "3 kg" }

[operation]
alpha = "15 deg"
# about the next table
[tolerances]
"pin*.offset_t" = { plus_minus = "0.1 mm", distribution = "normal" }
"""


@pytest.mark.parametrize(
    ("setting", "old", "new"),
    [
        ("joint.shaft.axial=free", '{ mass = "3 kg" }', '{ mass = "3 kg", axial = "free" }'),
        ('joint.shaft.mass="4 kg"', "3 kg", "4 kg"),
        ('"joint".\'shaft.mass\'="4 kg"', "3 kg", "4 kg"),
        ("joint.contact.clearance = 0.2 mm", '"0.1 mm"  # why', '"0.2 mm"  # why'),
        (
            "joint.bushing.cross.k_x=2e9 N/m",
            'shaft = { mass = "3 kg" }\n',
            'shaft = { mass = "3 kg" }\nbushing = { cross = { k_x = "2e9 N/m" } }\n',
        ),
        ("operation.alpha=0 deg", "15 deg", "0 deg"),
        ("operation.axial_force=3 N", '"15 deg"\n', '"15 deg"\naxial_force = "3 N"\n'),
    ],
)
def test_a_setting_of_the_command_line_changes_one_value(setting: str, old: str, new: str) -> None:
    assert with_settings(SETTABLE, [setting]) == SETTABLE.replace(old, new, 1)


def test_a_setting_adds_the_section_that_is_missing() -> None:
    made = with_settings(SETTABLE, ["sampling.n=90", "sampling.method=random"])
    assert made == f'{SETTABLE}\n[sampling]\nn = 90\nmethod = "random"\n'


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("joint.shaft.axial", "is not a setting"),
        ("joint=3", "is not a setting"),
        ("operation..alpha=1 deg", "is not a setting"),
        ("tolerances.pin1.offset_t=3", "is in section 'tolerances'"),
        ("joint.base.x=4", "joint.base is no single table"),
        ("solver.steps_per_rev=90", "is in section 'solver'"),
    ],
)
def test_what_cannot_be_set_is_refused(setting: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        with_settings(SETTABLE, [setting])
