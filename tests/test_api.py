"""The names of the package: each is there, documented, no module in its place; examples in docstrings and studies."""

import doctest
import importlib
import inspect
import re
from importlib.util import find_spec
from pathlib import Path

import pytest

import tolstat
from tests.questions.test_causes import TEXT, made
from tests.support import synthetic

ROOT = Path(__file__).parent.parent
TWO = synthetic.STUDY.replace("n = 60", "n = 12000").replace(
    '"pin*.offset_t" =', '"pin4.tilt_t" = { plus_minus = "1 deg", distribution = "uniform" }\n"pin[12].offset_t" ='
)
"""Two pins whose offsets make the load, and a tilt that does not."""
ON_ARRAYS = sorted(
    path.stem for path in (ROOT / "tolstat" / "analysis").glob("*.py") if ">>> " in path.read_text("utf-8")
)


def test_names_are_documented_functions_and_no_modules():
    pages = [ROOT / "docs" / "python.md", *(ROOT / "docs" / "questions").glob("*.md")]
    listed = {name for page in pages for name in re.findall(r"(?:`|tolstat\.)(\w+)\b", page.read_text("utf-8"))}
    for name in tolstat.__all__:
        value = getattr(tolstat, name)
        assert value == getattr(tolstat, name)
        assert inspect.getdoc(value), name
        assert find_spec(f"tolstat.{name}") is None, f"the module {name} takes the place of the function"
        assert name in listed or (inspect.isclass(value) and issubclass(value, Exception)), name
    with pytest.raises(AttributeError, match="no attribute"):
        _ = tolstat.nothing


def test_signatures_are_those_of_the_public_names():
    assert set(dir(tolstat)) == {*tolstat.__all__, "__version__"}
    for name in tolstat.__all__:
        value = getattr(tolstat, name)
        if inspect.isclass(value):
            continue
        assert value.__name__ == name
        parameters = inspect.signature(value).parameters.values()
        several = [p.name for p in parameters if p.kind in (p.VAR_POSITIONAL, p.VAR_KEYWORD)]
        assert several in ([], ["views"]), name
        assert all(p.annotation is not p.empty for p in parameters), name


@pytest.mark.parametrize("module", ON_ARRAYS)
def test_examples_on_arrays(module):
    failed, attempted = doctest.testmod(importlib.import_module(f"tolstat.analysis.{module}"))
    assert (failed, attempted > 0) == (0, True)


@pytest.fixture(scope="module")
def examples(tmp_path_factory):
    """Result files that the examples of each module are about."""
    folder = tmp_path_factory.mktemp("api")
    known, fewer = made(folder, TEXT.replace("3000", "600")), made(folder, TEXT.replace("3000", "500"), "fewer")
    return {
        "report.answer": {"path": known},
        "questions.compare": {"path": known, "other": fewer},
        "questions.causes.errors": {"path": known},
    }


@pytest.mark.parametrize(
    "module",
    [
        "questions.compare",
        "questions.causes.errors",
        "report.answer",
    ],
)
def test_examples_on_files(module, examples):
    # import_module, as a name of the package may be a function
    found = doctest.testmod(
        importlib.import_module(f"tolstat.{module}"), extraglobs={"tolstat": tolstat, **examples[module]}
    )
    assert (found.failed, found.attempted > 0) == (0, True)
