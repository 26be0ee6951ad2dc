"""Campaigns that stop when an exceedance is known well enough.

Whoever looks at an interval again and again and stops when it pleases has an interval that covers less often than it
says. Here the looks are few, at numbers of joints fixed beforehand, and each interval has the confidence
1 - (1 - confidence) / looks (Bonferroni): the probability that any of them misses is at most 1 - confidence, so the one
that the campaign stops with covers, whenever that is. The looks depend on neither workers nor time, only on the rule
and the number of joints: it is the first joints of the sequence that are looked at, all of them done.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tolstat.analysis import exceedance
from tolstat.common import selected_results as kept
from tolstat.common.errors import Fault, InputError
from tolstat.store import ResultStore
from tolstat.store.reader import BLOCK
from tolstat.store.view import load
from tolstat.study import rule as rules

if TYPE_CHECKING:
    from tolstat.study import Study

CONFIDENCE = 0.95
EXAMPLE = 'write --until "P(cross1.F > 700 N) width < 0.01"'


class Rule(NamedTuple):
    """Stop when the interval of P(load > level) is narrower than `width`.

    Attributes
    ----------
    text : str
        The rule as it was written.
    load : str
        Name of the load, as a limit has it.
    level : float
        In SI units.
    width : float
        Between 0 and 1.
    """

    text: str
    load: str
    level: float
    width: float


class Look(NamedTuple):
    """What a look at the first joints showed.

    Attributes
    ----------
    joints : int
        How many were looked at, the nominal one not among them.
    n_unresolved : int
        Joints among them that failed or did not settle: they count below the level at the interval's lower end and
        above it at its upper end.
    above : int
        Valid joints above the level.
    lower, upper : float
        Interval with the confidence of one look.
    """

    joints: int
    n_unresolved: int
    above: int
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
        Numbers of joints at which it was planned to look.
    """

    reached: bool
    look: Look
    looks: list[int]

    def record(self, rule: Rule) -> dict[str, Any]:
        """What the result file keeps of it."""
        planned = {"confidence": CONFIDENCE, "confidence_of_a_look": each(len(self.looks)), "looks": self.looks}
        return {"rule": rule.text} | self.look._asdict() | planned


def parse(text: str) -> Rule:
    """Read a rule, ``"P(cross1.F > 700 N) width < 0.002"``.

    Raises
    ------
    InputError
        With every fault of it.
    """
    said = rules.parse(text, "width", "--until", EXAMPLE)
    if len(said.loads) > 1:
        raise InputError([Fault("--until", f"{text!r} is a rule for {len(said.loads)} loads", EXAMPLE)])
    return Rule(said.text, said.loads[0], said.level, said.bound)


def looks(width: float, n: int) -> list[int]:
    """Numbers of joints at which to look: doubled from the least that can be enough, `n` the last.

    Fewer joints than the first cannot do: with none of them above the level the interval ends at
    1 - ((1 - confidence) / 2)^(1 / joints). Before `n` there is none after the first that is enough whatever the share
    above the level (one half is the worst) with room for unresolved joints, half the width.
    """
    joints = math.ceil(math.log(0.5 * (1.0 - CONFIDENCE)) / math.log1p(-width))
    planned: list[int] = []
    while joints < n:
        planned.append(joints)
        lower, upper = interval(joints // 2, 0, joints, len(planned) + 1)
        if upper - lower < 0.5 * width:
            break
        joints *= 2
    return [*planned, n]


def each(n_looks: int) -> float:
    """Confidence of one look, so that all hold together with `CONFIDENCE` (Bonferroni)."""
    return 1.0 - (1.0 - CONFIDENCE) / n_looks


def interval(count: int, n_unresolved: int, n: int, n_looks: int) -> tuple[float, float]:
    """Interval of one look at `n` joints: unresolved ones below the level at its lower end, above it at its upper."""
    lower, _ = exceedance.clopper_pearson(count, n, each(n_looks))
    _, upper = exceedance.clopper_pearson(count + n_unresolved, n, each(n_looks))
    return float(lower), float(upper)


def run_until(study: Study, out: Path, rule: Rule, run: Callable[[int], object]) -> Outcome:
    """Run a campaign as far as a rule asks for.

    Parameters
    ----------
    study : Study
        The study.
    out : Path
        Its result file. Rows beyond the stop stay pending, and why it stopped is noted in it.
    rule : Rule
        When to stop.
    run : callable
        Simulates the rows of the campaign before the one that it is given.

    Returns
    -------
    Outcome

    Raises
    ------
    InputError
        When the joints are not independent samples, or the study does not keep the load.
    """
    if study.sampling.method != "random":
        own = study.sampling.method
        found = f"sampling.method is {own!r}: only independent samples, alike in weight, have such an interval"
        raise InputError([Fault("--until", found, 'use sampling.method = "random"')])
    if not kept.holds(study.output.columns, rule.load):
        remedy = f"add {', '.join(kept.needed(rule.load))}"
        raise InputError([Fault(f"{study.path}: output.results", f"leaves out {rule.load} of --until", remedy)])
    planned = looks(rule.width, study.samples)
    first = int(study.sampling.nominal_first)
    for joints in planned:
        run(first + joints)
        with ResultStore.open(out) as store:
            look = _look(store, rule, range(first, first + joints), len(planned))
        if look.upper - look.lower < rule.width:
            break
    outcome = Outcome(look.upper - look.lower < rule.width, look, planned)
    if outcome.reached:
        with ResultStore.open(out, "r+") as store:
            store.note_stop(outcome.record(rule))
    return outcome


def _look(store: ResultStore, rule: Rule, rows: range, n_looks: int) -> Look:
    count = unresolved = 0
    for begin in range(rows.start, rows.stop, BLOCK):
        results = store.results(slice(begin, min(begin + BLOCK, rows.stop)))
        part = exceedance.at(load(results, rule.load)[0], results["status"], rule.level, iid=False)
        count += part.count
        unresolved += part.n_failed + part.n_unsettled
    return Look(len(rows), unresolved, count, *interval(count, unresolved, len(rows), n_looks))
