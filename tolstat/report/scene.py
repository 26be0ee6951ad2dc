"""What is simulated, in two lines, and whether the study gives it or it is assumed; errors that are taken as exact."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

from tolstat.common.errors import TolstatError
from tolstat.display.text import capital
from tolstat.joint.sections import mounting_and_law
from tolstat.questions.assumptions.words import AXIAL, LAW
from tolstat.store import recorded
from tolstat.store.view import View
from tolstat.study.assumptions import assumptions, unselected

NEEDLES = "needles"
"""Contact law of needle bearings."""


def lines(view: View) -> tuple[str, str]:
    """Operating point and bearing, mounting and contact law, each with ``given`` or ``assumed``.

    A view whose study can no longer be read has lines without these words.
    """
    points = [view.store.points[name] for name in view.points]
    at = points[0].in_words if len(points) == 1 else f"{len(points)} operating points"
    axial, laws = recorded.mountings(view.store)
    bearing = "needle bearings" if set(laws) == {NEEDLES} else "plain bearings" if NEEDLES not in laws else "bearings"
    mounting, law = mounting_and_law(axial, laws).split("; ")
    assumed = _assumed(view)
    of_bearing = assumed is not None and any(key.startswith("bearing.") for key in assumed)
    first = f"{at}{_mark(assumed, False)}; {bearing}{_mark(assumed, of_bearing)}."
    second = f"{mounting}{_mark(assumed, AXIAL in (assumed or ()))}; {law}{_mark(assumed, LAW in (assumed or ()))}."
    return capital(first), capital(second)


def exact(view: View) -> str:
    """Note on errors that no tolerance mentions; empty where there are none."""
    with suppress(TolstatError):
        if names := unselected(view.study):
            return f"no tolerance, taken as exact: {', '.join(names)}"
    return ""


def _assumed(view: View) -> set[str] | None:
    """Keys of the joint that are assumed; None where the study can no longer be read."""
    with suppress(TolstatError):
        return set(_keys(view))
    return None


def _keys(view: View) -> Iterator[str]:
    for own in assumptions(view.study):
        for value in own.values:
            yield from value


def _mark(assumed: set[str] | None, is_assumed: bool) -> str:
    return "" if assumed is None else " (assumed)" if is_assumed else " (given)"
