"""JSON schemas: what they accept and refuse, keys with meaning and example, and files that `tolstat new` writes."""

from __future__ import annotations

import json
import random
import re
import tomllib
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import jsonschema
import pytest
from pydantic import TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from typer.testing import CliRunner

from tests.support.environment import ROOT
from tolstat import joint, study
from tolstat.cli import app
from tolstat.common.cardan import CARDAN, MECHANISMS
from tolstat.common.errors import InputError
from tolstat.common.loads import units_of_limits
from tolstat.common.strict import Strict
from tolstat.study import schema, starter
from tolstat.study.model import Subset
from tolstat.study.selection import Entry, resolve, toleranced_units
from tolstat.study.tolerances.entry import Site

VALIDATORS = {kind: jsonschema.Draft7Validator(schema.schema(kind)) for kind in schema.KINDS}
STUDIES = [path for path in sorted((ROOT / "studies").rglob("*.toml")) if path.stem not in ("precision", "tilted_pin")]
GOOD = """
[joint]
base = "cirelli2021"
contact.D_P = "75.9 mm"
bushing.cross = { k_x = "2e9 N/m" }
[operation]
alpha = "15 deg"
speed = "500 rpm"
torque = "100 N*m"
[solver]
steps_per_rev = 90
[errors]
pin3.tilt_z = "0.1 deg"
material.E_factor = 1.1
[tolerances]
"pin[12].offset_t" = { plus_minus = "0.1 mm", distribution = "normal", cpk = 1.0 }
hole1.offset_radial = { plus_minus = "0.1 mm", distribution = "rayleigh" }
pin1."offset_[ez]" = { lower = "0 mm", upper = "0.1 mm", distribution = "beta", a = 2, b = 3.5 }
[[correlation]]
between = ["pin1.offset_t", "pin2.offset_t"]
rho = 0.6
[sampling]
n = 8
[limits]
"cross*.F" = "700 N"
psi = 1e-3
[[case]]
name = "tilt"
errors.pin1.tilt_z = "0.5 deg"
[[variant]]
name = "clearance"
points = 3
vary.contact.D_P = { from = "76.0 mm", to = "75.6 mm" }
[fatigue]
line."cross*.T at worst" = { m = 5, S0 = "150 N*m", N0 = 2e6 }
"""
BROKEN = [
    ("[operation]", "[operatoin]"),
    ("base =", "bases ="),
    ("contact.D_P", "contact.D_p"),
    ('"75.9 mm"', "75.9"),
    ("speed = ", "sped = "),
    ('"15 deg"', '"15"'),
    ("steps_per_rev = 90", "steps_per_rev = 90.5"),
    ("steps_per_rev = 90", "steps_per_rev = 2"),
    ("pin3.tilt_z", "pin3.tilt_e"),
    ("[errors]", '[errors]\noperation.alpha = "5 deg"'),
    ("E_factor = 1.1", 'E_factor = "1.1 mm"'),
    ('"pin[12].offset_t" =', '"pin[12].ofset_t" ='),
    ('"normal"', '"gaussian"'),
    ("cpk = 1.0", "ccpk = 1.0"),
    ("cpk = 1.0", "cpk = -1.0"),
    ('"0.1 mm", distribution = "normal"', '"-0.1 mm", distribution = "normal"'),
    ('distribution = "rayleigh"', 'distribution = "normal"'),
    ("rho = 0.6", "rho = 1.6"),
    ("n = 8", 'method = "subset"'),
    ('"cross*.F"', '"cross*.G"'),
    ('"700 N"', "700"),
    ("errors.pin1.tilt_z", "error.pin1.tilt_z"),
    ('to = "75.6 mm"', 'until = "75.6 mm"'),
    ('S0 = "150 N*m"', "S0 = 150"),
]


def names(path: Path) -> str:
    return path.stem


def faults(kind: str, text: str) -> list[str]:
    """What an editor would mark in a file, as place and message."""
    return [f"{fault.json_path}: {fault.message}" for fault in VALIDATORS[kind].iter_errors(tomllib.loads(text))]


@pytest.mark.parametrize("kind", list(schema.KINDS))
def test_schemas_are_of_draft_7_without_look_around_and_keywords_of_our_own(kind: str) -> None:
    made = schema.schema(kind)
    jsonschema.Draft7Validator.check_schema(made)
    assert made["$schema"] == schema.DRAFT
    text = json.dumps(made)
    assert not re.search(r"\(\?[=!<]|\"x-|\$defs|prefixItems|\"null\"", text)


