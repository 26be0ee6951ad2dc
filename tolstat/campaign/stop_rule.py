"""Limits and statements on a probability as the command line has them, and the stop rule, which is one of them.

A stop rule ends a campaign when the interval of an exceedance is narrow enough.

When to look, and with which confidence, is in `analysis.binomial`. The looks depend only on the number of joints of
the campaign, not on workers or time: each evaluates the first joints of the sequence, all of them done. Looks of a
campaign that is extended afterwards stay looks.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic_core import PydanticCustomError

from tolstat.analysis import binomial
from tolstat.campaign.pool import kept_workers
from tolstat.common.columns import holds
from tolstat.common.errors import Fault, InputError, collected, gather, input_error
from tolstat.common.loads import ANY_LIMIT, AT, Limit, load_of, units_of_limits
from tolstat.common.mechanism import Mechanism
from tolstat.common.strict import did_you_mean
from tolstat.common.units import to_si
from tolstat.store import Reader, View, Writer
from tolstat.study import Study
from tolstat.study.selection import Entry, quantity, resolve

CONFIDENCE = 0.95
BIASED = f"biased high if few joints are above ({100 * binomial.BIAS:.0f} % of itself with {binomial.LEAST_BESIDE})"
"""Sentence on the share at a stop."""
EXAMPLE = 'write --until "P(cross1.F > 700 N) width < 0.01"'
_STATEMENT = re.compile(r"\s*P\s*\((?P<limit>[^)]*)\)\s*(?P<what>\w*)\s*<\s*(?P<bound>\S.*?)\s*")
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


class Look(NamedTuple):
    """Result of a look at the first joints.

    Attributes
    ----------
    joints : int
        Number of joints evaluated, without the nominal joint.
    n_unresolved : int
        Joints among them that failed or did not settle: counted as below the level for the lower end of the interval
        and as above it for the upper end.
    above : int
        Valid joints above the level.
    estimate : float
        Share of the valid joints above the level. At a stop with few of them it is biased high.
    lower, upper : float
        Interval with the confidence of one look, `binomial.LOOK_CONFIDENCE`.
    """

    joints: int
    n_unresolved: int
    above: int
    estimate: float
    lower: float
    upper: float


class Outcome(NamedTuple):
    """How a campaign with a rule ended.

    Attributes
    ----------
    reached : bool
        Whether the interval is narrow enough; otherwise all joints were simulated.
    look : Look
        The last look.
    looks : list of int
        Numbers of joints of the planned looks.
    """

    reached: bool
    look: Look
    looks: list[int]

    def record(self, rule: Statement) -> dict[str, Any]:
        """Return the attribute ``stop`` of the result file."""
        taken = [joints for joints in self.looks if joints <= self.look.joints]
        how = {"confidence": CONFIDENCE, "confidence_of_a_look": binomial.LOOK_CONFIDENCE, "looks": taken}
        return {"rule": rule.text, "reached": self.reached} | self.look._asdict() | how


def limit_of(text: str, limits: Mapping[str, float], mechanism: Mechanism, option: str, example: str) -> Limit:
    """Read a limit.

    Parameters
    ----------
    text : str
        ``"cross1.F > 700 N"``; ``"cross*.F > 700 N"``, any of the loads that the pattern selects; or `ANY_LIMIT`, any
        limit of the study.
    limits : mapping
        Limits of the study, SI.
    mechanism : Mechanism
        Whose loads they are.
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
        return Limit(ANY_LIMIT, tuple(limits), tuple(limits.values()), mechanism)
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
    unit_of = units_of_limits(mechanism)
    if not set(entry.pattern) & set("*?[") and entry.pattern not in unit_of:
        raise input_error(option, f"{entry.pattern!r} is not a load", did_you_mean(entry.pattern, list(unit_of)))
    loads = resolve(entry, unit_of, option)
    level = quantity(entry, unit_of[loads[0]], option)
    return Limit(entry.pattern, tuple(loads), (level,) * len(loads), mechanism)


