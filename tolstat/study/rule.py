"""Limits and statements on a probability as the command line has them: ``"P(cross*.F > 700 N) < 0.001"``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from tolstat.common.errors import Fault, collected, gather, input_error
from tolstat.common.files import finite
from tolstat.common.loads import ANY_LIMIT, AT, UNIT_OF_LOAD, Limit
from tolstat.common.strict import did_you_mean
from tolstat.study.selection import Entry, quantity, resolve

_STATEMENT = re.compile(r"\s*P\s*\((?P<limit>[^)]*)\)\s*(?P<what>\w*)\s*<\s*(?P<bound>\S+)\s*")
_LIMIT = re.compile(r"\s*(?P<load>[^\s>]+)\s*>\s*(?P<level>.+?)\s*")


class Statement(NamedTuple):
    """Statement that the probability of a load above a limit, or the width of its interval, is below a bound.

    Attributes
    ----------
    text : str
        The statement as written.
    limit : Limit
        The limit.
    bound : float
        Upper bound, between 0 and 1.
    """

    text: str
    limit: Limit
    bound: float


def limit_of(text: str, limits: Mapping[str, float], option: str, example: str) -> Limit:
    """Read a limit.

    Parameters
    ----------
    text : str
        ``"cross1.F > 700 N"``; ``"cross*.F > 700 N"``, any of the loads that the pattern selects; or `ANY_LIMIT`, any
        limit of the study.
    limits : mapping
        Limits of the study, SI.
    option : str
        Option of the command line, shown in faults.
    example : str
        Remedy shown for a text that is not a limit.

    Raises
    ------
    InputError
        With every fault of it.
    """
    if text.split() == ANY_LIMIT.split():
        if not limits:
            raise input_error(option, "the study has no limits", f"add [limits] to it, or {example}")
        return Limit(ANY_LIMIT, tuple(limits), tuple(limits.values()))
    if text.split() == ["all", "limits"]:
        remedy = f'write "{ANY_LIMIT}": a joint counts if it is above at least one'
        raise input_error(option, f"{text.strip()!r} is not a limit", remedy)
    match = _LIMIT.fullmatch(text)
    if match is None and AT in text:
        remedy = "name the load alone: at several operating points the largest counts, with --point that at one of them"
        raise input_error(option, f"{text.strip()!r} names an operating point", remedy)
    if match is None:
        raise input_error(option, f"{text.strip()!r} is not a limit", example)
    entry = Entry(match["load"], (match["load"],), match["level"])
    if not set(entry.pattern) & set("*?[") and entry.pattern not in UNIT_OF_LOAD:
        raise input_error(option, f"{entry.pattern!r} is not a load", did_you_mean(entry.pattern, list(UNIT_OF_LOAD)))
    loads = resolve(entry, UNIT_OF_LOAD, option)
    level = quantity(entry, UNIT_OF_LOAD[loads[0]], option)
    return Limit(entry.pattern, tuple(loads), (level,) * len(loads))


def parse(text: str, what: str, option: str, example: str, limits: Mapping[str, float]) -> Statement:
    """Read a statement.

    Parameters
    ----------
    text : str
        ``"P(LIMIT) < 0.001"``, with a LIMIT as in `limit_of`.
    what : str
        Word before the ``<``; empty for the probability itself.
    limits, option, example
        As in `limit_of`.

    Returns
    -------
    Statement
        The parsed statement.

    Raises
    ------
    InputError
        With every fault of the statement.
    """
    match = _STATEMENT.fullmatch(text)
    if match is None or match["what"] != what:
        raise input_error(option, f"{text!r} is not a rule", example)
    bound = finite(match["bound"])
    with collected() as faults:
        with gather(faults):
            limit = limit_of(match["limit"], limits, option, example)
        if not 0.0 < bound < 1.0:
            faults.append(Fault(option, f"{what} {match['bound']} is not between 0 and 1".strip(), example))
    return Statement(text.strip(), limit, bound)
