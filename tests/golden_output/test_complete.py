"""Golden files are those of the catalogue, about every command and every study; differences are found."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.golden_output import catalogue, catalogue_decisions, catalogue_studies, compare, numbers
from tests.golden_output.catalogue import MADE, Campaign
from tests.golden_output.conftest import GOLDEN
from tests.support.environment import ROOT
from tolstat.cli import app

TEXTS = {str(path.relative_to(GOLDEN)): path.read_text(encoding="utf-8") for path in sorted(GOLDEN.rglob("*.txt"))}
RUNS = [line for text in TEXTS.values() for line in text.splitlines() if line.startswith("$ tolstat ")]
NO_STUDIES = {"precision"}
"""Files of studies/ that no command here takes."""


def test_each_set_of_commands_has_one_golden_file_and_no_file_is_left_over() -> None:
    modules = (catalogue, catalogue_studies, catalogue_decisions)
    campaigns = [item for module in modules for item in vars(module).values() if isinstance(item, Campaign)]
    assert {f"{campaign.name}/{name}.txt" for campaign in campaigns for name in (MADE, *campaign.asked)} == set(TEXTS)


def test_every_command_is_shown_with_success_and_with_help() -> None:
    listed = re.findall(r"^  ([a-z][a-z-]+) {3,}[A-Z]", CliRunner().invoke(app, ["--help"]).stdout, flags=re.MULTILINE)
    commands = [word for word in listed if word not in {"bench", "cache"}]
    assert {"status", "causes", "export"} <= set(commands)
    everything = "\n".join(TEXTS.values())
    for word in commands:
        assert f"$ tolstat {word} --help\n" in everything
        assert re.search(rf"^\$ tolstat {word} (?!--help).*\nexit code 0$", everything, flags=re.MULTILINE), word


def test_every_study_is_run() -> None:
    names = {path.stem for path in (ROOT / "studies").glob("*.toml")} - NO_STUDIES
    assert {name for name in names if not any(f" {name}.toml" in line for line in RUNS)} == set()


def test_each_command_has_an_exit_code_and_an_output() -> None:
    for name, text in TEXTS.items():
        for block in text.split("$ tolstat ")[1:]:
            _, code, head, *shown = block.splitlines()
            assert re.fullmatch(r"exit code \d+", code), name
            assert head.startswith("== std"), name
            assert any(shown), name


def test_rough_numbers_may_have_other_digits_and_widths() -> None:
    assert numbers.same_line("psi_3x  7.268e-06   0.689", "psi_3x   7.26e-06   0.689", numbers.ROUGH)
    assert not numbers.same_line("psi_3x  7.268e-04", "psi_3x  8.268e-04", numbers.ROUGH)


@pytest.mark.parametrize(
    ("golden", "now", "same"),
    [
        ("cross1.F: 635.000001 N", "cross1.F: 635.000002 N", True),
        ("cross1.F: 635.01 N", "cross1.F: 635.02 N", False),
        ("cross1.F: 635.0 N", "cross2.F: 635.0 N", False),
        ("3 of 64", "4 of 64", False),
        ("above 3000000", "above 3000001", False),
        ("1.0e-08", "1.1e-08", False),
        ("[inf, nan]", "[inf, nan]", True),
        ("[inf, 2.0]", "[1.0, 2.0]", False),
    ],
)
def test_numbers_differ_beyond_the_tolerance_only(golden: str, now: str, same: bool) -> None:
    assert numbers.same_line(golden, now) is same


def test_a_difference_names_file_command_and_lines(tmp_path: Path) -> None:
    golden = "$ tolstat status a.h5\nexit code 0\n== stdout\nok: 3.0\n== a.csv, numbers\n1.0\n"
    path = tmp_path / "a.txt"
    assert "no golden file" in compare.difference(path, "a", golden)
    path.write_text(golden, encoding="utf-8")
    assert compare.difference(path, "a", golden) == ""
    assert compare.difference(path, "a", golden.replace("1.0", "1.0000001")) == ""
    found = compare.difference(path, "a", golden.replace("3.0", "3.0000001"))
    assert "under: $ tolstat status a.h5" in found
    assert "-ok: 3.0\n+ok: 3.0000001" in found
