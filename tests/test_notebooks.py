"""Notebooks run without a front end, and find what their text says."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest

from tests.support.environment import ROOT

pytestmark = pytest.mark.slow


def run(name: str, folder: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Run the cells of a notebook in a folder; returns its names."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr(plt, "show", lambda: plt.close("all"))
    names: dict[str, Any] = {"__name__": "__main__"}
    for cell in json.loads((ROOT / "docs" / "notebooks" / name).read_text(encoding="utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    return names


@pytest.fixture(scope="module")
def what_if(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Names of the notebook with sliders."""
    with pytest.MonkeyPatch.context() as patch:
        yield run("what_if.ipynb", tmp_path_factory.mktemp("what_if"), patch)


def test_a_change_has_the_shares_of_a_campaign_of_the_changed_study(what_if: dict[str, Any]) -> None:
    ours, fresh = what_if["own"]["after"], what_if["run"]["estimate"]
    assert (fresh == ours[fresh.index]).all()
    share = what_if["share"]
    assert share[0] < share[-1]


def test_an_answer_shows_itself(what_if: dict[str, Any]) -> None:
    assert "Share of the joints above each limit, before and after" in what_if["narrow"]._repr_html_()
    assert "512 joints" in what_if["study"]._repr_html_()


def test_sliders_call_the_function(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A slider that moves calls it with the new value, and shows its answer."""
    widgets = pytest.importorskip("ipywidgets", reason="pip install .[notebook]")
    cells = json.loads((ROOT / "docs" / "notebooks" / "what_if.ipynb").read_text(encoding="utf-8"))["cells"]
    (code,) = ("".join(cell["source"]) for cell in cells if "interact(" in "".join(cell["source"]))
    _, _, sliders = code.partition("\n\n\n")
    asked = []

    def what_if(pin: float, hole: float) -> None:
        asked.append((pin, hole))

    exec(sliders, {"what_if": what_if})
    pin, hole, _ = what_if.widget.children  # type: ignore[attr-defined]
    assert isinstance(pin, widgets.FloatSlider)
    pin.value, hole.value = 0.3, 0.6
    assert asked == [(0.45, 0.45), (0.3, 0.45), (0.3, 0.6)]


def test_other_tools_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Subset simulations within a factor of three, tilts as the cause in both, FORM from the middle without a point."""
    pytest.importorskip("openturns", reason="pip install .[oracles]")
    pytest.importorskip("SALib", reason="pip install .[oracles]")
    names = run("other_tools.ipynb", tmp_path, monkeypatch)
    theirs, ours, middle, above = names["opinions"]["P(cross1.F > 3 kN)"]
    assert ours / 3 < theirs < 3 * ours
    assert math.isnan(middle)
    assert above < ours / 2
    for key in ("in_all", "SALib ST"):
        assert set(names["table"][key].nlargest(2).index) == {"pin*.tilt_[tz]", "hole*.tilt_[tz]"}
