"""Where numbers come from: versions of what computed them, and the commit of the code."""

from __future__ import annotations

import platform
import subprocess
from importlib import metadata
from pathlib import Path

import tolstat

LIBRARIES = ("numpy", "numba", "scipy", "h5py")


def versions() -> dict[str, str]:
    """Versions of tolstat, of Python and of the libraries that take part in the numbers."""
    found = {"tolstat": tolstat.__version__, "python": platform.python_version()}
    return found | {name: metadata.version(name) for name in LIBRARIES}


def git_commit() -> str:
    """Commit of the checkout that the package was installed or is run from, ``-dirty`` after it if files differ.

    Returns
    -------
    str
        Empty when the package is not the top of a git checkout: an environment may lie inside the repository
        of something else, whose commit says nothing about this code.
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
