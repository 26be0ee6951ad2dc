"""Imports when first used: modules that few commands need or that import slowly, and names of a package."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any


class Late:
    """A module that is imported when one of its attributes, or modules, is read."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        if attribute.startswith("__"):  # which doctest and inspect ask any object for
            raise AttributeError(attribute)
        module = import_module(self._name)
        return getattr(module, attribute) if hasattr(module, attribute) else import_module(f"{self._name}.{attribute}")


def names(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package (PEP 562) whose names are imported from their modules when first used."""

    def find(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(homes[name]), name)

    return find


if TYPE_CHECKING:
    import filelock as filelock
    import pandas as pandas
    import psutil as psutil
    import tomlkit as tomlkit
    import tomlkit.exceptions
    import tomlkit.items
    from scipy import integrate as integrate
    from scipy import interpolate as interpolate
    from scipy import optimize as optimize
    from scipy import special as special
    from scipy import stats as stats
else:
    filelock, pandas, psutil, tomlkit = map(Late, ("filelock", "pandas", "psutil", "tomlkit"))
    modules = ("integrate", "interpolate", "optimize", "special", "stats")
    integrate, interpolate, optimize, special, stats = (Late(f"scipy.{name}") for name in modules)
