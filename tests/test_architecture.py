"""Documents that name files: every one is there, and has the functions, tables or tests named after it."""

from __future__ import annotations

import re

import pytest

from tests.support.environment import ROOT

SOURCES = [path for folder in ("tolstat", "tests", "studies") for path in (ROOT / folder).rglob("*.py")]
BETWEEN = re.compile(r"^(?:[ ,(]|, | and )*$")
"""What may stand between a file and its names."""


def named(text: str) -> list[tuple[str, list[str]]]:
    """Files in the order of the document, each with the names that follow it directly."""
    found: list[tuple[str, list[str]]] = []
    for line in text.splitlines():
        open_list = False
        for before, code in re.findall(r"([^`]*)`([^`]*)`", line):
            if re.fullmatch(r"[\w/]+\.py", code):
                found.append((code, []))
                open_list = True
            elif open_list and BETWEEN.match(before) and re.fullmatch(r"[A-Za-z_][\w.]*", code):
                found[-1][1].append(code.rpartition(".")[2])
            else:
                open_list = False
    return found


@pytest.mark.parametrize(("page", "least"), [("architecture.md", 60), ("reliability.md", 20)])
def test_files_and_names_are_there(page: str, least: int) -> None:
    listed = named((ROOT / "docs" / page).read_text(encoding="utf-8"))
    assert len(listed) > least
    for file, names in listed:
        if "X" in file or file == "__init__.py":
            continue  # to be written, in a recipe
        texts = [path.read_text(encoding="utf-8") for path in SOURCES if path.as_posix().endswith(f"/{file}")]
        assert texts, f"there is no {file}"
        for name in names:
            assert any(re.search(rf"\b{name}\b", text) for text in texts), f"{file} has no {name}"


def test_names_belong_to_the_file_before_them() -> None:
    found = named("in `kernel/a.py` `one`, `two` and `b.py` (`three.four`); then `five`")
    assert found == [("kernel/a.py", ["one", "two"]), ("b.py", ["four"])]
