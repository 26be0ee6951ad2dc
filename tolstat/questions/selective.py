"""Selective assembly: yield and unmatched parts by number of classes, and the classes of one campaign."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np

from tolstat.campaign.work import Work
from tolstat.common import units
from tolstat.common.errors import InputError, NotApplicable
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Row, Sentence, Table
from tolstat.display.options import Opt
from tolstat.joint.perturbation import HOLE_OF_PIN
from tolstat.questions import shares
from tolstat.store.hdf5 import BLOCK
from tolstat.store.view import View
from tolstat.study import Study, load
from tolstat.study.rewriting import with_keys
from tolstat.study.selective import KINDS, MAX_CLASSES, Matching, matching

TITLE = "Selective assembly"
NUMBERS = (1, 2, 3, 5)
"""Numbers of classes that are simulated unless told otherwise; 1: not sorted."""
NOTES = (
    Sentence("yield: of the assembled joints; of all crosses: yield times the matched share"),
    Sentence("a cross is in the class of its largest measured pin, a fork in that of its smallest measured hole"),
)
LINES = {
    "good": "yield of the assembled joints",
    "unmatched": "parts without a partner",
    "of_all": "crosses in a good joint",
}
"""Lines of the picture by key of the rows, and their labels."""


def _length(value: float, digits: int) -> str:
    return "-" if np.isinf(value) else units.shown(float(f"{value:.{digits}g}"), "m")


COLUMNS = (
    Column("classes", shares.word("classes")),
    Column("unmatched", shares.share("unmatched")),
    Column("clearance, sigma", lambda row: _length(row["clearance"], 3)),
    Column("yield", shares.share("good")),
    Column("total interval", shares.shares("good_lower", "good_upper")),
    Column("of all crosses", shares.share("of_all")),
)
OF_ONE = (
    Column("class", shares.word("class")),
    Column("pin up to", lambda row: _length(row["pins"], 4)),
    Column("hole up to", lambda row: _length(row["holes"], 4)),
    *(Column(kind.name, shares.share(kind.name)) for kind in KINDS),
    Column("matched", shares.share("matched")),
)
"""Columns of the classes of one campaign."""


def simulate(
    study: Study,
    work: Work,
    classes: Annotated[list[int] | None, Opt("K", 1, MAX_CLASSES)] = None,
    n: Annotated[int | None, Opt("N", least=1)] = None,
) -> list[Path]:
    """Simulate one campaign for each number of classes, with the same seed, into ``STUDY_kK.h5``.

    Parameters
    ----------
    study : Study
        A study with ``sampling.selective``.
    work : Work
        Worker processes and folder.
    classes : list of int, optional
        Number of classes; repeatable; default: 1, 2, 3 and 5.
    n : int, optional
        Number of joints of each.
    """
    studies = {number: study_of(study, number, n) for number in sorted(set(classes or NUMBERS))}
    return [work.run(changed, f"{study.path.stem}_k{number}.h5") for number, changed in studies.items()]


def study_of(study: Study, classes: int, n: int | None = None) -> Study:
    """Set the number of classes of a study with ``sampling.selective`` and, if given, of joints.

    Raises
    ------
    InputError
        With every fault of the study.
    """
    if study.sampling.selective is None:
        remedy = 'add selective = { classes = 3, gauge = "2 um" } to [sampling]'
        raise InputError([study.fault("sampling", "missing key selective", remedy)])
    changed = with_keys(study.text, {("sampling", "selective"): {"classes": classes}}, str(study.path))
    return load(study.path, n, changed)


def selective(*views: View) -> Answer:
    """Compute yield and unmatched parts of selective assembly.

    Pins and holes are measured and sorted in classes; crosses and forks of equal class are assembled. Simulates one
    campaign for each number of classes, with the same seed, into STUDY_kK.h5; 1 is without sorting. To resume after an
    interruption, run the same command again.

    Gives for each the share of the parts without a partner, the scatter of the clearance, and the yield of the
    assembled joints with its 95 % interval.

    Example: tolstat selective studies/selective.toml --classes 1 --classes 3

    Parameters
    ----------
    *views : View
        Campaigns of one study with limits and different numbers of classes; one without classes counts as one class.

    Returns
    -------
    Answer
        Table ``classes``, one row per campaign, by number of classes: ``classes``; ``unmatched``, share of the crosses
        and forks without a partner of their class; ``clearance``, standard deviation of the radial clearance, m; ``n``,
        ``count`` (above at least one limit), ``n_failed``, ``n_unsettled``; ``good``, yield of the assembled joints,
        with its total interval ``good_lower``, ``good_upper``; ``of_all``, share of all crosses that are in a good
        joint, with its ends.

    Raises
    ------
    NotApplicable
        When a study has no limits.
    StoreError
        When its joints are no sample of a production.
    """
    rows = sorted(map(_row, views), key=lambda row: row["classes"])

    def draw(ax: Axes) -> None:
        """Draw yield with its interval, unmatched share, and share of all crosses in a good joint, over the classes."""
        x = [row["classes"] for row in rows]
        for (key, label), colour, dash in zip(LINES.items(), style.COLOURS, style.DASHES, strict=False):
            y = [100.0 * row[key] for row in rows]
            ax.plot(x, y, marker="o", ms=4.5, color=colour, ls=dash, label=label)
        low, high = ([100.0 * row[end] for row in rows] for end in ("good_lower", "good_upper"))
        ax.vlines(x, low, high, color=style.COLOURS[0], lw=1.2)
        ax.set(xlabel="classes", ylabel="share [%]", ylim=(-2.0, 102.0), xticks=x)

    description = "; ".join(f"{row['classes']} classes: yield {text.percent(row['good'])}" for row in rows)
    panel = Panel("classes", TITLE, description, draw, (drawing.WIDTH, 3.4))
    table = Table("classes", "Yield and unmatched parts, by number of classes", COLUMNS, rows, {"clearance": "m"})
    return Answer("selective", TITLE, [Panels([panel]), table, *NOTES])


def selective_on_page(view: View, asked: Asked) -> Answer:
    """Classes of a campaign whose pins and holes are sorted."""
    classes = classes_of(view) if view.store.sampling.get("selective") and view.count(*VALID) else None
    if classes is None:
        raise NotApplicable
    words = f"{text.percent(classes.unmatched)} of the crosses and forks have no partner of their class."
    if view.limits:
        good = shares.good(view)
        ends = text.span(good["good_lower"], good["good_upper"])
        words += f" {text.percent(good['good'])} of the assembled joints keep all limits (total interval {ends})."
    columns = {"class": range(1, classes.matched.size + 1), "pins": classes.edges[0, 1:], "holes": classes.edges[1, 1:]}
    columns |= dict(zip((kind.name for kind in KINDS), classes.shares, strict=True)) | {"matched": classes.matched}
    title = "Classes by measured diameter, deviation from nominal"
    table = Table("edges", title, OF_ONE, shares.rows_of(columns), {"pins": "m", "holes": "m"})
    return Answer("selective", TITLE, [Sentence(words, "lead"), table, *NOTES])


def classes_of(view: View) -> Matching | None:
    """Classes of a campaign; None if its parts are not sorted."""
    study = view.study
    if not study.sampling.is_matched or study.sampling.selective is None:
        return None
    return matching(study.sampling.selective, study.entries, study.tolerances)


def _row(view: View) -> Row:
    view.check("mean")
    if not view.limits:
        remedy = "add [limits] to the study, and run the same command again"
        raise shares.inapplicable(view, "is of a study without [limits]", remedy)
    classes, good = classes_of(view), shares.good(view)
    number, unmatched = (1, 0.0) if classes is None else (classes.matched.size, classes.unmatched)
    errors = view.errors(np.arange(min(view.n, BLOCK)))  # of a large campaign the first joints
    clearances = (0.5 * (errors[f"{hole}.diameter"] - errors[f"{pin}.diameter"]) for pin, hole in HOLE_OF_PIN.items())
    deviation = float(np.sqrt(np.mean([clearance.var() for clearance in clearances])))
    row = {"classes": number, "unmatched": unmatched, "clearance": deviation}
    ends = ("good", "good_lower", "good_upper")
    row |= {key: good[key] for key in ("n", "count", "n_failed", "n_unsettled", *ends)}
    return row | {key.replace("good", "of_all"): (1.0 - unmatched) * good[key] for key in ends}
