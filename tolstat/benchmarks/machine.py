"""The machine and the packages that a measurement was made with."""

from __future__ import annotations

import platform
from importlib.metadata import PackageNotFoundError, version

PACKAGES = ("tolstat", "numba", "numpy", "scipy", "scikit-sundae", "exudyn")


def machine() -> dict[str, str]:
    """Processor, operating system and `versions`."""
    from llvmlite.binding import get_host_cpu_name

    system = f"{platform.system()} {platform.machine()}"
    return {"processor": get_host_cpu_name(), "system": system, **versions()}


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that compute, as far as they are installed."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def text(facts: dict[str, str]) -> str:
    """Names and values in one line."""
    return ", ".join(f"{name} {value}" for name, value in facts.items())
