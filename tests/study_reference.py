"""The tables of docs/study.md: keys of study, joint and case files, from the schemas that editors use."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from tolstat.common.cardan import CARDAN, MECHANISMS, PARTS, named
from tolstat.common.columns import optional_columns
from tolstat.common.load_kinds import kinds
from tolstat.common.loads import loads_of, units_of_limits
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import tables as tables_of
from tolstat.joint import Operation
from tolstat.joint.linkage import Drive, ForceOn, MemberOf, PairOf
from tolstat.joint.model import GIVEN_BY
from tolstat.joint.orders import SpeedOrder, TorqueOrder
from tolstat.joint.shaft import SplineOfTubes, Tube
from tolstat.study import schema
from tolstat.study.costs import CostEntry
from tolstat.study.fatigue import LineEntry, SequenceEntry, StressPointEntry
from tolstat.study.file import OF_CASE
from tolstat.study.listing import Range
from tolstat.study.model import SweepEntry
from tolstat.study.points import DrivenPoint, PointEntry
from tolstat.study.schema import of_model
from tolstat.study.selection import toleranced_units
from tolstat.study.tolerances.entry import Banded, LotEntry, SingleEntry
from tolstat.study.tolerances.fits import FitEntry
from tolstat.study.tolerances.kinds import ZONE_KINDS, kinds_of

WHOLE = MECHANISMS[named(CARDAN, PARTS)]
"""The joint with all that it may have."""
BAND = tuple(key for key in Banded.model_fields if key not in SingleEntry.model_fields)
ZONES = tuple(key for key in ZONE_KINDS if key != "offset_radial")
BOUNDS = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}


def key_table(properties: Mapping[str, Any], required: Iterable[str] = ()) -> str:
    """Markdown table of keys: type, unit, default, meaning, example."""
    lines = ["| key | type | unit | default | meaning | example |", "|---|---|---|---|---|---|"]
    for key, own in properties.items():
        if own.get("type") == "object" and "x-table" not in own:
            continue
        needed = "needed" if key in required else f"`{json.dumps(own['default'])}`" if "default" in own else ""
        example = f"`{key} = {toml(own['examples'][0])}`" if "examples" in own else ""
        unit = {"1": "", "error": "of the error"}.get(of_unit(own), of_unit(own))
        lines.append(f"| `{key}` | {kind(own)} | {unit} | {needed} | {own['description']} | {example} |")
    return "\n".join(lines)


def of_unit(own: Mapping[str, Any]) -> str:
    """SI unit of a key; empty for one that is no quantity."""
    return str(own.get("x-unit") or own.get("items", {}).get("x-unit") or _first(own).get("x-unit", ""))


def _first(own: Mapping[str, Any]) -> Mapping[str, Any]:
    items: list[Mapping[str, Any]] = own.get("prefixItems") or [{}]
    return items[0]


def kind(own: Mapping[str, Any]) -> str:
    """Type of a key in words, with its bounds."""
    if "enum" in own:
        return ", ".join(f'`"{word}"`' for word in own["enum"])
    if "x-unit" in own and "anyOf" in own:
        words, written = own["anyOf"][:2]
        if written.get("type") == "object":
            return f"{kind(words | {'x-unit': own['x-unit']})}, table"
        return f"{kind(words)}, {kind(written | {key: own[key] for key in own if key != 'anyOf'})}"
    bounds = "".join(f", {sign} {own[bound]:g}" for bound, sign in BOUNDS.items() if own.get(bound, 1e10) < 1e10)
    if "x-table" in own:
        return "quantity" if own["x-table"] == "quantity" else "number or table" if "anyOf" in own else "table"
    if own.get("type") == "array":
        inner = _first(own) or own["items"]
        number = {2: "two ", 3: "three "}.get(len(own.get("prefixItems", ())), "")
        return f"list of {number}{kind(inner).partition(',')[0]}s".replace("quantitys", "quantities")
    if "x-unit" in own and own["x-unit"] != "1":
        return f"quantity{bounds}"
    words = {"string": "text", "integer": "integer", "boolean": "true, false", "object": "table"}
    return words.get(own.get("type", ""), "number") + bounds if isinstance(own.get("type"), str) else f"number{bounds}"


def toml(value: Any) -> str:
    """Value as TOML writes it."""
    if isinstance(value, Mapping):
        inner = (
            f"{k if k.isidentifier() else json.dumps(k, ensure_ascii=False)} = {toml(v)}" for k, v in value.items()
        )
        return "{ " + ", ".join(inner) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False)


def model_table(model: Any) -> str:
    """Table of the keys of a model."""
    made = of_model(model)
    return key_table(made["properties"], made.get("required", ()))


def given_by(name: str, names_of: Callable[[Mechanism], Iterable[str]]) -> str:
    """What gives the joint an error or load: empty where each joint has it."""
    if name in names_of(CARDAN):
        return ""
    return next(f"`{key}`" for part, key in GIVEN_BY.items() if name in names_of(MECHANISMS[named(CARDAN, [part])]))


def _own(model: Any, base: Any) -> dict[str, Any]:
    """Keys of a model that the model it is based on does not have."""
    return {key: own for key, own in of_model(model)["properties"].items() if key not in of_model(base)["properties"]}


def sections() -> str:
    """Table of the sections of study and case."""
    lines = ["| section | in a study | in a case | what it says |", "|---|---|---|---|"]
    for name, section in schema.sections().items():
        repeated = section.get("type") == "array"
        header = f"[[{name}]]" if repeated else f"[{name}]"
        state = "needed" if name in schema.REQUIRED else "any number" if repeated else "optional"
        case = state if name in OF_CASE else "–"
        lines.append(f"| `{header}` | {state} | {case} | {section['description']} |")
    return "\n".join(lines)


def joint_tables() -> Iterator[str]:
    """Sections of a joint file."""
    made = schema.joint()
    yield key_table(made["properties"])
    yield from _joint_sections(made, "")


def _joint_sections(made: Mapping[str, Any], before: str) -> Iterator[str]:
    for name, own in made["properties"].items():
        if own.get("type") == "object":
            keys = key_table(own["properties"], own.get("required", ()))
            yield f"### `[{before}{name}]`\n\n{own['description']}\n\n{keys}"
            yield from _joint_sections(own, f"{name}.")


def distributions() -> Iterator[str]:
    """Entries of [tolerances], one after another."""
    of: dict[str, tuple[Any, list[str]]] = {}
    toleranced = toleranced_units(CARDAN)
    for name in toleranced:
        if name.partition(".")[2] in ZONES:
            continue
        for word, model in kinds_of(name).items():
            of.setdefault(word, (model, []))[1].append(name)
    for word, (model, names) in of.items():
        made = of_model(model)
        told = {*BAND, *SingleEntry.model_fields, "distribution"}
        own = {key: v for key, v in made["properties"].items() if key not in told}
        band = [f"`{key}`" for key in BAND if key in made["properties"]]
        text = f"#### `{word}`\n\n{made['description']}"
        if len(names) < len(toleranced) / 2:
            text += f" For {', '.join(f'`{key}`' for key in dict.fromkeys(n.partition('.')[2] for n in names))} only."
        text += f" Band: {', '.join(band)}." if band else ""
        yield text + (f"\n\n{key_table(own, made['required'])}" if own else "")


def zones() -> str:
    """Table of the keys of all zones."""
    made = [of_model(model) for key in ZONES for model in dict.fromkeys(ZONE_KINDS[key].values())]
    own = {key: value for part in made for key, value in part["properties"].items()}
    return key_table(own, made[0]["required"])


def errors() -> str:
    """Table of the names of errors."""
    lines = ["| name | unit | meaning | needs |", "|---|---|---|---|"]
    meanings: dict[tuple[str, str, str], list[str]] = {}
    for field in tables_of(WHOLE).error_fields:
        feature, _, half = field.name.partition(".")
        text = field.description.replace("the pin's", "the").replace("the pin axis", "the axis")
        text = text.replace("the hole's", "the").replace("the hole axis", "the axis")
        meanings.setdefault((half, field.unit, text), []).append(feature)
    for (half, unit, text), features in meanings.items():
        first, last = features[0], features[-1]
        names = f"`{first}.{half}`" + (f" … `{last}.{half}`" if last != first else "")
        needed = given_by(f"{first}.{half}", lambda mechanism: (f.name for f in tables_of(mechanism).error_fields))
        lines.append(f"| {names} | {'' if unit == '1' else unit} | {text} | {needed} |")
    return "\n".join(lines)


def loads() -> str:
    """Table of the loads that can have a limit."""
    lines = ["| load | unit | meaning | needs |", "|---|---|---|---|"]
    for of in kinds(WHOLE).values():
        names = [name for name in units_of_limits(WHOLE) if loads_of(WHOLE)[name].kind == of]
        if not names:
            continue
        text = f"`{names[0]}`" + (f" … `{names[-1]}`" if len(names) > 1 else "")
        needed = ", ".join(dict.fromkeys(filter(None, (given_by(name, loads_of) for name in names))))
        lines.append(f"| {text} | {'' if of.unit == '1' else of.unit} | largest {of.meaning} | {needed} |")
    return "\n".join(lines)


def results() -> str:
    """Sentence with the names of the result columns that can be left out."""
    found: dict[str, list[str]] = {}
    for column in optional_columns(WHOLE):
        found.setdefault(column.field, []).append(column.name)
    return (
        "Columns: "
        + ", ".join(f"`{names[0]}`" + (f" … `{names[-1]}`" if len(names) > 1 else "") for names in found.values())
        + "."
    )


def tables() -> dict[str, str]:
    """Each table of the page, by the name in its comment."""
    made = {name: section.get("items", section) for name, section in schema.sections().items()}
    made |= {"operation": of_model(Operation)}
    with_keys = {name: section for name, section in made.items() if not section.get("patternProperties")}
    found = {name: key_table(made["properties"], made.get("required", ())) for name, made in with_keys.items()}
    entries = {
        "sweep": SweepEntry,
        "range": Range,
        "line": LineEntry,
        "sequence": SequenceEntry,
        "point": StressPointEntry,
        "cost": CostEntry,
        "torque order": TorqueOrder,
        "speed order": SpeedOrder,
        "fit": FitEntry,
        "tube": Tube,
        "spline": SplineOfTubes,
        "member": MemberOf,
        "pair": PairOf,
        "force": ForceOn,
        "drive": Drive,
        "driven point": DrivenPoint,
    }
    return (
        found
        | {name: model_table(model) for name, model in entries.items()}
        | {
            "sections": sections(),
            "points": key_table(_own(PointEntry, Operation), ("name",)),
            "joint file": "\n\n".join(joint_tables()),
            "band": key_table(_own(Banded, SingleEntry)),
            "lot": model_table(LotEntry),
            "distributions": "\n\n".join(distributions()),
            "zones": zones(),
            "error names": errors(),
            "loads": loads(),
            "result names": results(),
        }
    )
