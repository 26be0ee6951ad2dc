"""Provenance of results: versions of the software that computed them, and the commit of the code."""

from __future__ import annotations

import hashlib
import platform
import subprocess
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path

import tolstat

LIBRARIES = ("numpy", "numba", "scipy", "h5py")
RESULT_SOURCES = (
    *("kernel", "joint", "common/fields.py", "common/parameters.py", "common/tables.py", "sampling.py"),
    *("study/tolerances", "study/axes.py", "study/design.py", "study/proposal.py", "analysis/process.py"),
    *("solver/simulation.py", "solver/refinement.py", "solver/stationary.py", "solver/rainflow.py"),
)
"""Sources that, together with the study's identity, determine the results of a campaign."""


def versions() -> dict[str, str]:
    """Versions of tolstat, of Python and of the libraries that affect results, and `source_hash`."""
    own_versions = {"tolstat": tolstat.__version__, "sources": source_hash(), "python": platform.python_version()}
    return own_versions | {name: metadata.version(name) for name in LIBRARIES}


def differing(held: Mapping[str, str], other: Mapping[str, str], here: str, there: str) -> list[str]:
    """Compare two records of `versions`: ``"numpy: 2.1.0 in the file, 2.2.0 now"`` for each of `other` that differs."""
    return [
        f"{name}: {held.get(name, 'unknown')} {here}, {own} {there}"
        for name, own in other.items()
        if held.get(name) != own
    ]


def differing_code(held: Mapping[str, str]) -> list[str]:
    """Compare the code that began a file with that of now: only equal code adds joints to a file."""
    return differing(held, {"tolstat": tolstat.__version__, "sources": source_hash()}, "in the file", "now")


def source_hash() -> str:
    """Hash of the sources that determine results: during development, code changes without a new version number."""
    package = Path(tolstat.__file__).parent
    digest = hashlib.sha256()
    for name in RESULT_SOURCES:
        source = package / name
        for path in sorted(source.rglob("*.py")) if source.is_dir() else [source]:
            digest.update(path.relative_to(package).as_posix().encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


def git_commit() -> str:
    """Git commit of the checkout that the package was installed from or runs in, with ``-dirty`` if files differ.

    Returns
    -------
    str
        Empty when the package is not at the top of a git checkout: a virtual environment may lie inside the
        repository of another project, whose commit does not describe this code.
    """
    package = Path(tolstat.__file__).resolve().parent
    recorded = package / "_commit.txt"
    if recorded.is_file():  # written when a wheel is built from a checkout
        return recorded.read_text(encoding="ascii").strip()
    root = package.parent
    top = _git(root, "rev-parse", "--show-toplevel")
    if not top or Path(top).resolve() != root:
        return ""
    return _git(root, "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*")


def _git(folder: Path, *arguments: str) -> str:
    command = ["git", "-C", str(folder), *arguments]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=10).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""