@pytest.mark.parametrize("path", STUDIES, ids=names)
def test_every_study_is_accepted(path: Path) -> None:
    assert faults("study", path.read_text(encoding="utf-8")) == []


def test_the_case_and_the_joints_are_accepted() -> None:
    assert faults("case", (ROOT / "studies" / "tilted_pin.toml").read_text(encoding="utf-8")) == []
    texts = [path.read_text(encoding="utf-8") for path in (ROOT / "data" / "joints").glob("*.toml")]
    assert texts
    assert [fault for text in texts for fault in faults("joint", text)] == []


def test_a_study_with_all_kinds_of_tables_is_accepted() -> None:
    assert faults("study", GOOD) == []


def test_several_operating_points_are_accepted_in_a_study_only() -> None:
    points = GOOD.replace("[operation]", '[[operation]]\nname = "cruise"\nshare = "60 %"')
    points = points.replace('"cross*.F" =', '"cross*.F at cruise" =')
    VALIDATORS["study"].validate(tomllib.loads(points))
    assert not VALIDATORS["study"].is_valid(tomllib.loads(points.replace("name =", "nmae =")))
    assert not VALIDATORS["study"].is_valid(tomllib.loads(points.replace("F at cruise", "G at cruise")))
    assert not VALIDATORS["case"].is_valid(tomllib.loads(points.partition("[tolerances]")[0]))


@pytest.mark.parametrize(("old", "new"), BROKEN)
def test_broken_studies_are_refused(old: str, new: str) -> None:
    assert old in GOOD
    assert faults("study", GOOD.replace(old, new, 1)) != []


@pytest.mark.parametrize(("kind", "key"), [("case", "sampling"), ("joint", "pins")])
def test_tables_of_other_files_are_refused(kind: str, key: str) -> None:
    path = ROOT / ("studies/tilted_pin.toml" if kind == "case" else "data/joints/cirelli2021.toml")
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    assert VALIDATORS[kind].is_valid(data)
    assert not VALIDATORS[kind].is_valid({**data, key: {}})


def pattern(random_numbers: random.Random, word: str) -> str:
    """Pattern that selects a word."""
    made, i = "", 0
    while i < len(word):
        kind = random_numbers.choice(["letter", "letter", "letter", "?", "set", "not", "*"])
        made += {"letter": word[i], "?": "?", "set": f"[{word[i]}x]", "not": "[!#]", "*": "*"}[kind]
        i += random_numbers.randint(0, 4) if kind == "*" else 1
    return made


@pytest.mark.parametrize(
    ("units", "made"),
    [
        (names(mechanism), schema.sections()[section])
        for section, names in (("tolerances", toleranced_units), ("limits", units_of_limits))
        for mechanism in MECHANISMS.values()
    ],
)
def test_no_pattern_that_selects_something_is_refused(units: dict[str, str], made: dict[str, Any]) -> None:
    numbers, selecting = random.Random(5), 0
    keys = [re.compile(key) for key in made["patternProperties"]]
    for _ in range(300):
        key = ".".join(pattern(numbers, part) for part in numbers.choice(list(units)).split("."))
        try:
            resolve(Entry(key, (key,), None), units, "")
        except InputError:
            continue
        selecting += 1
        assert any(known.search(key) for known in keys), key
    assert selecting > 100


def models(base: type[Strict] = Strict) -> list[type[Strict]]:
    """All input models that study files have keys of, but those of the joint file."""
    found = [m for cls in base.__subclasses__() for m in (cls, *models(cls))]
    return [m for m in dict.fromkeys(found) if m.__module__.startswith("tolstat.study.") and m is not Subset]


@pytest.mark.parametrize("model", [joint.Operation, *models()], ids=lambda model: model.__name__)
def test_each_key_has_a_meaning_and_an_example_that_is_read(model: type[Strict]) -> None:
    made = schema.of_model(model)["properties"]
    for name, field in model.model_fields.items():
        if (field.alias or name).endswith(".orders"):  # part of another key
            continue
        own = made[field.alias or name]
        if "const" not in own:
            assert own["description"]
            assert all(readable(field, example) for example in own["examples"]), name


def readable(field: FieldInfo, example: object) -> bool:
    """Whether an example of a key can be read, as a value for an error that is a length or an angle."""
    adapter: TypeAdapter[Any] = TypeAdapter(Annotated[field.annotation, *field.metadata, None])
    for unit in ("m", "rad"):
        site = Site("pin1.tilt_z", unit, 0.0, ROOT / "studies")
        context = {"site": site, "tolerance": SimpleNamespace(site=site, mark=""), "mechanism": CARDAN}
        with suppress(ValidationError):
            adapter.validate_python(example, context=context)
            return True
    return False


