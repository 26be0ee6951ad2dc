"""Stop rule: end a campaign when the interval of an exceedance is narrow enough.

When to look, and with which confidence, is in `analysis.binomial`. The looks depend only on the number of joints of
the campaign, not on workers or time: each evaluates the first joints of the sequence, all of them done. Looks of a
campaign that is extended afterwards stay looks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tolstat.analysis import binomial
from tolstat.campaign.pool import kept_workers
from tolstat.common.columns import holds
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import Limit, load_of
from tolstat.store import Reader, View, Writer
from tolstat.study import Study
from tolstat.study import rule as rules

CONFIDENCE = 0.95
BIASED = f"biased high if few joints are above ({100 * binomial.BIAS:.0f} % of itself with {binomial.LEAST_BESIDE})"
"""Sentence on the share at a stop."""
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

    def record(self, rule: rules.Statement) -> dict[str, Any]:
        """Return the attribute ``stop`` of the result file."""
        taken = [joints for joints in self.looks if joints <= self.look.joints]
        how = {"confidence": CONFIDENCE, "confidence_of_a_look": binomial.LOOK_CONFIDENCE, "looks": taken}
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
        found = f"sampling.method is {study.sampling.method!r}: its interval needs independent samples of equal weight"
        raise InputError([Fault("--until", found, 'write sampling.method = "random" in the study')])
    if study.sampling.joints_per_lot > 1:
        found = "joints share lots: the interval of a stop needs independent samples"
        raise InputError([Fault("--until", found, "remove sampling.joints_per_lot, or --until")])
    for load in map(load_of, rule.limit.loads):
        if not holds(study.output.columns, load.name):
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
