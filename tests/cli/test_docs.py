"""``tolstat docs``: the built pages, the commands that build them, or where they are."""

from __future__ import annotations

import re
import tomllib
import webbrowser
from importlib import import_module
from pathlib import Path

import pytest
from typer.testing import CliRunner

from tests.support.environment import ROOT
from tolstat import cli

own = import_module("tolstat.cli.docs")


@pytest.fixture
def clone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An invented clone, with a copy of the command in it as the one that runs."""
    for file in ("docs/conf.py", "tolstat/cli/docs.py"):
        (tmp_path / file).parent.mkdir(parents=True)
        (tmp_path / file).touch()
    monkeypatch.setattr(own, "__file__", str(tmp_path / "tolstat" / "cli" / "docs.py"))
    return tmp_path


@pytest.mark.parametrize("browser", [True, False])
def test_the_built_pages_are_opened(clone: Path, monkeypatch: pytest.MonkeyPatch, browser: bool) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda page: opened.append(page) or browser)
    page = clone / own.BUILT
    page.parent.mkdir(parents=True)
    page.touch()
    done = CliRunner().invoke(cli.app, ["docs"])
    assert (done.exit_code, done.stdout) == (0, f"{page}\n")
    assert opened == [page.as_uri()]
    assert ("no browser" in done.stderr) is not browser


def test_pages_that_are_not_built_get_the_commands(clone: Path) -> None:
    done = CliRunner().invoke(cli.app, ["docs"])
    assert (done.exit_code, tuple(done.stdout.splitlines())) == (0, own.BUILD)
    assert str(clone / "docs" / "index.md") in done.stderr


def test_the_commands_are_those_that_the_site_is_built_with() -> None:
    """Extras and folders of the commands stand in the script that builds the site; the first page is the site's."""
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    install, build = own.BUILD
    assert install.partition("pip install")[2] in script
    assert build.partition(" -q ")[2] == script.partition("sphinx-build -q -W --keep-going ")[2].partition(" >")[0]
    settings = (ROOT / "docs" / "conf.py").read_text(encoding="utf-8")
    assert f'root_doc = "{own.BUILT.relative_to("build/docs").with_suffix("")}"' in settings


def test_an_installed_package_finds_the_clone_around_the_current_folder(
    clone: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(own, "__file__", str(tmp_path_factory.mktemp("site") / "tolstat" / "cli" / "docs.py"))
    monkeypatch.chdir(clone / "docs")
    assert CliRunner().invoke(cli.app, ["docs"]).stdout.splitlines() == list(own.BUILD)
    monkeypatch.chdir("/")
    done = CliRunner().invoke(cli.app, ["docs"])
    assert done.exit_code == 0
    titles = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert {"study", "tolerances", "causes", "time-above"} <= titles.keys()
    assert titles["tutorial"] == "Your own joint"
    assert "next: tolstat docs study" in done.stderr


@pytest.mark.parametrize("name", ["study", "study.md", "time_above", "time-above"])
def test_a_page_is_printed(name: str) -> None:
    done = CliRunner().invoke(cli.app, ["docs", name])
    assert (done.exit_code, done.stderr) == (0, "")
    assert done.stdout.rstrip("\n") == own.pages()[own.page_name(name)].read_text(encoding="utf-8").rstrip("\n")
    assert done.stdout.startswith("# ")


def test_a_page_has_no_settings_of_the_site() -> None:
    shown = CliRunner().invoke(cli.app, ["docs", "tutorial"]).stdout
    assert shown.startswith("# Your own joint")
    assert "tolstat new shaft --joint own" in shown
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
