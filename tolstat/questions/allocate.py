"""The cheapest tolerances with which the joints of a campaign keep their limits, found by simulating them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from tolstat.analysis import allocation, binomial
from tolstat.campaign import stop_rule
from tolstat.campaign import what_if as sets
from tolstat.campaign.pool import kept_workers
from tolstat.campaign.work import Work
from tolstat.common.columns import holds
from tolstat.common.errors import Fault, InputError, gather, raise_all
from tolstat.common.loads import load_of, unit_text
from tolstat.common.shell import quote
from tolstat.display import text
from tolstat.display.answer import Answer, Column, Listing, Part, Row, Rows, Sentence, Table
from tolstat.display.options import Budget, Costs, Opt
from tolstat.questions import shares
from tolstat.store import Writer
from tolstat.store.view import View
from tolstat.store.what_if import Altered
from tolstat.study import changes, ladder, scaling, selection, widths
from tolstat.study import costs as prices

TITLE = "The cheapest tolerances"
EXAMPLE = 'write --target "P(cross1.F > 700 N) < 0.001"'
MOST = 65_536
"""Default of the largest number of joints of a design."""
BUDGET_S = 600.0
"""Default time limit, s."""
Targets = Annotated[list[str], Opt("RULE", name="target")]
Keep = Annotated[list[str] | None, Opt("PATTERN")]
Most = Annotated[int, Opt("N", least=1024)]


def _costs(row: Row) -> str:
    return f"{row['cost']:.4g}" if math.isfinite(row["cost"]) else "-"


LINES = (
    Column("tolerance", shares.word("tolerance"), words=True),
    Column("features", shares.word("features"), rank=1),
    Column("before", shares.word("before"), words=True),
    Column("proposed", shares.word("proposed"), words=True),
    Column("cost before", lambda row: f"{row['cost_before']:.4g}"),
    Column("cost", _costs),
)
"""Columns of the table ``tolerances``."""


class _Request(NamedTuple):
    """What is asked for: statements to be met, lines that may change, labels of others, most joints of a design."""

    statements: list[stop_rule.Statement]
    ladders: list[ladder.Ladder]
    kept: list[str]
    most: int

    @property
    def targets(self) -> np.ndarray[Any, np.dtype[np.float64]]:
        """Share that each statement allows."""
        return np.array([statement.bound for statement in self.statements])

    @property
    def looks(self) -> list[int]:
        """Numbers of joints of the looks of a check; the first is that of the search."""
        return allocation.sizes(self.targets, self.most)


def allocate(view: View, targets: Targets, costs: Costs = None, keep: Keep = None, most: Most = MOST) -> Answer:
    """Find the cheapest tolerances that meet the targets.

    Simulates the same joints with other tolerances. First lines of the drawing become narrower, step by step, each time
    the one that gains most share for its cost; then lines wider where that costs no yield. A step is the next grade of
    ISO 286 or class of ISO 2768, or a preferred number (R10). The result is simulated anew with joints of other seeds,
    until the upper end of its interval is below the target, or it is known that it misses. All joints are kept in FILE.
    To go on after an interruption, run the same command again.

    Gives the path of the search, the tolerances with their costs, and the share in the new joints. With --out, writes
    the study with the proposed tolerances and a seed that has not been used.

    Example: tolstat allocate iso2768_f.h5 --target "P(any limit) < 0.1"

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    targets : list of str
        Largest share of joints above a level: "P(cross*.F > 700 N) < 0.001"; repeatable.
    costs : Path, optional
        Cost of each tolerance, TOML or CSV (see tolstat docs allocate); default: 1 per feature, inversely proportional
        to the tolerance.
    keep : list of str, optional
        Errors whose tolerances do not change, such as "pin*.diameter"; repeatable; default: none.
    most : int
        Largest number of joints of a design, 65 536 unless given.

    Returns
    -------
    Answer
        Table ``path``, one row per step of search and check: ``step``, ``what`` (``as drawn``, ``all exact``,
        ``narrower``, ``wider``, ``check``), ``line``, ``before``, ``after``, ``cost`` (of all lines), ``n`` joints and
        their ``share`` above the level of the first target, of further ones ``share_2`` and so on, of a check with
        ``_lower`` and ``_upper``. Table ``tolerances``, one row per line that may change: ``tolerance`` (pattern),
        ``features`` (how many), ``before``, ``proposed``, ``cost_before``, ``cost``.

        Facts: ``state`` (``holds``, ``misses``, ``open``: more joints or time would tell, ``impossible``: exact lines
        miss, too, ``exhausted``: no finer step is left), ``holds``, ``misses_by`` (how far the upper end is above the
        target; NaN without a check), ``cost_before``, ``cost``, ``joints`` of the check, ``entries`` (keys of the
        changed entries by pattern), ``kept`` (lines that may not change), ``verdict``.

    Raises
    ------
    InputError
        With every fault of targets, costs and names.
    NotApplicable
        When the file holds no joint of a search for these targets; `simulate` adds them.
    StoreError
        When the file's joints are not drawn from tolerances.
    """
    request = _read_request(view, targets, costs, keep or (), most)
    run = _Run(view, request, view.altered)
    if not run.search.path or (len(run.search.path) == 1 and run.search.state == "open"):
        words = " ".join(f"--target {quote(target)}" for target in targets)
        remedy = f"simulate them: tolstat allocate {quote(str(view.path))} {words}"
        raise shares.inapplicable(view, "holds no joints of a search for these targets", remedy)
    (state, verdict, misses_by), lines = _verdict(view, run), _lines(run)
    chosen = list(zip(request.ladders, run.search.design, strict=True))
    entries = ladder.entries_of(chosen)
    before, after = (sum(row[key] for row in lines) for key in ("cost_before", "cost"))
    facts = {"state": state, "holds": state == "holds", "misses_by": misses_by, "cost_before": before, "cost": after}
    facts |= {"joints": run.looks[-1].n if run.looks else 0, "verdict": verdict}
    facts |= {"entries": entries, "kept": request.kept}
    heads = [statement.text.replace("N*m", unit_text("N*m")) for statement in request.statements]
    notes = [f"Total cost {before:.4g} -> {after:.4g} ({100 * (after / before - 1):+.1f} %)."]
    notes += [f"Kept as drawn: {', '.join(request.kept)}."] if request.kept else []
    parts: list[Part] = [
        *(Sentence(line, "lead") for line in (verdict, *notes)),
        Table("path", "The path: each step, its cost, and the share simulated", _columns(heads), _path(run)),
        Table("tolerances", "Tolerances and their costs", LINES, lines),
    ]
    if entries:
        parts.append(Listing("[tolerances]", "\n".join(map(scaling.line, entries, entries.values()))))
    parts.append(Sentence("intervals hold together for all looks of the check with 95 %, without the numerical error"))
    unused = view.study.sampling.seed + allocation.ROUNDS + 1  # by the search and by any check
    documents = shares.study_documents(view.study, ladder.text_of(view.study, chosen, unused))
    return Answer("allocate", TITLE, [*parts, *documents], facts)


class _Run:
    """Search and check of a request, as far as the joints that a file holds tell them.

    Parameters
    ----------
    view, request : View, _Request
        The campaign and what is asked for.
    altered : dict
        Joints of the file; replaced by those that `simulate` returns.
    simulate : callable, optional
        Simulates changes; returns the joints of the file after it.
    """

    def __init__(
        self,
        view: View,
        request: _Request,
        altered: dict[str, Altered],
        simulate: Callable[[Sequence[sets.Change], str], dict[str, Altered]] | None = None,
    ) -> None:
        self.view, self.request, self._altered, self._simulate = view, request, altered, simulate
        self.problem = allocation.Problem(
            costs=[np.array([own.cost(k) for k in range(len(own.rungs))]) for own in request.ladders],
            drawn=tuple(own.drawn for own in request.ladders),
            above=lambda designs: self._above(designs, view.study.sampling.seed, request.looks[0]),
            targets=request.targets,
            aims=np.array([allocation.aim(float(bound), request.looks[-1]) for bound in request.targets]),
        )
        self.search, self.looks, self.state = allocation.allocate(self.problem, self._fresh, request.looks)

    def _fresh(self, design: allocation.Design, number: int, n: int) -> allocation.Mask | None:
        """Joints of a seed that no design before had."""
        found = self._above([design], self.view.study.sampling.seed + 1 + number, n)
        return None if found is None else found[0]

    def _above(self, designs: Sequence[allocation.Design], seed: int, n: int) -> list[allocation.Mask] | None:
        """Which of the first joints of a seed are above each level with some designs; simulated if they can be."""
        wanted = [self._change(design, seed, n) for design in designs]
        if self._simulate is not None:
            stage = "search" if seed == self.view.study.sampling.seed else f"check, seed {seed}"
            self._altered = self._simulate(wanted, stage)
        columns = []
        for statement in self.request.statements:
            joints = shares.ChangedJoints(self.view, statement.limit, self._altered)
            abouts = [change.about for change in wanted]
            loads = [joints.base if about["kind"] == sets.AS_DRAWN else joints.of(about) for about in abouts]
            known = [values for values in loads if values is not None and len(values) >= n]
            if len(known) < len(wanted):
                return None
            columns.append([~(values[:n] <= joints.level) for values in known])  # above, too, without a valid load
        return [np.column_stack(each) for each in zip(*columns, strict=True)]

    def _change(self, design: allocation.Design, seed: int, n: int) -> sets.Change:
        """Joints of a design; of the campaign as drawn those that it lacks."""
        study, ladders = self.view.study, self.request.ladders
        exact = [own.line for own, step in zip(ladders, design, strict=True) if step == allocation.EXACT]
        if len(exact) == 1:
            return sets.stepped(study, exact[0], widths.EXACT, range(n))
        if exact:
            laws = {name: law for line in exact for name, law in widths.changed(study, line, widths.EXACT).items()}
            return sets.with_study(study, replace(study, tolerances=study.tolerances | laws), "all exact", range(n))
        if (design, seed) == (self.problem.drawn, study.sampling.seed):
            return sets.as_drawn(study, range(min(shares.own_joints(self.view), n), n))
        changed = changes.read(study, ladder.text_of(study, list(zip(ladders, design, strict=True)), seed))
        return sets.with_study(study, changed, self.words(design), range(n))

    def words(self, design: allocation.Design) -> str:
        """Design in words: what differs from the drawing."""
        pairs = zip(self.request.ladders, design, strict=True)
        return ", ".join(f"{own.line.label} {own.rungs[k].words}" for own, k in pairs if k != own.drawn) or "as drawn"


def _path(run: _Run) -> list[dict[str, Any]]:
    """Rows of the table ``path``."""
    rows: list[dict[str, Any]] = []
    checks = {look.after: look for look in run.looks}  # the last one of each design
    none, before = {"line": "-", "before": "-", "after": "-"}, run.problem.drawn
    for number, step in enumerate(run.search.path, start=1):
        row = {"step": len(rows), "what": step.what} | none
        if step.line >= 0:
            own = run.request.ladders[step.line]
            words = (own.rungs[design[step.line]].words for design in (before, step.design))
            row |= dict(zip(none, (own.line.label, *words), strict=True))
        before = before if allocation.EXACT in step.design else step.design
        rows.append(row | {"cost": step.cost, "n": len(step.above)} | _shares(step.above.mean(axis=0)))
        if (look := checks.get(number)) is not None:
            row = {"step": len(rows), "what": "check"} | none | {"cost": step.cost, "n": look.n}
            rows.append(row | _shares(look.share, look.lower, look.upper))
    return rows


def _shares(*ends: np.ndarray[Any, np.dtype[np.float64]]) -> dict[str, float]:
    """Keys and values of the shares above the level of each target, with the ends of their intervals if known."""
    each = ends if len(ends) > 1 else (*ends, np.full_like(ends[0], np.nan), np.full_like(ends[0], np.nan))
    keys = ["share" if j == 0 else f"share_{j + 1}" for j in range(len(ends[0]))]
    return {k: v for j, key in enumerate(keys) for k, v in shares.with_ends(key, [end[j] for end in each]).items()}


def _columns(heads: Sequence[str]) -> list[Column]:
    """Columns of the table ``path``: one for the share of each target."""
    keys = ["share", *(f"share_{j}" for j in range(2, len(heads) + 1))]
    names = ["share, %"] if len(heads) == 1 else [f"{head}, %" for head in heads]
    return [
        Column("step", shares.word("step"), rank=2),
        Column("what", shares.word("what")),
        Column("line", shares.word("line"), words=True),
        Column("from", shares.word("before"), words=True, rank=4),
        Column("to", shares.word("after"), words=True),
        Column("cost", _costs, rank=1),
        Column("joints", shares.word("n"), rank=3),
        *(shares.estimated(name, key) for name, key in zip(names, keys, strict=True)),
    ]


def _lines(run: _Run) -> Rows:
    """Rows of the table ``tolerances``."""
    rows = []
    for own, step in zip(run.request.ladders, run.search.design, strict=True):
        words = {"before": own.rungs[own.drawn].words, "proposed": own.rungs[step].words}
        row = {"tolerance": own.line.label, "features": own.features} | words
        rows.append(row | {"cost_before": own.cost(own.drawn), "cost": own.cost(step)})
    return rows


def _verdict(view: View, run: _Run) -> tuple[str, str, float]:
    """State, sentence on it, and how far the upper end is above its target."""
    statements, file = run.request.statements, quote(str(view.path))
    if run.search.state == "impossible":
        least = run.search.path[1].above
        worst = int(np.argmax(least.mean(axis=0) / run.problem.targets))
        share = text.percent(float(least[:, worst].mean()))
        every = "all other lines" if run.request.kept else "all lines"
        head = f"No tolerance suffices: with {every} exact {share} of the joints miss {statements[worst].text}"
        return "impossible", f"{head}. {_others(view, statements[worst], file)}", math.nan
    if not run.looks:
        unfinished = "The search is not finished: the same command goes on, a longer --budget goes further."
        return run.state, unfinished, math.nan
    look = run.looks[-1]
    worst = int(np.argmax(look.upper / run.problem.targets))
    low, high = float(look.lower[worst]), float(look.upper[worst])
    misses_by = high - float(run.problem.targets[worst])
    share = f"{text.percent(float(look.share[worst]))} ({text.span(low, high)}) of {look.n} joints of another seed"
    goal = statements[worst].text.replace("N*m", unit_text("N*m"))
    if look.state == "holds":
        return "holds", f"Holds: {share}, which the search has not seen, are above: {goal}.", misses_by
    why = f"Misses {goal} by {text.percent(misses_by)}" if look.state == "misses" else f"Open, {goal}"
    needed = binomial.needed(float(look.share[worst]), float(run.problem.targets[worst]), allocation.LOOK_CONFIDENCE)
    more = f"; {needed:.0f} joints would tell: --most" if look.state == "open" and needed > look.n else ""
    none = "; no finer step is left" if run.search.state == "exhausted" else ""
    return look.state, f"{why}: {share} are above; upper end {text.percent(high)}{more}{none}.", misses_by


def _others(view: View, statement: stop_rule.Statement, file: str) -> str:
    """What else than tolerances would keep a limit: values of what is assumed."""
    joints = shares.ChangedJoints(view, statement.limit, view.altered)
    found = [(joints.share(loads), about["label"]) for about, loads in joints.changes(sets.JOINT)]
    would = [f"{label} ({text.percent(share[0])})" for share, label in found if share[0] < statement.bound]
    return f"What else would: {', '.join(would) or f'tolstat assumptions {file} --run tells'}."


def _read_request(view: View, targets: Sequence[str], costs: Path | None, keep: Sequence[str], most: int) -> _Request:
    """Read targets, costs and names, and report their faults together."""
    shares.check_one_joint(view)
    study, faults, statements = view.study, list[Fault](), list[stop_rule.Statement]()
    for target in targets:
        with gather(faults):
            statements.append(stop_rule.parse(target, view.limits, view.mechanism, "", "--target", EXAMPLE))
            asked = statements[-1].limit.loads
            lacking = [name for name in asked if not holds(view.columns, load_of(name, view.mechanism))]
            if lacking:
                kept = f"give one of: {', '.join(view.kept_loads)}"
                faults.append(Fault("--target", f"the file does not keep {', '.join(lacking)}", kept))
    kept_names: set[str] = set()
    for pattern in keep:
        names = selection.select(pattern, study.tolerances)
        if not names:
            faults.append(Fault("--keep", f"{pattern!r} selects no error that the study scatters", "see [tolerances]"))
        kept_names |= set(names)
    every, found = scaling.tolerances(study), list[ladder.Ladder]()
    with gather(faults):
        found += ladder.ladders(study, every, prices.of(every, study.mechanism, costs))
    raise_all(faults)
    free = [own for own in found if len(own.rungs) > 1 and not kept_names & set(own.line.names)]
    if not free:
        remedy = "name some in --costs, or leave --keep out; measured and lognormal errors stay as they are"
        raise InputError([Fault("--costs", "leaves no tolerance that may change", remedy)])
    return _Request(statements, free, ladder.kept(study, free), most)


def simulate(
    path: Path,
    work: Work,
    targets: Targets,
    costs: Costs = None,
    keep: Keep = None,
    most: Most = MOST,
    budget: Budget = BUDGET_S,
) -> list[Path]:
    """Search for the cheapest tolerances, simulate what a file lacks of it, and keep the loads in the file.

    Parameters
    ----------
    path : Path
        Result file of a campaign whose joints are drawn from tolerances.
    work : Work
        Workers, progress and messages.
    targets, costs, keep, most
        As in `allocate`.
    budget : float
        Time limit, with unit s, min or h; 10 min unless given.

    Returns
    -------
    list of Path
        The file.

    Raises
    ------
    InputError
        With every fault of targets, costs and names.
    StoreError
        When the file cannot be used, or lacks joints and was made by other code.
    """
    begin = time.monotonic()
    with Writer.open(path) as store, kept_workers():
        view = View(store, work.study_file).at(work.point)
        request = _read_request(view, targets, costs, keep or (), most)
        loads = [name for statement in request.statements for name in statement.limit.loads]
        simulation = shares.Simulation(store, view, work, loads)

        def more(wanted: Sequence[sets.Change], stage: str) -> dict[str, Altered]:
            simulation.run(wanted, stage, f"{stage}: ", begin + budget)
            return simulation.altered

        _Run(view, request, simulation.altered, more)
        work.tell(f"simulated {text.several(simulation.simulated, 'joint')} in {time.monotonic() - begin:.0f} s")
    return [path]
