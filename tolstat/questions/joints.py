"""What became of the joints, and of what they were drawn: tolerances, contact modes, failures, errors of the loads."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from functools import partial

import numpy as np

from tolstat import sampling
from tolstat.analysis import accuracy as comparison
from tolstat.analysis import ranks
from tolstat.campaign.remedy import remedy
from tolstat.common import units
from tolstat.common.errors import TolstatError
from tolstat.common.load_kinds import kinds
from tolstat.common.loads import FloatArray, load_of, units_of_loads
from tolstat.common.mechanism import Mechanism
from tolstat.common.tables import FAILED, STATUS_TEXT, UNSETTLED, Mode, Status
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Axes, Column, Panel, Panels, Part, Row, Rows, Sentence, Table, plain
from tolstat.questions.shares import Cell, inapplicable, rows_of, share, word
from tolstat.store.verification import Verification
from tolstat.store.view import View
from tolstat.study.tolerances.correlation import correlations
from tolstat.study.tolerances.entry import meanings

MAX_JOINTS = 20_000
"""Number of joints (the first ones) whose errors are compared."""
SIGNIFICANT, TEST = 0.05, "(Wilcoxon–Mann–Whitney, Holm)"
MOST_ERRORS = 10
"""Number of errors that the picture shows."""
COMPARED = {"direction": "larger", "size": "farther from the middle"}
"""What the picture shows of each error, by key of `their_errors`."""
COLOURS = ("#E6E6E6", style.COLOURS[3], style.COLOURS[1], style.COLOURS[0])
"""Colours of the contact modes."""
MODE_WORDS = {mode.name.lower(): mode.name.lower().replace("_", " ") for mode in Mode}
MODES = (Column("pin", word("pin")), *(Column(words, share(key)) for key, words in MODE_WORDS.items()))
"""Columns of the table ``modes``."""
FIRST = (
    Column("row", word("row")),
    Column("status", word("status"), words=True),
    Column("what to do", word("remedy"), words=True),
)
"""Columns of the table ``first``."""
ENTRIES = (
    Column("tolerance", word("entry")),
    Column("its number", word("number"), words=True),
    Column("error", word("errors"), words=True, rank=1),
    Column("sigma", lambda row: units.shown(row["sigma"], row["unit"])),
    Column("outside", lambda row: "-" if row["outside"] is None else text.percent(row["outside"])),
)
"""Columns of the table ``entries``, see `meanings`."""
CORRELATED = (
    Column("correlated errors", word("errors")),
    Column("pairs", word("pairs")),
    Column("rho of normal scores", lambda row: f"{row['rho']:.3g}"),
    Column("Pearson", lambda row: f"{row['pearson']:.3f}"),
    Column("Spearman", lambda row: f"{row['spearman']:.3f}"),
)
"""Columns of the table ``correlations``, see `correlations`."""


def modes(view: View) -> Answer:
    """Compute the shares of the revolution in which pins touch.

    Parameters
    ----------
    view : View
        A campaign of a study that keeps the contact modes.

    Returns
    -------
    Answer
        Table ``modes``: ``pin``, and for each contact mode the mean share of the revolution over the settled joints.

    Raises
    ------
    NotApplicable
        When there are none.
    """
    if not np.isfinite(view.mode_share).any():
        remedy = 'add "pin*.share_*" to [output] results of the study, if it has a list'
        raise inapplicable(view, "has no contact modes of valid joints", remedy)
    pins = kinds(view.mechanism)["contact"].places
    rows = rows_of({"pin": pins} | dict(zip(MODE_WORDS, view.mode_share.T.tolist(), strict=True)))
    lines = [f"{row['pin']}: " + ", ".join(f"{column.head} {column.cell(row)}" for column in MODES[1:]) for row in rows]
    draw, size = partial(_draw_modes, rows=rows), (drawing.WIDTH, 1.0 + 0.25 * len(pins))
    panel = Panel("modes", "Contact modes", "; ".join(lines), draw, size, rows=pins)
    note = "Share of the revolution that each pin spends in each mode, mean of the settled joints. None: the pin "
    note += "touches nothing; one point: one end; two point: both ends, on opposite sides; uniform: along the hole."
    table = Table("modes", "Mean share of the revolution", MODES, rows, dict.fromkeys(MODE_WORDS, "1"))
    return Answer("modes", "How the pins touch", [Panels([panel]), table, Sentence(note)])


def failed(view: View) -> Answer:
    """List joints without a valid load, and compare their errors.

    Parameters
    ----------
    view : View
        A campaign.

    Returns
    -------
    Answer
        Table ``states``: number of ``joints`` by ``status``, with its ``meaning``. Table ``first``: ``row``, ``status``
        and ``remedy`` of the first joints without a valid load, see `without_load`. Picture of `their_errors`.

    Raises
    ------
    NotApplicable
        When all joints that were simulated have valid loads.
    """
    joints = without_load(view)
    if not joints:
        remedy = "all joints that were simulated have valid loads"
        raise inapplicable(view, "holds no failed or unsettled joints", remedy)
    counts = {status: view.count(status) for status in Status}
    states = [{"status": s.label, "joints": n, "meaning": STATUS_TEXT[s]} for s, n in counts.items() if n]
    parts: list[Part] = [Table("states", "Number of joints by status", plain(states), states)]
    compared: Rows = []
    words = "Their errors are not compared with those of the others, which takes ten joints or more on either side, "
    words += "drawn from the tolerances."
    with suppress(TolstatError):
        compared = their_errors(view)
    if compared:
        parts.append(Panels([_errors_panel(compared[:MOST_ERRORS])]))
        marked = [row["error"] for row in compared if min(row["direction_p"], row["size_p"]) < SIGNIFICANT]
        words = f"Beyond chance {TEST}: {', '.join(marked)}."
        words = words if marked else f"No error plays a part beyond chance {TEST}."
    first = Table("first", "The first of them", FIRST, joints)
    return Answer("failed", "Failed and unsettled joints", [*parts, Sentence(words), first])


def tolerances(view: View) -> Answer:
    """Explain the entries of the tolerances and correlations.

    Parameters
    ----------
    view : View
        A campaign of a study whose joints are drawn from tolerances.

    Returns
    -------
    Answer
        Table ``entries``, see `meanings`, and of correlated errors table ``correlations``, see
        `correlations`.

    Raises
    ------
    NotApplicable
        When the joints are no sample of a production.
    InputError, StoreError
        When the study cannot be read.
    """
    if not view.sampled:
        remedy = 'give the result file of a study with [tolerances] and sampling.method "random", "sobol" or "lhs"'
        raise inapplicable(view, "holds joints that are no random sample", remedy)
    entries = meanings(view.study.entries).to_dict("records")
    correlated = correlations(view.study.copula, view.study.tolerances).to_dict("records")
    parts: list[Part] = [Table("entries", "Entries of [tolerances]", ENTRIES, entries, {"outside": "1"})]
    words = "Sigma: standard deviation of one error. Outside: share of the parts outside the drawing's band or zone."
    if correlated:
        units_of = dict.fromkeys(("rho", "pearson", "spearman"), "1")
        parts.append(Table("correlations", "Correlation", CORRELATED, correlated, units_of))
        words += " Rho is given for the normal scores; Pearson's and Spearman's correlation are those of the errors."
    return Answer("tolerances", "What the tolerances mean", [*parts, Sentence(words)])


def without_load(view: View) -> Rows:
    """First joints without a valid load, see `View.first_without_load`: ``row``, ``status``, ``remedy``."""
    samples = np.flatnonzero(np.isin(view.status, (*FAILED, *UNSETTLED)))[: len(view.first_without_load)]
    return [
        {"row": int(row), "status": Status(int(joint["status"])).label, "remedy": remedy(joint, view.store.options)}
        for row, joint in zip(view.rows(samples), view.first_without_load, strict=True)
    ]


def their_errors(view: View) -> Rows:
    """Compare the errors of joints without a valid load with those of the others, among the first `MAX_JOINTS`.

    Returns
    -------
    sequence of mapping
        ``error``, then ``direction`` and ``size`` with ``_lower``, ``_upper`` and ``_p``, `ranks.Part`;
        the error that differs most first. Empty if there are too few joints of either kind, or if the joints are not
        drawn from tolerances.

    Raises
    ------
    InputError, StoreError
        When the study cannot be read.
    """
    samples = np.flatnonzero(view.status[:MAX_JOINTS] != Status.PENDING)
    bad = np.isin(view.status[samples], (*FAILED, *UNSETTLED))
    if min(int(bad.sum()), int((~bad).sum())) < ranks.FEWEST:
        return []
    if view.method == "sweep" or view.design.refuses():
        return []
    scores = sampling.normal_scores(view.study, view.errors(samples))
    scores = {name: column for name, column in scores.items() if np.ptp(column) > 0}
    tail = ranks.tail(np.column_stack(list(scores.values())), bad, iid=view.design.independent)
    columns = {"error": np.array(list(scores))}
    for key, part in tail._asdict().items():
        columns |= {key: part.estimate, f"{key}_lower": part.lower, f"{key}_upper": part.upper, f"{key}_p": part.p}
    far = np.maximum(abs(tail.direction.estimate - 0.5), abs(tail.size.estimate - 0.5))
    order = np.argsort(-far, kind="stable")
    return rows_of({key: values[order].tolist() for key, values in columns.items()})


def _draw_modes(ax: Axes, rows: Rows) -> None:
    left = np.zeros(len(rows))
    for (key, words), colour in zip(MODE_WORDS.items(), COLOURS, strict=True):
        share = 100.0 * np.array([row[key] for row in rows])
        ax.barh(range(len(rows)), share, left=left, height=0.62, color=colour, edgecolor="white", label=words)
        left += share
    ax.set(xlim=(0.0, 100.0), xlabel="share of the revolution [%]")


def _errors_panel(rows: Rows) -> Panel:
    words = "Probability that a joint without a valid result has the larger error than a settled one."
    for number, row in enumerate(rows[:4]):
        words += f"{';' if number else ''} {row['error']}: larger {row['direction']:.2f}, "
        words += f"farther from the middle {row['size']:.2f}"
    draw, size = partial(_draw_errors, rows=rows), (drawing.WIDTH, drawing.rows_height(len(rows)) + 0.2)
    labels = [row["error"] for row in rows]
    return Panel("errors-without-load", "Failures in the space of errors", words, draw, size, rows=labels)


def _draw_errors(ax: Axes, rows: Rows) -> None:
    for (key, label), marker, off, colour in zip(COMPARED.items(), "oD", (-0.16, 0.16), style.COLOURS, strict=False):
        y = np.arange(len(rows)) + off
        estimate, lower, upper = (np.array([row[f"{key}{end}"] for row in rows]) for end in ("", "_lower", "_upper"))
        if np.isfinite(lower).any():
            ax.hlines(y, lower, upper, color=colour, lw=1.4)
        ax.plot(estimate, y, marker, ms=4.5, color=colour, ls="", label=label)
    ax.axvline(0.5, color=style.INK, lw=0.9)
    ax.set(xlim=(0.0, 1.0), xlabel="probability that the joint without a valid load has the error that is …")


TOTAL = "numerical error"
LEAST = 1e-5
"""Smallest error that is given as a number in per cent."""


def _small(key: str) -> Cell:
    return lambda row: text.formed(row[key], ".1e")


ERRORS = (
    Column("load", word("load")),
    Column("error", word("error"), words=True),
    Column("joints", word("joints")),
    Column("median", _small("median")),
    Column("95 % below", _small("usual")),
    Column("worst", _small("worst")),
)
"""Columns of the table ``errors``."""


def accuracy(view: View) -> Answer:
    """Give the numerical error of the loads, from checks of joints.

    Parameters
    ----------
    view : View
        A campaign of which some joints were checked, as ``tolstat run`` and ``tolstat verify`` do.

    Returns
    -------
    Answer
        Table ``errors``, see `error_rows`. Fact ``numerical_error``: by kind of load, the error that 95 % of the
        checked joints stay below; None if it is not known.

    Raises
    ------
    NotApplicable
        When the file holds no checks.
    """
    checks = view.verification
    if checks is None:
        remedy = f"check some joints: tolstat verify {view.path}"
        raise inapplicable(view, "holds no checks of the numerical error", remedy)
    title = "Relative to the largest load of its kind in the joint"
    rows, unit = error_rows(checks, view.mechanism), dict.fromkeys(("median", "usual", "worst"), "1")
    table = Table("errors", title, ERRORS, rows, unit)
    lead = Sentence(text.sentence(error_note(checks, view.mechanism, view.limits)), "lead")
    return Answer("accuracy", "Numerical error", [lead, table], {"numerical_error": view.numerical_error})


def error_rows(verification: Verification, mechanism: Mechanism, by_kind: bool = True) -> Rows:
    """Distribution of the errors over the joints, for each check and each kind of load, or load, that is kept.

    Returns
    -------
    sequence of mapping
        ``load`` (``F``: the worst of its bushings in each joint; ``cross1.F`` if not `by_kind`), ``error`` (name of the
        check or `TOTAL`), ``joints``, ``median``, ``usual`` (95 % of the joints are below) and ``worst``.
    """
    by_check, columns = errors(verification, mechanism), _kept(verification, mechanism)
    if by_kind:
        shown = {load_of(name, mechanism).kind.key for name in columns}
        columns = {key: k for k, key in enumerate(kinds(mechanism)) if key in shown}
        by_check = {name: comparison.by_kind(values, mechanism) for name, values in by_check.items()}
    each = ((load, name, *comparison.spread(by_check[name][:, k])) for load, k in columns.items() for name in by_check)
    return [dict(zip(("load", "error", "joints", "median", "usual", "worst"), row, strict=True)) for row in each]


def errors(verification: Verification, mechanism: Mechanism) -> dict[str, FloatArray]:
    """Errors, (m, loads), by check, as of `accuracy.differences`; last `TOTAL`, from `accuracy.numerical`."""
    results = {name: check.results for name, check in verification.checks.items()}
    by_check = {name: comparison.differences(verification.base, other, mechanism) for name, other in results.items()}
    return by_check | {TOTAL: comparison.numerical(verification.base, results, mechanism)}


def joint_rows(verification: Verification, mechanism: Mechanism) -> Rows:
    """Errors of every joint, by check and load kept.

    Returns
    -------
    sequence of mapping
        ``row``, ``check``, ``status`` (of the check), ``load``, ``unit``, ``campaign`` and ``value`` (SI), ``error``:
        the campaign's value minus the check's, relative to the largest load of the measure.
    """
    base, rows = comparison.loads(verification.base, mechanism), list[Row]()
    for name, check in verification.checks.items():
        other = comparison.loads(check.results, mechanism)
        error = comparison.differences(verification.base, check.results, mechanism)
        states = [Status(code).label for code in check.results["status"]]
        for load, k in _kept(verification, mechanism).items():
            fixed = {"load": load, "unit": units_of_loads(mechanism)[load]}
            values = zip(verification.rows, states, base[:, k], other[:, k], error[:, k], strict=True)
            for row, status, *numbers in values:
                figures = dict(zip(("campaign", "value", "error"), map(float, numbers), strict=True))
                rows.append({"row": int(row), "check": name, "status": status, **fixed, **figures})
    return rows


def error_note(verification: Verification, mechanism: Mechanism, limits: Iterable[str] = ()) -> str:
    """Sentence on the numerical error of the largest loads: of kinds that every report shows, and those of `limits`."""
    limited = {load_of(name, mechanism).kind.key for name in limits}
    total = [row for row in error_rows(verification, mechanism) if row["error"] == TOTAL]
    shown = [row for row in total if row["load"] in limited or kinds(mechanism)[row["load"]].shown] or total
    known = [row for row in shown if not np.isnan(row["worst"])]
    called = [called_for_people(row["load"], mechanism) for row in known]
    words = [
        f"{name} {row['median']:.1e}, at worst {row['worst']:.1e}" for name, row in zip(called, known, strict=True)
    ]
    noun = "error of numerics and fidelity" if comparison.FIDELITY in verification.checks else "numerical error"
    base = verification.base["status"] == Status.OK
    lost = {"": int((~base).sum())}  # joints that failed or did not settle, in the campaign and in each check
    for name, check in verification.checks.items():
        lost[f" in {name}"] = int((base & (check.results["status"] != Status.OK)).sum())
    unsettled = ", ".join(f"{count} not settled{where}" for where, count in lost.items() if count)
    return f"{noun}, {basis(verification)}: {'; '.join(words) or 'unknown'}{f'; {unsettled}' if unsettled else ''}"


def called_for_people(key: str, mechanism: Mechanism) -> str:
    """Name of a kind of loads in sentences: its symbol where tables have that beside every load, or else its noun."""
    kind = kinds(mechanism)[key]
    return kind.symbol if kind.shown or kind.key == "psi" else kind.noun


def basis(verification: Verification) -> str:
    """Words on how the numerical error was determined."""
    m = len(verification.rows)
    if comparison.REFERENCE in verification.checks:
        settled = int((verification.checks[comparison.REFERENCE].results["status"] == Status.OK).sum())
        return f"measured on {settled} of {m} joints against a tight reference"
    noun = "joint" if m == 1 else "joints"
    return f"estimated on {m} {noun} from half the step, tighter Newton and longer settling"


def in_percent(error: float) -> str:
    """Format an error in per cent; below `LEAST` the number says no more than that it is small."""
    return f"< {text.percent(LEAST)}" if error < LEAST else text.percent(error)


def _kept(verification: Verification, mechanism: Mechanism) -> dict[str, int]:
    """Loads that the campaign keeps, with their numbers in `accuracy.observables`; all if no joint has a value."""
    has_values = ~np.isnan(comparison.loads(verification.base, mechanism)).all(axis=0)
    kept = np.asarray(has_values | ~has_values.any())
    return {name: k for k, name in enumerate(comparison.observables(mechanism)) if kept[k]}
