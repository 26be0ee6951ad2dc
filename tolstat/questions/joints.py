"""What became of the joints, and of what they were drawn: contact modes, joints without a valid load, tolerances."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from tolstat import sampling
from tolstat.analysis import ranks
from tolstat.campaign.remedy import remedy
from tolstat.common import units
from tolstat.common.errors import Fault, NotApplicable
from tolstat.common.load_kinds import PINS
from tolstat.common.tables import FAILED, STATUS_TEXT, UNSETTLED, Mode, Status
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Part, Sentence, Table
from tolstat.display.asked import Asked
from tolstat.display.blocks import Panel, Panels
from tolstat.display.table import Column, Row, Rows
from tolstat.store.view import View
from tolstat.study.tolerances import meaning

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MAX_JOINTS = 20_000
"""Number of joints (the first ones) whose errors are compared."""
SIGNIFICANT = 0.05
MOST_ERRORS = 10
"""Number of errors that the picture shows."""
PARTS = ("larger", "farther from the middle")
COLOURS = ("#E6E6E6", style.COLOURS[3], style.COLOURS[1], style.COLOURS[0])
"""Colours of the contact modes."""
MODE_WORDS = {mode.name.lower(): mode.name.lower().replace("_", " ") for mode in Mode}
MODES = (
    Column("pin", lambda row: str(row["pin"])),
    *(Column(words, lambda row, key=key: text.percent(row[key])) for key, words in MODE_WORDS.items()),  # type: ignore[misc]
)
"""Columns of the table ``modes``."""
STATES = (
    Column("status", lambda row: str(row["status"])),
    Column("joints", lambda row: str(row["joints"])),
    Column("meaning", lambda row: str(row["meaning"]), words=True),
)
"""Columns of the table ``states``."""
FIRST = (
    Column("row", lambda row: str(row["row"])),
    Column("status", lambda row: str(row["status"]), words=True),
    Column("what to do", lambda row: str(row["remedy"]), words=True),
)
"""Columns of the table ``first``."""
ENTRIES = (
    Column("tolerance", lambda row: str(row["entry"])),
    Column("its number", lambda row: str(row["number"]), words=True),
    Column("error", lambda row: str(row["errors"]), words=True, rank=1),
    Column("sigma", lambda row: units.shown(row["sigma"], row["unit"])),
    Column("outside", lambda row: "-" if row["outside"] is None else text.percent(row["outside"])),
)
"""Columns of the table ``entries``, see `meaning.table`."""
CORRELATED = (
    Column("correlated errors", lambda row: str(row["errors"])),
    Column("pairs", lambda row: str(row["pairs"])),
    Column("rho of normal scores", lambda row: f"{row['rho']:.3g}"),
    Column("Pearson", lambda row: f"{row['pearson']:.3f}"),
    Column("Spearman", lambda row: f"{row['spearman']:.3f}"),
)
"""Columns of the table ``correlations``, see `meaning.correlations`."""


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
        raise NotApplicable(str(Fault(str(view.path), "has no contact modes of valid joints", remedy)))
    shares = view.mode_share.tolist()
    rows = [{"pin": pin} | dict(zip(MODE_WORDS, own, strict=True)) for pin, own in zip(PINS, shares, strict=True)]
    lines = [f"{row['pin']}: " + ", ".join(f"{column.head} {column.cell(row)}" for column in MODES[1:]) for row in rows]
    panel = Panel("modes", "Contact modes", "; ".join(lines), partial(_draw_modes, rows=rows), (4.9, 2.0), 0.6, 0.28)
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
    InputError, StoreError
        When the study cannot be read.
    """
    return _failed(view, their_errors(view) if view.first_without_load.size else [])


def failed_on_page(view: View, asked: Asked) -> Answer:
    """As `failed`; without the comparison if the study cannot be read."""
    rows: Rows = []
    if view.first_without_load.size:
        with asked.noting("errors of failed and unsettled joints are not compared"):
            rows = their_errors(view)
    return _failed(view, rows)


def tolerances(view: View) -> Answer:
    """Explain the entries of the tolerances and correlations.

    Parameters
    ----------
    view : View
        A campaign of a study whose joints are drawn from tolerances.

    Returns
    -------
    Answer
        Table ``entries``, see `study.tolerances.meaning.table`, and of correlated errors table ``correlations``, see
        `study.tolerances.meaning.correlations`.

    Raises
    ------
    NotApplicable
        When the joints are no sample of a production.
    InputError, StoreError
        When the study cannot be read.
    """
    if not view.sampled:
        remedy = 'give the result file of a study with [tolerances] and sampling.method "random", "sobol" or "lhs"'
        raise NotApplicable(str(Fault(str(view.path), "holds joints that are no random sample", remedy)))
    study = view.study
    entries = meaning.table(study.entries).to_dict("records")
    correlated = meaning.correlations(study.copula, study.tolerances).to_dict("records")
    parts: list[Part] = [Table("entries", "Entries of [tolerances]", ENTRIES, entries, {"outside": "1"})]
    said = "Sigma: standard deviation of one error. Outside: share of the parts outside the drawing's band or zone."
    if correlated:
        own = dict.fromkeys(("rho", "pearson", "spearman"), "1")
        parts.append(Table("correlations", "Correlation", CORRELATED, correlated, own))
        said += " Rho is given for the normal scores; Pearson's and Spearman's correlation are those of the errors."
    return Answer("tolerances", "What the tolerances mean", [*parts, Sentence(said)])


class WithoutLoad(NamedTuple):
    """A joint without a valid load: its row in the campaign, its status and what to do about it."""

    row: int
    status: str
    remedy: str


