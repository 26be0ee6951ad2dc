"""Stop rule: end a campaign when the interval of an exceedance is narrow enough.

When to look, and with which confidence, is in `analysis.sequential`. The looks depend only on the rule and on the
numbers of joints of the campaign, not on workers or time: each evaluates the first joints of the sequence, all of them
done. Looks of a campaign that is extended afterwards stay looks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from tolstat.analysis import exceedance, sequential
from tolstat.campaign.pool import kept_workers
from tolstat.common import selected_results
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import Limit, load_of
from tolstat.store import Reader, Writer, worst
from tolstat.store.hdf5 import BLOCK
from tolstat.study import rule as rules

if TYPE_CHECKING:
    from tolstat.study import Study

CONFIDENCE = 0.95
EXAMPLE = 'write --until "P(cross1.F > 700 N) width < 0.01"'


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
        Share of the valid joints above the level; unbiased if all are valid, see `sequential.Scheme.estimate`.
    lower, upper : float
        Interval with the confidence of one look, `sequential.Scheme.confidence`.
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
    confidence_of_a_look : float
        Confidence of the interval of each look, for which that of the last look covers with `CONFIDENCE`.
    """

    reached: bool
    look: Look
    looks: list[int]
    confidence_of_a_look: float

    def record(self, rule: rules.Statement) -> dict[str, Any]:
        """Return the attribute ``stop`` of the result file."""
        taken = [joints for joints in self.looks if joints <= self.look.joints]
        how = {"confidence": CONFIDENCE, "confidence_of_a_look": self.confidence_of_a_look, "looks": taken}
        return {"rule": rule.text, "reached": self.reached} | self.look._asdict() | how


def parse(text: str, limits: Mapping[str, float]) -> rules.Statement:
    """Read a rule, ``"P(cross1.F > 700 N) width < 0.002"``; `limits` are those of the study.

    Raises
    ------
    InputError
        With every fault of it.
    """
    return rules.parse(text, "width", "--until", EXAMPLE, limits)


def run_until(study: Study, out: Path, rule: rules.Statement, run: Callable[[int], object]) -> Outcome:
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
        own = study.sampling.method
        found = f"sampling.method is {own!r}: its interval needs independent samples of equal weight"
        raise InputError([Fault("--until", found, 'write sampling.method = "random" in the study')])
    if study.sampling.joints_per_lot > 1:
        found = "joints share lots: the interval of a stop needs independent samples"
        raise InputError([Fault("--until", found, "remove sampling.joints_per_lot, or --until")])
    for load in map(load_of, rule.limit.loads):
        if not selected_results.holds(study.output.columns, load.name):
            remedy = f"add {', '.join(load.columns)}"
            raise InputError([study.fault("output.results", f"leaves out {load.name}, which --until needs", remedy)])
    scheme = sequential.scheme(rule.bound, sequential.looks(rule.bound, study.samples, _taken(out)), CONFIDENCE)
    with kept_workers():
        number, look, reached = _looked(study.first_sample, out, rule.limit, scheme, run)
    valid = max(look.joints - look.n_unresolved, 1)
    look = look._replace(estimate=scheme.estimate(number, look.above) * look.joints / valid)
    outcome = Outcome(reached, look, scheme.looks, scheme.confidence)
    with Writer.open(out) as store:
        store.record_stop(outcome.record(rule))
    return outcome


def _looked(
    first: int, out: Path, limit: Limit, scheme: sequential.Scheme, run: Callable[[int], object]
) -> tuple[int, Look, bool]:
    """Simulate and look until the rule holds, or the joints end; return the last look, its number, whether it holds.

    `first` is the row of sample 0. The file is opened once for all looks at what has been simulated.
    """
    number, simulated = 0, 0
    while True:
        run(first + scheme.looks[simulated])
        with Reader.open(out) as store:
            while True:
                look = _look(store, limit, range(first, first + scheme.looks[number]), scheme, number)
                reached = scheme.narrow(number, look.above, look.n_unresolved)
                if reached or number == simulated:
                    break
                number += 1
        if reached or number == len(scheme.looks) - 1:
            return number, look, reached
        simulated = scheme.next_look(number, look.above)
        number += 1


def _taken(out: Path) -> list[int]:
    """Looks that were taken at the joints of the file so far."""
    if not out.exists():
        return []
    with Reader.open(out) as store:
        return list(store.stop.get("looks", ()))


def _look(store: Reader, limit: Limit, rows: range, scheme: sequential.Scheme, number: int) -> Look:
    count = unresolved = 0
    for begin in range(0, len(rows), BLOCK):
        block = rows[begin : begin + BLOCK]
        parts = {one.point or "": one.results(slice(block.start, block.stop)) for one in store.each()}
        part = exceedance.exceedance(*worst.limit_of(parts, limit), limit.level, iid=False)
        count += part.count
        unresolved += part.n_failed + part.n_unsettled
    ends = scheme.interval(number, count, unresolved)
    return Look(len(rows), unresolved, count, count / max(len(rows) - unresolved, 1), *ends)
