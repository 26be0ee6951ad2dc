"""``tolstat docs``: the built pages, the commands that build them, or where they are."""

from __future__ import annotations

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
    assert (done.exit_code, done.stdout) == (0, "")
    assert "folder docs/ of the repository" in done.stderr