def without_load(view: View) -> list[WithoutLoad]:
    """Return the first joints without a valid load, see `View.first_without_load`."""
    samples = np.flatnonzero(np.isin(view.status, (*FAILED, *UNSETTLED)))[: len(view.first_without_load)]
    return [
        WithoutLoad(int(row), Status(int(joint["status"])).label, remedy(joint, view.store.options))
        for row, joint in zip(view.rows(samples), view.first_without_load, strict=True)
    ]


def their_errors(view: View) -> Rows:
    """Compare the errors of joints without a valid load with those of the others, among the first `MAX_JOINTS`.

    Returns
    -------
    sequence of mapping
        ``error``, then ``direction`` and ``size`` with ``_lower``, ``_upper`` and ``_p``, `ranks.Part`;
        the error that differs most first. Empty if there are too few joints of either kind, or if the joints are not
        drawn from tolerances with equal weights.

    Raises
    ------
    InputError, StoreError
        When the study cannot be read.
    """
    if view.method == "sweep" or view.design.refuses("difference") or view.study.groups:
        return []
    samples = np.flatnonzero(view.status[:MAX_JOINTS] != Status.PENDING)
    bad = np.isin(view.status[samples], (*FAILED, *UNSETTLED))
    if min(int(bad.sum()), int((~bad).sum())) < ranks.FEWEST:
        return []
    errors = view.errors(samples)
    scores = {name: own for name, own in sampling.normal_scores(view.study, errors).items() if np.ptp(own) > 0}
    z = np.column_stack(list(scores.values()))
    found = ranks.tail(z, bad, iid=view.design.has_interval("difference"))
    columns: dict[str, Any] = {}
    for key, part in found._asdict().items():
        columns |= {key: part.estimate, f"{key}_lower": part.lower, f"{key}_upper": part.upper, f"{key}_p": part.p}
    far = np.maximum(abs(found.direction.estimate - 0.5), abs(found.size.estimate - 0.5))
    names = list(scores)
    order = np.argsort(-far, kind="stable")
    return [{"error": names[k]} | {key: float(values[k]) for key, values in columns.items()} for k in order]


def _failed(view: View, compared: Rows) -> Answer:
    joints = [joint._asdict() for joint in without_load(view)]
    if not joints:
        found = "holds no failed or unsettled joints"
        raise NotApplicable(str(Fault(str(view.path), found, "all joints that were simulated have valid loads")))
    counts = {status: view.count(status) for status in Status}
    states = [{"status": s.label, "joints": n, "meaning": STATUS_TEXT[s]} for s, n in counts.items() if n]
    parts: list[Part] = [Table("states", "Number of joints by status", STATES, states)]
    if compared:
        parts += [Panels([_errors_panel(compared[:MOST_ERRORS])]), Sentence(_differences(compared))]
    else:
        said = "Their errors are not compared with those of the others, which takes ten joints or more on either side, "
        parts.append(Sentence(said + "drawn from the tolerances with equal weight."))
    parts.append(Table("first", "The first of them", FIRST, joints))
    return Answer("failed", "Failed and unsettled joints", parts)


def _draw_modes(ax: Axes, rows: Rows) -> None:
    drawing.rows(ax, list(PINS))
    left = np.zeros(4)
    for (key, words), colour in zip(MODE_WORDS.items(), COLOURS, strict=True):
        share = 100.0 * np.array([row[key] for row in rows])
        ax.barh(range(4), share, left=left, height=0.62, color=colour, edgecolor="white", label=words)
        left += share
    ax.set(xlim=(0.0, 100.0), xlabel="share of the revolution [%]")
    drawing.legend_above(ax, *ax.get_legend_handles_labels())


def _errors_panel(rows: Rows) -> Panel:
    def said(row: Row) -> str:
        return f"{row['error']}: larger {row['direction']:.2f}, farther from the middle {row['size']:.2f}"

    words = "; ".join(map(said, rows[:4]))
    left = drawing.rows_left([row["error"] for row in rows])
    return Panel(
        "errors-without-load",
        "Failures in the space of errors",
        f"Probability that a joint without a valid result has the larger error than a settled one. {words}",
        partial(_draw_errors, rows=rows),
        (4.9, drawing.rows_height(len(rows)) + 0.2),
        left,
        drawing.legend_room(PARTS, left),
    )


def _draw_errors(ax: Axes, rows: Rows) -> None:
    drawing.rows(ax, [row["error"] for row in rows])
    for key, marker, label, k in (("direction", "o", PARTS[0], 0), ("size", "D", PARTS[1], 1)):
        place, colour = np.arange(len(rows)) + (-0.16, 0.16)[k], style.COLOURS[k]
        own, lower, upper = (np.array([row[f"{key}{end}"] for row in rows]) for end in ("", "_lower", "_upper"))
        if np.isfinite(lower).any():
            ax.hlines(place, lower, upper, color=colour, lw=1.4)
        ax.plot(own, place, marker, ms=4.5, color=colour, ls="", label=label)
    ax.axvline(0.5, color=style.INK, lw=0.9)
    ax.set(xlim=(0.0, 1.0), xlabel="probability that the joint without a valid load has the error that is …")
    drawing.legend_above(ax, *ax.get_legend_handles_labels())


def _differences(rows: Rows) -> str:
    marked = [row["error"] for row in rows if min(row["direction_p"], row["size_p"]) < SIGNIFICANT]
    said = f"Beyond chance (Wilcoxon–Mann–Whitney, Holm): {', '.join(marked)}." if marked else ""
    return said or "No error plays a part beyond chance (Wilcoxon–Mann–Whitney, Holm)."
