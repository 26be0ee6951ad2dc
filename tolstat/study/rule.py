"""Statements on a probability as they are written on the command line: ``"P(cross1.F > 700 N) < 0.001"``."""

from __future__ import annotations

import math
import re
from contextlib import suppress
from typing import NamedTuple

from tolstat.common.errors import Fault, InputError, gather
from tolstat.common.loads import UNIT_OF_LOAD
from tolstat.common.strict import did_you_mean
from tolstat.study.selection import Entry, quantity, resolve

_STATEMENT = re.compile(
    r"\s*P\s*\(\s*(?P<load>[^\s>]+)\s*>\s*(?P<level>[^)]+?)\s*\)\s*(?P<what>\w*)\s*<\s*(?P<bound>\S+)\s*"
)


class Statement(NamedTuple):
    """Statement that P(load > level), or the width of its interval, is below a bound.

    Attributes
    ----------
    text : str
        The statement as written.
    loads : tuple of str
        Names of the loads that the pattern selects; the statement is on the largest of them.
    level : float
        In SI units.
    bound : float
        Upper bound, between 0 and 1.
    """

    text: str
    loads: tuple[str, ...]
    level: float
    bound: float


def parse(text: str, what: str, option: str, example: str) -> Statement:
    """Read a statement.

    Parameters
    ----------
    text : str
        ``"P(cross*.F > 700 N) < 0.001"``.
    what : str
        Word before the ``<``; empty for the probability itself.
    option : str
        Option of the command line, shown in faults.
    example : str
        Remedy shown for a text that is not a statement.

    Returns
    -------
    Statement
        The parsed statement.

    Raises
    ------
    InputError
        With every fault of the statement.
    """
    found = _STATEMENT.fullmatch(text)
    if found is None or found["what"] != what:
        raise InputError([Fault(option, f"{text!r} is not a rule", example)])
    faults: list[Fault] = []
    loads, level, bound = [], math.nan, math.nan
    entry = Entry(found["load"], (found["load"],), found["level"])
    with gather(faults):
        if not set(entry.pattern) & set("*?[") and entry.pattern not in UNIT_OF_LOAD:
            remedy = did_you_mean(entry.pattern, list(UNIT_OF_LOAD))
            raise InputError([Fault(option, f"{entry.pattern!r} is not a load", remedy)])
        loads = resolve(entry, UNIT_OF_LOAD, option)
        level = quantity(entry, UNIT_OF_LOAD[loads[0]], option)
    with suppress(ValueError):
        bound = float(found["bound"])
    if not 0.0 < bound < 1.0:
        faults.append(Fault(option, f"{what} {found['bound']} is not between 0 and 1".strip(), example))
    if faults:
        raise InputError(faults)
    return Statement(text.strip(), tuple(loads), level, bound)
