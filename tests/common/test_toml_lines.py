"""Lines of faults: every key path of a TOML file is found at the line that holds it, however it is written."""

from __future__ import annotations

import itertools
import random
import tomllib
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.environment import ROOT
from tolstat.common.errors import Fault, InputError
from tolstat.common.strict import read_toml, with_lines
from tolstat.common.toml_lines import of_keys

TEXT = """\
[joint]
base = "b"
contact.D_P = "76 mm"  # [not a header]

[tolerances]
"pin[12].offset_t" = { plus_minus = "0.1 mm", "a.b" = {c = 1} }
pin1 . tilt_t . cpk = 1

[[correlation]]
between = [
  "x",  # , "y"
  { deep = [1, [
    2]] },
]
[[correlation]]
note = '''
[sampling]
n = 3
'''
[correlation.inner]
rho = 0.5
[[correlation.inner.list]]
k = 1
[[correlation.inner.list]]
[sampling.deep.table]
n = 4
"""


def test_each_kind_of_key_has_its_line() -> None:
    lines = of_keys(TEXT)
    expected = {
        ("joint",): 1,
        ("joint", "contact"): 3,
        ("joint", "contact", "D_P"): 3,
        ("tolerances", "pin[12].offset_t", "a.b", "c"): 6,
        ("tolerances", "pin1", "tilt_t", "cpk"): 7,
        ("correlation",): 9,
        ("correlation", 0): 9,
        ("correlation", 0, "between"): 10,
        ("correlation", 0, "between", 0): 11,
        ("correlation", 0, "between", 1, "deep", 1): 12,
        ("correlation", 0, "between", 1, "deep", 1, 0): 13,
        ("correlation", 1): 15,
        ("correlation", 1, "note"): 16,
        ("correlation", 1, "inner"): 20,
        ("correlation", 1, "inner", "list", 0, "k"): 23,
        ("correlation", 1, "inner", "list", 1): 24,
        ("sampling",): 25,
        ("sampling", "deep", "table", "n"): 26,
    }
    assert {path: lines.get(path) for path in expected} == expected


