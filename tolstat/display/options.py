"""Options of questions: what a type does not say of a keyword argument, and the options that several questions share.

The help of an option is its entry under ``Parameters`` in the docstring of the question.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, NamedTuple


class Opt(NamedTuple):
    """How a keyword argument is written on the command line.

    Attributes
    ----------
    metavar : str
        The word that stands for its value in help.
    least, most : float, optional
        Range of numbers.
    unit : str, optional
        Unit of the value in Python; on the command line it is text with a unit, ``"0.1 %"``, ``"5 min"``.
    name : str
        Name of the option if it is not that of the argument.
    """

    metavar: str = ""
    least: float | None = None
    most: float | None = None
    unit: str | None = None
    name: str = ""


Load = Annotated[str | None, Opt("LOAD")]
Loads = Annotated[list[str] | None, Opt("LOAD")]
Top = Annotated[int, Opt("N", least=1)]
Delivery = Annotated[int, Opt("N", least=1, most=10**9)]
Accepted = Annotated[float, Opt("SHARE", 0.0, 1.0, "1", "accept")]
Workers = Annotated[int | None, Opt("W", least=1)]
Costs = Annotated[Path | None, Opt("TABLE")]
