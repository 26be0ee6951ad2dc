"""What the verdict stands on: shares above the limits with other values of what nobody measured of the joint."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from shlex import quote

import numpy as np

from tolstat.common.errors import Fault, NotApplicable
from tolstat.display import text
from tolstat.display.answer import Answer, Asked, Column, Panels, Part, Row, Sentence, Table
from tolstat.display.options import Accepted
from tolstat.questions.assumptions import figure, sentences
from tolstat.questions.assumptions.run import simulate as simulate
from tolstat.questions.assumptions.variations import Standing, applicable, evaluate
from tolstat.store.view import View

TITLE = "What the verdict stands on"
_UNITS = {f"{name}{end}": "1" for name in ("share", "change") for end in ("", "_lower", "_upper")}


def _interval(row: Row, name: str, form: str) -> str:
    value = 100.0 * row[name]
    if np.isnan(value):
        return "-"
    return f"{value:{form}} ({text.ends(100.0 * row[f'{name}_lower'], 100.0 * row[f'{name}_upper'], form)})"


COLUMNS = (
    Column("with", lambda row: str(row["label"]), words=True),
    Column("share, %", partial(_interval, name="share", form=".1f")),
    Column("change, %", partial(_interval, name="change", form="+.1f")),
    Column(
        "verdict",
        lambda row: sentences.KEPT.get(row["side"]) or str(row["side"]),
        shown=lambda rows: any(r["side"] for r in rows),
        words=True,
        rank=1,
    ),
    Column("turns it", lambda row: "yes" if row["turns"] else "", shown=lambda rows: any(r["turns"] for r in rows)),
    Column("assumed, since", lambda row: str(row["because"]), words=True, rank=2),
    Column("keys of the joint", lambda row: str(row["keys"]), words=True, rank=3),
)
"""Columns of the rows of `Standing`."""


def assumptions(view: View, accepted: Accepted = math.nan) -> Answer:
    """Compute what the verdict stands on.

    Gives the share of the joints above the limits with each other value that [[assumed]] of the joint file and of the
    study lists, all else equal, and with all assumptions together at their better and at their worse values: share,
    change joint by joint, and with --accept whether the verdict turns. With --run, simulates the first 1000 joints of
    FILE with each value and keeps their loads in FILE. To go on after an interruption, run the same command again.

    Example: tolstat assumptions iso2768_f.h5 --run --accept "10 %"

    Parameters
    ----------
    view : View
        A campaign of a study with limits whose joints are drawn from tolerances.
    accepted : float
        Accepted share of the joints that exceed at least one limit, for the verdict.

    Returns
    -------
    Answer
        Table ``assumptions``, see `variations.Standing.rows`, and facts: ``n``, ``confidence``; ``share``, ``lower``,
        ``upper`` as drawn; ``stands_on``, see `sentences.values`.

    Raises
    ------
    NotApplicable
        When the file holds no joints with other values.
    StoreError
        When the joints are not those of one joint, not drawn from tolerances, differ in weight, or have no limits.
    """
    found = evaluate(view, accepted)
    if not found.rows:
        remedy = f"simulate them: tolstat assumptions {quote(str(view.path))} --run"
        raise NotApplicable(str(Fault(str(view.path), "holds no joints with other values of what is assumed", remedy)))
    return Answer("assumptions", TITLE, [*_parts(view, found), *map(Sentence, _notes(found, view))], _facts(found))


def assumptions_on_page(view: View, asked: Asked) -> Answer:
    """Table of the variations; their picture is beside the verdict."""
    found = applicable(view, asked.accepted)
    if found is None or not found.rows:
        raise NotApplicable
    parts = [part for part in _parts(view, found) if isinstance(part, Table)]
    return Answer("assumptions", TITLE, [*parts, *map(Sentence, _notes(found, view))], _facts(found))


def _parts(view: View, found: Standing) -> list[Part]:
    share, lower, upper = found.drawn
    lead = f"As drawn {text.percent(share)} of the joints exceed a limit ({text.span(lower, upper)})."
    if any(verdict := sentences.turned(found)):
        lead += f" {text.sentence(', '.join(verdict))}"
    title = f"Share above a limit with other values, and its change; {found.n} joints of each"
    below = [sentences.still(found), sentences.shop(view)]
    return [
        Sentence(lead, "lead"),
        Panels([figure.bars(found)]),
        Table("assumptions", title, COLUMNS, found.rows, _UNITS),
        *(Sentence(own, "lead") for own in below if own),
    ]


def _notes(found: Standing, view: View) -> Iterator[str]:
    n = len(found.rows)
    yield (
        f"intervals of {100.0 * found.confidence:.4g} % (95 % for all {n} variations together), without the numerical "
        "error; a verdict turns if the interval of the share lies on the other side of the accepted share, and that of "
        "the change excludes zero"
    )
    for note in (sentences.not_varied(found, view.path.name), sentences.more(found, view.path.name)):
        if note:
            yield note


def _facts(found: Standing) -> dict[str, object]:
    share, lower, upper = found.drawn
    about = {"n": found.n, "confidence": found.confidence, "share": share, "lower": lower, "upper": upper}
    return about | {"stands_on": sentences.values(found)}
