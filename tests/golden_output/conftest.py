"""Fixture that compares what commands say with golden files."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.golden_output import compare
from tests.golden_output.catalogue import MADE, Campaign, cases
from tests.golden_output.transcript import studies, transcript

GOLDEN = Path(__file__).parent.parent / "golden" / "output"

Check = Callable[[Campaign, str], str]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give the test of `same` a case for each golden file of the campaigns of its module."""
    if "campaign" in metafunc.fixturenames:
        metafunc.parametrize(("campaign", "name"), cases(*metafunc.module.CAMPAIGNS))


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Campaign], tuple[Path, str]]:
    """Folder of a campaign, made when first asked for, and what making it said."""
    found: dict[str, tuple[Path, str]] = {}
    begun: set[str] = set()

    def folder_of(campaign: Campaign) -> tuple[Path, str]:
        if campaign.name not in found:
            if campaign.name in begun:
                pytest.fail(f"{campaign.name}: making it failed before", pytrace=False)
            begun.add(campaign.name)
            folder = studies(tmp_path_factory.mktemp("golden") / "work")
            found[campaign.name] = folder, transcript(folder, campaign.make)
        return found[campaign.name]

    return folder_of


@pytest.fixture
def check(
    made: Callable[[Campaign], tuple[Path, str]],
    tmp_path: Path,
    request: pytest.FixtureRequest,
) -> Check:
    """Run the commands of a campaign that have one golden file: gives how their output differs, or writes the file."""
    updating = bool(request.config.getoption("--update-golden"))

    def run(campaign: Campaign, name: str) -> str:
        folder, text = made(campaign)
        if name != MADE:
            work = Path(shutil.copytree(folder, tmp_path / "work"))
            text = transcript(work, campaign.asked[name])
        path = GOLDEN / campaign.name / f"{name}.txt"
        found = compare.difference(path, f"{campaign.name}/{name}.txt", text)
        if found and updating:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8", newline="\n")
            return ""
        return found

    return run