def test_a_long_list_is_not_read_again_at_each_line(monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []
    loads = tomllib.loads

    def counted(text: str) -> dict:
        read.append(len(text))
        return loads(text)

    monkeypatch.setattr(tomllib, "loads", counted)
    text = "rows = [\n" + "".join(f"  {{ n = {k} }},\n" for k in range(500)) + "]\n"
    lines = of_keys(text)
    assert [lines["rows", k, "n"] for k in (0, 250, 499)] == [2, 252, 501]
    assert sum(read) < 3 * len(text)


def test_a_fault_has_the_line_of_its_key_or_of_the_table_around_it_and_faults_are_sorted_by_it() -> None:
    places = {
        "b.toml: joint": "b.toml: joint",
        "a.toml": "a.toml",
        "a.toml: tolerances.pin[12].offset_t.plus_minus": "a.toml:6: tolerances.pin[12].offset_t.plus_minus",
        "a.toml: tolerances.pin1.tilt_t.distribution": "a.toml:7: tolerances.pin1.tilt_t.distribution",
        "a.toml: correlation[0].between[1].deep[7]": "a.toml:12: correlation[0].between[1].deep[7]",
        "a.toml: correlation[1].inner.list[1].k": "a.toml:24: correlation[1].inner.list[1].k",
        "a.toml: limits.psi": "a.toml: limits.psi",
        "a.toml: joints": "a.toml: joints",
    }
    named = ["b.toml: joint", "a.toml", "a.toml: limits.psi", "a.toml: joints"]  # without line, they keep their order
    faults = [Fault(place, "found", "remedy") for place in (*(p for p in reversed(places) if p not in named), *named)]
    assert [fault.place for fault in with_lines(faults, "a.toml", TEXT)] == list(places.values())


def paths_of(data: object, path: tuple[str | int, ...] = ()) -> set[tuple[str | int, ...]]:
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    return {p for key, value in items for p in ((*path, key), *paths_of(value, (*path, key)))}


FILES = sorted([*(ROOT / "studies").rglob("*.toml"), *(ROOT / "data").rglob("*.toml"), ROOT / "pyproject.toml"])


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_every_key_of_the_files_of_the_repository_is_at_its_line(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    lines = of_keys(text)
    assert set(lines) == paths_of(tomllib.loads(text))
    for found, line in lines.items():
        if isinstance(found[-1], str):
            assert found[-1] in text.splitlines()[line - 1]


KEYS = {
    "a": "a",
    "b-c": "b-c",
    '"q.r"': "q.r",
    "'x[0]'": "x[0]",
    '"e\\"s"': 'e"s',
    '"= #"': "= #",
    "'[t]'": "[t]",
    '""': "",
    '"\\u00fc"': "ü",
    "1": "1",
}
VALUES = (
    *(
        "{n}",
        '"v{n}"',
        "'v{n} # ['",
        '"v{n} \\" ]"',
        '"""v{n} # ]\n\\""" a = 1\n""""',
        "'''v{n}'''",
        "'''v{n}\n[b]\n'''",
    ),
    *("1979-05-27 07:32:00.{n}", "0.{n}e+1", "[{n},\n # ]\n '{{', [ ], \n]", "[\n\n[{n}], {n}]", "{{ }} # {n}"),
)
"""How a value with the number n is written; n stands on the line of the key or behind a bracket."""
TREES = st.recursive(
    st.sampled_from(VALUES),
    lambda inner: (
        st.dictionaries(st.sampled_from(sorted(KEYS)), inner, min_size=1, max_size=4)
        | st.lists(st.dictionaries(st.sampled_from(sorted(KEYS)), inner, max_size=3), min_size=1, max_size=3)
    ),
    max_leaves=12,
)


class Writer:
    """Writes a tree in one of the ways of TOML, chosen by chance; `held`: line of each key path."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.count = itertools.count(100)
        self.lines: list[str] = []
        self.held: dict[tuple[str | int, ...], int] = {}

    def table(self, tree: dict, keys: tuple[str, ...], path: tuple[str | int, ...]) -> None:
        later = []
        for key, value in tree.items():
            if isinstance(value, str) or (isinstance(value, dict) and self.chance.random() < 0.4):
                self.pair(key, value, path)
            else:
                later.append((key, value))
        for key, value in later:
            at, below = (*path, KEYS[key]), (*keys, key)
            header = self.chance.choice([".", " . "]).join(below)
            if isinstance(value, dict):
                self.lines += [*[""] * self.chance.randrange(2), f"  [{header}]  # [comment]"]
                self.held[at] = len(self.lines)
                self.table(value, below, at)
                continue
            for number, item in enumerate(value):
                self.lines.append(f"[[ {header} ]]")
                self.held.setdefault(at, len(self.lines))
                self.held[(*at, number)] = len(self.lines)
                self.table(item, below, (*at, number))

    def pair(self, key: str, value: object, path: tuple[str | int, ...]) -> None:
        """One key in one line or more, with dots where its table has one key only."""
        at, written, line = (*path, KEYS[key]), key, len(self.lines) + 1
        self.held[at] = line
        while isinstance(value, dict) and len(value) == 1 and self.chance.random() < 0.7:
            ((key, value),) = value.items()
            at, written = (*at, KEYS[key]), f"{written} .{key}"
            self.held[at] = line
        text = self.value(value, at, line)
        self.lines += f"{written}{self.chance.choice(['=', ' = '])}{text}".split("\n")

    def value(self, value: object, at: tuple[str | int, ...], line: int) -> str:
        if isinstance(value, str):
            return value.format(n=next(self.count))
        items = value.items() if isinstance(value, dict) else ()
        parts = []
        for key, inner in items:
            self.held[(*at, KEYS[key])] = line
            plain = inner if not isinstance(inner, str) else "{n}"
            parts.append(f"{key} = {self.value(plain, (*at, KEYS[key]), line)}")
        if isinstance(value, list):
            for number, item in enumerate(value):
                self.held[(*at, number)] = line
                parts.append(self.value(item, (*at, number), line))
            return f"[{', '.join(parts)}]"
        return f"{{ {', '.join(parts)} }}"


@settings(max_examples=150, deadline=None)
@given(tree=st.dictionaries(st.sampled_from(sorted(KEYS)), TREES, max_size=5), seed=st.integers(0, 10**6))
@pytest.mark.slow
def test_every_key_of_an_odd_file_is_at_its_line(tree: dict, seed: int) -> None:
    writer = Writer(seed)
    writer.table(tree, (), ())
    text = "\n".join(writer.lines) + "\n" * (seed % 2)
    lines = of_keys(text)
    assert set(lines) == paths_of(tomllib.loads(text)), text
    assert {path: lines[path] for path in writer.held} == writer.held, text
    assert of_keys(text.replace("\n", "\r\n")) == lines


@pytest.mark.parametrize(
    ("text", "line", "remedy"),
    [
        ("[a]\nspeed = 1200 rpm # fast\n", 2, 'write the value in quotes: speed = "1200 rpm"'),
        ('[a]\n\npin*.offset_t = "0.1 mm"', 3, 'write the name in quotes: "pin*.offset_t" = "0.1 mm"'),
        ("a = 1\nb = 2\na = 3\n", 3, "remove one of the two"),
        ("[a]\n[a]\n", 2, "remove one of the two"),
        ("a = { b = 1,\n c = 2 }\n", 1, "write a table in { } on one line"),
        ('a = "b\nc = 1', 1, "close the quotes on the same line"),
        ("a = 1\nb = [1,\n\n", 3, "close what is open"),
        ("a = 1\n[joint\n", 2, "correct the syntax there"),
        ("a =", 1, "correct"),
    ],
)
def test_a_syntax_error_names_its_line_and_a_remedy(text: str, line: int, remedy: str) -> None:
    with pytest.raises(InputError) as caught:
        read_toml(Path("a.toml"), text)
    (fault,) = caught.value.faults
    assert fault.place == f"a.toml:{line}"
    assert remedy in fault.remedy
    assert "(at " not in fault.found