def parse(
    text: str,
    limits: Mapping[str, float],
    mechanism: Mechanism,
    what: str = "width",
    option: str = "--until",
    example: str = EXAMPLE,
) -> Statement:
    """Read a stop rule, or another statement.

    Parameters
    ----------
    text : str
        ``"P(LIMIT) width < 0.002"``, or ``< 0.2 %``, with a LIMIT as in `limit_of`.
    limits : mapping
        Limits of the study, SI.
    mechanism : Mechanism
        Whose loads they are.
    what : str
        Word before the ``<``; empty for the probability itself.
    option, example
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
    match, bound = _STATEMENT.fullmatch(text), math.nan
    if match is None or match["what"] != what:
        alone = re.fullmatch(r"\s*(?:<|<=|≤)?\s*([\d.]+\s*%?)\s*", text)
        whole = f'write {option} "{" ".join(filter(None, (f"P({ANY_LIMIT})", what, "<")))} {alone[1]}"' if alone else ""
        raise input_error(option, f"{text!r} is not a rule" + ": it says no limit" * bool(alone), whole or example)
    with suppress(PydanticCustomError):
        bound = to_si(match["bound"], "1")
    with collected() as faults:
        with gather(faults):
            limit = limit_of(match["limit"], limits, mechanism, option, example)
        if not 0.0 < bound < 1.0:
            faults.append(Fault(option, f"{what} {match['bound']} is not between 0 and 1".strip(), example))
    return Statement(text.strip(), limit, bound)


def run_until(study: Study, out: Path, rule: Statement, run: Callable[[int], object]) -> Outcome:
    """Run a campaign until a stop rule is satisfied or all joints are simulated.

    Parameters
    ----------
    study : Study
        The study.
    out : Path
        Its result file. Rows after the stop stay pending, and how it ended is recorded in the file.
    rule : Statement
        Limit, and width of the interval at which to stop; see `parse`.
    run : callable
        Row of the campaign -> simulates all rows below it.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        When the joints are not independent samples, or the study does not keep a load.
    """
    if study.sampling.method != "random":
        found = f"sampling.method is {study.sampling.method!r}: its interval needs independent samples"
        raise input_error("--until", found, 'write sampling.method = "random" in the study')
    if study.sampling.joints_per_lot > 1:
        found = "joints share lots: the interval of a stop needs independent samples"
        raise input_error("--until", found, "remove sampling.joints_per_lot, or --until")
    for load in (load_of(name, study.mechanism) for name in rule.limit.loads):
        if not holds(study.columns, load):
            remedy = f"add {', '.join(load.columns)}"
            raise InputError([study.fault("output.results", f"leaves out {load.name}, which --until needs", remedy)])
    taken: list[int] = []  # looks at the joints of the file so far
    if out.exists():
        with Reader.open(out) as store:
            taken = store.stop.get("looks", [])
    planned, first = binomial.looks(study.samples, taken), study.first_sample
    joints = binomial.next_look(rule.bound, planned)  # looks without a possible stop are not taken
    with kept_workers():
        while True:
            run(first + joints)
            with Reader.open(out) as store:
                look = _look(View(store), rule.limit, joints)
            counts = look.above, look.n_unresolved, joints
            reached = bool(binomial.narrow(rule.bound, *counts))
            if reached or joints == planned[-1]:
                break
            joints = binomial.next_look(rule.bound, planned, *counts)
    outcome = Outcome(reached, look, planned)
    with Writer.open(out) as file:
        file.change(stop=outcome.record(rule))
    return outcome


def _look(view: View, limit: Limit, joints: int) -> Look:
    load = view.load_of(limit).only(np.arange(joints)).above(limit.level)
    unresolved = load.n_failed + load.n_unsettled
    lower, upper = binomial.stop_interval(load.count, unresolved, joints)
    return Look(joints, unresolved, load.count, load.count / max(joints - unresolved, 1), float(lower), float(upper))