SIDES = {"minimum": -1.0, "exclusiveMinimum": 0.0, "maximum": 1.0, "exclusiveMaximum": 0.0}
"""Side on which a value lies beyond a bound; the bound itself is beyond an exclusive one."""


@pytest.mark.parametrize("model", models(), ids=lambda model: model.__name__)
def test_the_bounds_of_each_key_hold(model: type[Strict]) -> None:
    """Pydantic drops bounds that stand before what reads a quantity."""
    made = schema.of_model(model)["properties"]
    for name, field in model.model_fields.items():
        own = made.get(field.alias or name, {})
        if own.get("type") == "integer" or own.get("x-unit") == "1":
            for bound, side in SIDES.items():
                assert bound not in own or not readable(field, type(own[bound])(own[bound] + side)), f"{name}: {bound}"


def test_an_example_that_cannot_be_read_is_found() -> None:
    assert not readable(joint.Operation.model_fields["speed"], "500 mm")


def test_each_key_of_a_joint_has_a_meaning_and_an_example() -> None:
    def lacking(part: dict[str, Any], before: str = "") -> list[str]:
        found = []
        for key, own in part["properties"].items():
            if own.get("type") == "object":
                found += lacking(own, f"{before}{key}.")
            elif not (own.get("description") and own.get("examples")):
                found.append(before + key)
        return found

    assert lacking(schema.joint()) == []


@pytest.mark.parametrize("own", ["own", "cirelli2021"])
def test_a_new_study_is_a_study_and_names_its_schemas(tmp_path: Path, own: str) -> None:
    written = starter.write(tmp_path / "deep" / "gear.toml", own)
    expected = ["gear.toml", "study.schema.json"]
    if own == "own":
        expected = ["gear.toml", "gear_joint.toml", "study.schema.json", "joint.schema.json"]
    assert [path.name for path in written] == expected
    loaded = study.load(written[0])
    assert (loaded.rows, len(loaded.limits)) == (257, 8)
    assert list(loaded.joint.warnings()) == []
    for path in (p for p in written if p.suffix == ".toml"):
        text = path.read_text(encoding="utf-8")
        found = re.match(r"#:schema \./(\w+)\.schema\.json\n", text)
        assert found is not None
        assert json.loads((path.parent / f"{found[1]}.schema.json").read_text(encoding="utf-8"))["title"]
        assert faults(found[1], text) == []
        assert max(map(len, text.splitlines())) <= 130


def test_a_joint_of_ones_own_says_what_each_key_means() -> None:
    text = starter.joint_text()
    for section, own in schema.joint()["properties"].items():
        for key, part in own.get("properties", {}).items():
            if part.get("type") != "object":
                assert re.search(rf"^(?:# )?{key} = ", text, flags=re.MULTILINE), f"{section}.{key}"
    assert "# Young's modulus" in text


def test_nothing_is_replaced_but_schemas(tmp_path: Path) -> None:
    path = tmp_path / "gear.toml"
    starter.write(path, "cirelli2021")
    (tmp_path / "study.schema.json").write_text('{"title": "Study of tolstat"}')
    with pytest.raises(InputError, match=r"gear\.toml: exists"):
        starter.write(path, "own")
    assert not (tmp_path / "gear_joint.toml").exists()
    starter.write(tmp_path / "other.toml", "cirelli2021")
    assert len((tmp_path / "study.schema.json").read_text()) > 10_000
    (tmp_path / "joint.schema.json").write_text("{}")
    with pytest.raises(InputError, match=r"joint\.schema\.json: exists"):
        starter.write(tmp_path / "third.toml", "own")
    with pytest.raises(InputError, match="did you mean 'cirelli2021'"):
        starter.write(tmp_path / "fourth.toml", "cirelli2022")


def test_commands_write_what_the_functions_make(tmp_path: Path) -> None:
    done = CliRunner().invoke(app, ["docs", "case.schema.json"])
    assert (done.exit_code, json.loads(done.stdout)) == (0, schema.schema("case"))
    assert CliRunner().invoke(app, ["docs", "cases.schema.json"]).exit_code == 2
    done = CliRunner().invoke(app, ["new", str(tmp_path / "gear"), "--joint", "own"])
    assert (done.exit_code, done.stdout) == (0, "")
    assert f"next: tolstat plan {tmp_path / 'gear.toml'}" in done.stderr
    assert CliRunner().invoke(app, ["new", str(tmp_path / "gear.toml")]).exit_code == 2
