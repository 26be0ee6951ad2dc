"""Stop rule: end a campaign when the interval of an exceedance is narrow enough.

Inspecting an interval repeatedly and stopping as soon as it is narrow lowers its coverage below its confidence. Here
the looks (interim analyses) are few, at numbers of joints fixed beforehand, and each interval has the confidence
1 - (1 - confidence) / looks (Bonferroni). The probability that any of the intervals misses the true exceedance is at
most 1 - confidence, so the interval of the last look has the required coverage, whenever the campaign stops. The looks
depend only on the rule and the number of joints, not on workers or time: each look evaluates the first joints of the
sequence, all of them done.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tolstat.analysis import exceedance
from tolstat.common import selected_results
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import LOADS
from tolstat.store import Reader, ResultStore, worst
from tolstat.store.result_file import BLOCK
from tolstat.study import rule as rules

if TYPE_CHECKING:
    from tolstat.study import Study

CONFIDENCE = 0.95
EXAMPLE = 'write --until "P(cross1.F > 700 N) width < 0.01"'


class Rule(NamedTuple):
    """Stop when the interval of P(load > level) is narrower than `width`; of several operating points the worst counts.

    Attributes
    ----------
    text : str
        The rule as it was written.
    load : str
        Name of the load, such as ``cross1.F``.
    level : float
        Level of the load, SI.
    width : float
        Width of the interval, between 0 and 1.
    """

    text: str
    load: str
    level: float
    width: float


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
    lower, upper : float
        Interval with the confidence of one look, see `look_confidence`.
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
        Numbers of joints of the planned looks.
    """

    reached: bool
    look: Look
    looks: list[int]

    def record(self, rule: Rule) -> dict[str, Any]:
        """Return the attribute ``stop`` of the result file."""
        planned = {
            "confidence": CONFIDENCE,
            "confidence_of_a_look": look_confidence(len(self.looks)),
            "looks": self.looks,
        }
        return {"rule": rule.text} | self.look._asdict() | planned


def parse(text: str) -> Rule:
    """Read a rule, ``"P(cross1.F > 700 N) width < 0.002"``.

    Raises
    ------
    InputError
        With every fault of it.
    """
    statement = rules.parse(text, "width", "--until", EXAMPLE)
    if len(statement.loads) > 1:
        raise InputError(
            [Fault("--until", f"{text!r} is a rule for {len(statement.loads)} loads instead of one", EXAMPLE)]
        )
    return Rule(statement.text, statement.loads[0], statement.level, statement.bound)


def looks(width: float, n: int) -> list[int]:
    """Return the numbers of joints at which to look: doubled from the smallest that can suffice; the last is `n`.

    Fewer joints than the first number cannot suffice: even with none of them above the level, the interval ends at
    1 - ((1 - confidence) / 2)^(1 / joints). Doubling ends at the first number that suffices for any share above the
    level (one half is the worst), with half of the width reserved for unresolved joints.
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


def look_confidence(n_looks: int) -> float:
    """Confidence of one look, such that all looks together have the confidence `CONFIDENCE` (Bonferroni)."""
    return 1.0 - (1.0 - CONFIDENCE) / n_looks


def interval(count: int, n_unresolved: int, n: int, n_looks: int) -> tuple[float, float]:
    """Interval of one look at `n` joints; unresolved ones count as below the level for its lower end, else above."""
    lower, _ = exceedance.clopper_pearson(count, n, look_confidence(n_looks))
    _, upper = exceedance.clopper_pearson(count + n_unresolved, n, look_confidence(n_looks))
    return float(lower), float(upper)


def run_until(study: Study, out: Path, rule: Rule, run: Callable[[int], object]) -> Outcome:
    """Run a campaign until a stop rule is satisfied or all joints are simulated.

    Parameters
    ----------
    study : Study
        The study.
    out : Path
        Its result file. Rows after the stop stay pending, and the reason for the stop is recorded in the file.
    rule : Rule
        Rule that says when to stop.
    run : callable
        Row of the campaign -> simulates all rows below it.

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
        found = f"sampling.method is {own!r}: its interval needs independent samples of equal weight"
        raise InputError([Fault("--until", found, 'write sampling.method = "random" in the study')])
    if not selected_results.holds(study.output.columns, rule.load):
        remedy = f"add {', '.join(LOADS[rule.load].columns)}"
        raise InputError([study.fault("output.results", f"leaves out {rule.load}, which --until needs", remedy)])
    planned = looks(rule.width, study.samples)
    first = study.first_sample
    for joints in planned:
        run(first + joints)
        with Reader.open(out) as store:
            look = _look(store, rule, range(first, first + joints), len(planned))
        if look.upper - look.lower < rule.width:
            break
    outcome = Outcome(look.upper - look.lower < rule.width, look, planned)
    if outcome.reached:
        with ResultStore.open_to_write(out) as store:
            store.record_stop(outcome.record(rule))
    return outcome


def _look(store: Reader, rule: Rule, rows: range, n_looks: int) -> Look:
    count = unresolved = 0
    for begin in range(0, len(rows), BLOCK):
        block = rows[begin : begin + BLOCK]
        results = [one.results(slice(block.start, block.stop)) for one in store.each()]
        values, status, _ = worst.load_of(results, LOADS[rule.load])
        part = exceedance.exceedance(values, status, rule.level, iid=False)
        count += part.count
        unresolved += part.n_failed + part.n_unsettled
    return Look(len(rows), unresolved, count, *interval(count, unresolved, len(rows), n_looks))
