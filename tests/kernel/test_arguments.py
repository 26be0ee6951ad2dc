"""Every argument of a kernel with four or more is described: by the function, its file, or a folder above it."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.environment import ROOT

KERNEL = ROOT / "tolstat" / "kernel"
FILES = [path for path in sorted(KERNEL.rglob("*.py")) if path.parent.name != "simd"]  # Numba decides those arguments


def described(text: ast.AST) -> set[str]:
    """Names that a docstring describes: entries of a numpydoc list, names in backticks, arguments of what it builds."""
    doc = (isinstance(text, ast.FunctionDef | ast.Module) and ast.get_docstring(text)) or ""
    entries = re.findall(r"^([A-Za-z][\w, ]*?)(?: : .*)?$", doc, flags=re.MULTILINE)
    built = re.findall(r"function \(([^)]*)\)", doc)
    return {name for line in entries + built for name in re.split(r", *", line)} | set(re.findall(r"`(\w+)`", doc))


def undescribed(tree: ast.AST, known: set[str]) -> Iterator[str]:
    """Functions with arguments that neither they nor what is around them describe."""
    for node in ast.iter_child_nodes(tree):
        inside = known | described(node)
        if isinstance(node, ast.FunctionDef):
            names = [argument.arg for argument in node.args.args]
            missing = [name for name in names if name not in inside]
            if missing and len(names) >= 4 and "builder" not in names:  # LLVM's, in functions that generate code
                yield f"{node.name}: {', '.join(missing)}"
        yield from undescribed(node, inside)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.relative_to(KERNEL).as_posix())
def test_arguments_are_described(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    known = described(tree)
    for folder in path.parents:
        if KERNEL in (folder, *folder.parents):
            known |= described(ast.parse((folder / "__init__.py").read_text(encoding="utf-8")))
    assert list(undescribed(tree, known)) == []


def test_one_without_a_word_is_found() -> None:
    tree = ast.parse('def step(t, h, odd, out):\n    """A step of `h` (s)."""')
    assert list(undescribed(tree, {"t", "out"})) == ["step: odd"]
