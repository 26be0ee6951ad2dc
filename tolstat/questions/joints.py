"""What became of the joints, and of what they were drawn: tolerances, contact modes, failures, errors of the loads."""

from __future__ import annotations

from contextlib import suppress
from functools import partial

import numpy as np

from tolstat import sampling
from tolstat.analysis import ranks
from tolstat.campaign.remedy import remedy
from tolstat.common import units
from tolstat.common.errors import TolstatError
from tolstat.common.load_kinds import kinds
from tolstat.common.tables import FAILED, STATUS_TEXT, UNSETTLED, Mode, Status
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Axes, Column, Panel, Panels, Part, Rows, Sentence, Table, plain
from tolstat.questions.shares import inapplicable, rows_of, share, word
from tolstat.store.recorded import MISFIT
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
    scrap = {Status.OUTSIDE_MODEL: MISFIT} if view.misfits.sum() == counts[Status.OUTSIDE_MODEL] else {}
    meaning = STATUS_TEXT | scrap
    states = [{"status": s.label, "joints": n, "meaning": meaning[s]} for s, n in counts.items() if n]
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
        remedy = 'give the result file of a study with [tolerances] and sampling.method = "random"'
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
