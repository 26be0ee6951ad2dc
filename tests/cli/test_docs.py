"""``tolstat docs``: pages of the documents, and the commands that build their site."""

from __future__ import annotations

import re
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.environment import ROOT
from tolstat import cli

own = import_module("tolstat.cli.docs")


def test_the_commands_that_build_the_site_are_those_of_its_script() -> None:
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    page = (ROOT / "docs" / "terminal.md").read_text(encoding="utf-8")
    install, build = page.partition("```sh\n")[2].partition("\n```")[0].splitlines()[-2:]
    for command in (install.partition("pip install")[2], "-c docs . build/docs"):
        assert command in script
    assert build.endswith("-c docs . build/docs")
    first = re.search(r"`build/docs/(.+)\.html`", page)
    assert first is not None
    assert f'root_doc = "{first[1]}"' in (ROOT / "docs" / "conf.py").read_text(encoding="utf-8")


def test_without_a_page_the_names_of_all_are_printed() -> None:
    done = CliRunner().invoke(cli.app, ["docs"])
    assert done.exit_code == 0
    lines = done.stdout.splitlines()
    assert max(map(len, lines)) <= 80
    titles = dict(line.split(maxsplit=1) for line in lines if not line.startswith(" "))
    assert {"study", "tolerances", "causes", "bearing-life"} <= titles.keys()
    assert titles["tutorial"] == "Your own drive shaft"
    assert "next: tolstat docs study" in done.stderr


@pytest.mark.parametrize("name", ["study", "study.md", "bearing_life", "bearing-life"])
def test_a_page_is_printed(name: str) -> None:
    done = CliRunner().invoke(cli.app, ["docs", name])
    assert (done.exit_code, done.stderr) == (0, "")
    assert done.stdout.rstrip("\n") == own.pages()[own.page_name(name)].read_text(encoding="utf-8").rstrip("\n")
    assert done.stdout.startswith("# ")


def test_a_page_has_no_settings_of_the_site() -> None:
    shown = CliRunner().invoke(cli.app, ["docs", "tutorial"]).stdout
    assert shown.startswith("# Your own drive shaft")
    assert "tolstat new truck --shaft --size" in shown
    assert not re.search(r"code-cell|:tags:|IPython|subprocess", shown)


def test_an_unknown_page_is_refused() -> None:
    done = CliRunner().invoke(cli.app, ["docs", "studi"])
    assert done.exit_code == 2
    assert "did you mean 'study'?" in done.stderr


def test_the_wheel_has_the_pages_that_users_need() -> None:
    """And every page that a help page or an input file of the package names."""
    included = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    included = included["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    held = {source: target for source, target in included.items() if source.startswith("docs/")}
    assert all(target == f"tolstat/{source}" and (ROOT / source).exists() for source, target in held.items())
    names = {Path(source).stem.replace("_", "-") for source in held} | {
        file.stem.replace("_", "-") for file in (ROOT / "docs" / "questions").glob("*.md")
    }
    named = set()
    for folder, kinds in (("tolstat", ("*.py", "*.toml")), ("data", ("*.toml",))):
        for file in (file for kind in kinds for file in (ROOT / folder).rglob(kind)):
            named |= set(re.findall(r"tolstat docs ([a-z][a-z-]+)", file.read_text(encoding="utf-8")))
    assert {"study", "causes", "tutorial"} <= names
    assert named <= names
