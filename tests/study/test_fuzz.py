"""Files from outside: whatever stands in them is read to finite numbers, or refused with faults that have a remedy."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.support import synthetic
from tests.support.systems import needs_posix
from tolstat import joint, study
from tolstat.common.cardan import CARDAN
from tolstat.common.errors import InputError
from tolstat.study import costs, scaling
from tolstat.study.file import SECTIONS as OF_STUDY

FILES = int(os.environ.get("TOLSTAT_FUZZ", "40"))
"""Files of each kind; the long run has 10000, each time others."""
FUZZ = settings(
    max_examples=FILES, deadline=None, derandomize="TOLSTAT_FUZZ" not in os.environ, database=None, print_blob=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)  # fmt: skip

UNITS = ("mm", "N", "N*m", "deg", "rpm", "um", "%", "", "mm*", "m^-1e9", "__import__('os')", "lambda: 0", "kg/0", "(((")
NAMES = (
    *("pin1.offset_t", "pin*.offset_[etz]", "hole2.diameter", "pin1.position", "cross1.F", "fork*.T", "psi", "pin9.x"),
    *("n", "seed", "method", "base", "contact.clearance", "fit", "steps_per_rev", "fidelity", "alpha", "results", "*"),
    *("plus_minus", "distribution", "cpk", "lower", "upper", "zone", "over", "file", "column", "names", "rho", "[", ""),
)
WORDS = (
    *("normal", "uniform", "measured", "lognormal", "random", "sweep", "cases", "auto"),
    *("cirelli2021", "own", "/dev/zero", "../a.toml", "H7/g6", "f", "\x1b[2J", "\u202e", "nan", "1e999", "a.csv"),
)
SECTIONS = (*OF_STUDY, "joint.contact", "tolerances.pin1", "sampling.n", "output.results", "x")

quantities = st.builds(
    lambda sign, number, blank, unit: f"{sign}{number}{blank}{unit}",
    st.sampled_from(("", "-", "⌀", "±", "+")),
    st.one_of(st.integers(-(10**6), 10**6), st.floats(), st.sampled_from(("1,5", "1e400", "0x1F", "१", "1_0", ""))),
    st.sampled_from((" ", "", "\t", "\u00a0")),
    st.sampled_from(UNITS),
)
scalars = st.one_of(
    st.booleans(),
    st.integers(-(2**63), 2**63 - 1),
    st.floats(),
    quantities,
    st.sampled_from(WORDS),
    st.text(max_size=8),
)
values = st.recursive(
    scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(NAMES), inner, max_size=4)
)
tables = st.dictionaries(st.sampled_from(NAMES), values, max_size=5)


def toml(value: object) -> str:
    """Write a value as TOML."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(key)} = {toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, str):
        return json.dumps(value.encode("utf-8", "ignore").decode(), ensure_ascii=True).replace("\\ud", "\\\\ud")
    return json.dumps(value).replace("Infinity", "inf").replace("NaN", "nan")


def section(name: str, table: dict[str, object], listed: bool) -> str:
    head = f"[[{name}]]" if listed else f"[{name}]"
    return "\n".join([head, *(f"{json.dumps(key)} = {toml(value)}" for key, value in table.items())])


@st.composite
def files(draw: st.DrawFn) -> str:
    """Draw a study some of whose lines are left out, replaced or added."""
    lines = synthetic.STUDY.splitlines()
    for _ in range(draw(st.integers(0, 3))):
        at = draw(st.integers(0, len(lines) - 1))
        key, equals, _ = lines[at].partition("=")
        lines[at] = f"{key}= {toml(draw(values))}" if equals and draw(st.booleans()) else draw(st.text(max_size=20))
    added = draw(st.lists(st.builds(section, st.sampled_from(SECTIONS), tables, st.booleans()), max_size=2))
    return "\n".join([*lines, *added]).encode("utf-8", "ignore").decode()


def check(error: InputError) -> None:
    assert error.faults
    assert all(fault.place and fault.found and fault.remedy for fault in error.faults)


def numbers(value: object) -> Iterator[float]:
    """All numbers of nested tables and lists."""
    if isinstance(value, dict | list | tuple):
        for one in value.values() if isinstance(value, dict) else value:
            yield from numbers(one)
    elif isinstance(value, float):
        yield value


@FUZZ
@given(text=files())
def test_a_study_is_read_or_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.toml"
    path.write_text(text, encoding="utf-8", newline="")
    try:
        read = study.load(path)
    except InputError as error:
        check(error)
    else:
        assert 0 < read.samples <= 10**9
        assert all(map(math.isfinite, numbers([read.joint.model_dump(), read.operation.model_dump(), read.limits])))


@FUZZ
@given(text=files())
def test_a_case_is_read_or_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.toml"
    path.write_text(text.replace("[sampling]", "[errors]").replace("n = 60", ""), encoding="utf-8", newline="")
    try:
        read = study.load_case(path)
    except InputError as error:
        check(error)
    else:
        assert all(map(math.isfinite, numbers([read.joint.model_dump(), read.operation.model_dump(), read.errors])))


@FUZZ
@given(over=tables, key=st.sampled_from(("material", "cross", "fork", "contact", "x")))
def test_a_joint_is_read_or_refused(over: dict[str, object], key: str) -> None:
    try:
        read = joint.load("cirelli2021", {key: over}, "a.toml")
    except InputError as error:
        check(error)
    else:
        assert all(map(math.isfinite, numbers(read.model_dump())))


COLUMNS = st.lists(st.lists(st.one_of(quantities, st.sampled_from(WORDS)), max_size=3), max_size=5)


@FUZZ
@given(rows=COLUMNS, separator=st.sampled_from(",;\t"), mark=st.sampled_from(("", "\ufeff")), head=st.booleans())
def test_measured_errors_are_read_or_refused(
    tmp_path: Path, rows: list[list[str]], separator: str, mark: str, head: bool
) -> None:
    lines = [separator.join(row) for row in [["x", "y"] * head, *rows]]
    (tmp_path / "a.csv").write_text(mark + "\r\n".join(lines), encoding="utf-8", newline="")
    text = synthetic.HEAD + '[tolerances]\npin1.offset_e = { distribution = "measured", file = "a.csv", column = "x", '
    (tmp_path / "a.toml").write_text(text + 'unit = "mm" }\n[sampling]\nn = 9\n', encoding="utf-8")
    try:
        read = study.load(tmp_path / "a.toml")
    except InputError as error:
        check(error)
    else:
        parts = read.tolerances["pin1.offset_e"].values
        assert 0 < len(parts) <= len(rows)
        assert all(map(math.isfinite, parts))


COSTS = st.dictionaries(
    st.sampled_from(("pin1.offset_t", "pin*.offset_t", "pin[23].offset_t", "hole1.diameter", "*", "x")),
    st.dictionaries(
        st.sampled_from(("cost", "fixed", "at", "power", "least", "most", "keep", "x")), scalars, max_size=4
    ),
    max_size=3,
)


@FUZZ
@given(rows=COLUMNS, kind=st.sampled_from(("toml", "csv", "table")), table=COSTS)
def test_costs_are_read_or_refused(tmp_path: Path, rows: list[list[str]], kind: str, table: dict[str, object]) -> None:
    (tmp_path / "a.toml").write_text(synthetic.STUDY, encoding="utf-8")
    tolerances = scaling.tolerances(study.load(tmp_path / "a.toml"))
    path = tmp_path / f"costs.{kind.replace('table', 'csv')}"
    lines = [f"{json.dumps(key)} = {toml(value)}" for key, value in table.items()]
    if kind == "csv":
        lines = ["tolerance,cost,at", *map(",".join, rows)]
    if kind == "table":
        names = tuple(costs.CostEntry.model_fields)
        lines = [",".join(("tolerance", *names))]
        lines += [",".join([key, *(str(entry.get(name, "")) for name in names)]) for key, entry in table.items()]
    path.write_text("\n".join(lines), encoding="utf-8", errors="ignore", newline="")
    try:
        read = costs.of(tolerances, CARDAN, path)
    except InputError as error:
        check(error)
    else:
        assert len(read) == len(tolerances)
        assert all(math.isfinite(cost.at(factor)) for cost in read for factor in cost.reach)


@pytest.mark.parametrize("entry", ['{ cost = 9, at = "1e300 mm", power = 10 }', '{ cost = 1e308, at = "1 mm" }'])
def test_costs_beyond_all_numbers_are_refused(tmp_path: Path, entry: str) -> None:
    (tmp_path / "a.toml").write_text(synthetic.STUDY, encoding="utf-8")
    (tmp_path / "costs.toml").write_text(f'"pin*.offset_t" = {entry}', encoding="utf-8")
    with pytest.raises(InputError, match="costs more than a number can hold") as raised:
        costs.of(scaling.tolerances(study.load(tmp_path / "a.toml")), CARDAN, tmp_path / "costs.toml")
    check(raised.value)


def refused(tmp_path: Path, text: str) -> str:
    path = tmp_path / "a.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        study.load(path)
    check(raised.value)
    return str(raised.value)


@pytest.mark.parametrize("value", ["[" * 10_000 + "]" * 10_000, "{a=" * 10_000 + "1" + "}" * 10_000])
def test_deep_files_are_refused(tmp_path: Path, value: str) -> None:
    text = f"{synthetic.WHOLE}\n[output]\nresults = {value}"
    assert "too many tables and lists inside each other" in refused(tmp_path, text)


@pytest.mark.parametrize(
    "unit", ["x" * 10**6, "(" * 10**5, "m*" * 10**5 + "m", "m**9**9**9**9", "__import__('os')._exit(3)"]
)
def test_no_unit_is_executed_or_takes_long(tmp_path: Path, unit: str) -> None:
    said = refused(tmp_path, synthetic.STUDY.replace("0.1 mm", f"0.1 {unit}"))
    assert len(said) < 2000, "a message quotes no more than the beginning of a long value"


@needs_posix
def test_pipes_and_devices_are_no_input(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.toml")
    for path in (tmp_path / "pipe.toml", Path("/dev/zero")):
        with pytest.raises(InputError, match="is a pipe or a device"):
            study.load(path)
