"""The report of a result file as one page: verdict, sections of the questions, provenance, written as HTML."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from tolstat import questions
from tolstat.common import notation, strict, units
from tolstat.common.errors import Fault, NotApplicable, StoreError, TolstatError
from tolstat.common.tables import SCHEMA_VERSION
from tolstat.display import progress, text
from tolstat.display.answer import Asked
from tolstat.display.blocks import Facts, Listing, Page, Panels, Section, Text
from tolstat.joint import Joint, derived, load, model
from tolstat.joint.overrides import leaves
from tolstat.joint.reading import DEFAULT_JOINT, examples
from tolstat.joint.sections import mounting_and_law, quantities
from tolstat.questions.assumptions.variations import AXIAL, LAW
from tolstat.questions.causes import lines, worst
from tolstat.report import verdict
from tolstat.report.answer import stopped
from tolstat.solver import fidelity
from tolstat.store import Reader, recorded, viewed
from tolstat.store.points import point_of
from tolstat.store.view import View
from tolstat.study.assumptions import assumptions, unselected

REPLAYED = 1000
"""Default number of joints whose load histories are evaluated: some 2 s if they are simulated again."""


def write_page(
    source: str | Path | Reader | View,
    out: str | Path,
    accepted: float = np.nan,
    replay: int = REPLAYED,
    stage: Callable[[str], None] = progress.silent,
    point: str = "",
    processes: int = 1,
    full: bool = False,
    brief: bool = False,
) -> Path:
    """Write the report of a result file as one page; the campaign may be unfinished.

    Parameters
    ----------
    source : str, Path, ResultFile or View
        The result file of a study that draws its joints or sweeps: its path, what `tolstat.open` returns, or a view.
    out : str or Path
        HTML file to write.
    accepted : float
        Accepted share: share of the joints that may be above a limit; NaN if none is given.
    replay : int
        Number of joints whose load histories are evaluated; without stored histories they are simulated again. With 0
        the page shows no histories.
    stage : callable
        Called with the name of each part of the page when its computation begins.
    point : str
        Operating point, ``"cruise"``, or the worst of some, ``"cruise+start"``; the worst of all by default.
    processes : int
        Number of processes: on Linux, joints are simulated again and pictures are drawn in forks of this one.
    full : bool
        Whether all sections are open; otherwise what supports the answer is folded.
    brief : bool
        Whether the page has the verdict and the line of the drawing to change only, and prints on one sheet.

    Returns
    -------
    Path
        The file written; the same result file gives the same bytes, with any number of processes.

    Raises
    ------
    StoreError
        When the file cannot be read, lists its joints, or holds levels of a subset simulation.

    Examples
    --------
    >>> tolstat.write_page("iso2768_f.h5", "iso2768_f.html", accepted=0.01)  # doctest: +SKIP
    PosixPath('iso2768_f.html')
    """
    with viewed(source) as view:
        if view.store.case_names:
            remedy = "leave the ending .html out: tolstat report FILE writes their table"
            raise StoreError(str(Fault(str(view.path), "lists its joints one by one", remedy)))
        asked = Asked(view.path, accepted, replay, stage=stage, processes=processes)
        made = compose_brief(view.at(point), asked) if brief else compose(view.at(point), asked, full)
        stage("page: pictures")  # drawn from the view
        from tolstat.display import html

        html.write(made, Path(out), processes)
    return Path(out)


def compose(view: View, asked: Asked, full: bool = False) -> Page:
    """Compose the page: verdict, open sections, folded sections, provenance.

    What cannot be evaluated is left out, and a note in the first section says why.
    """
    worst.begin_replay(view, asked)
    asked.notes.extend(_notes(view))
    if len(view.points) > 1:
        point = point_of(view, view.most_exceeded) if view.leading else view.points[0]
        remedy = f"tolstat report {asked.path.name} --point {point} --out PAGE.html"
        asked.notes.append(f"loads over the input angle are on the page of one operating point: {remedy}")
    sections = questions.sections(view, asked)
    sections.sort(key=lambda section: section.folded)
    listings = (
        Facts(tuple(_facts(view.store)), "Provenance"),
        joint_values(view.store),
        Listing("The study as it was run", view.store.study_text),
    )
    return _page(view, [verdict.section(view, asked), *sections], listings, full)


def compose_brief(view: View, asked: Asked) -> Page:
    """Compose the page that prints on one sheet: verdict with its drawing, and the line of the drawing to change."""
    asked.notes.extend(_notes(view))
    sections = [verdict.section(view, asked)]
    with asked.noting("nothing on the lines of the drawing"), suppress(NotApplicable):
        answer = lines.lines_on_page(view, asked)
        blocks = [block for block in answer.blocks() if isinstance(block, Text | Panels)]
        sections.append(Section("lines", answer.title, blocks[:2]))
    return _page(view, sections)


def _page(
    view: View, sections: Sequence[Section], listings: Sequence[Facts | Listing] = (), full: bool = False
) -> Page:
    store = view.store
    return Page(
        view.name,
        recorded.joint_of(store, 0).description,
        scene(view),
        sections,
        f"{text.sentence(view.head())} Sampling {store.sampling['method']}, seed {store.sampling['seed']}; "
        f"begun {store.created}; tolstat {store.versions.get('tolstat', 'of unknown version')}; "
        f"result file {view.path.name}.",
        listings,
        full,
    )


def _notes(view: View) -> Iterator[str]:
    """What restricts the numbers of the whole page."""
    for note in (
        exact(view),
        fidelity.sentence(view.store.options, view.store.fidelity),
        stopped(view),
        recorded.note_on_mounting(view.store),
    ):
        if note:
            yield note


def _facts(store: Reader) -> Iterator[tuple[str, str]]:
    """Provenance of the numbers, as names and values."""
    yield "Study", store.study_name
    rows = f"{store.n}" if store.whole else f"{store.rows[0]} to {store.rows[-1]} of {store.campaign_rows}"
    yield "Rows of the campaign", rows
    yield "Sampling", f"{store.sampling['method']}, seed {store.sampling['seed']}"
    for point in store.points.values():
        yield f"Operating point {point.name}".strip(), point.in_words
    yield "Begun", store.created
    yield "Versions", ", ".join(f"{name} {value}" for name, value in store.versions.items() if name != "sources")
    yield "Code", f"{store.git_commit or 'no commit known'}; sources {store.versions.get('sources', 'unknown')}"
    yield "Result file", f"schema {SCHEMA_VERSION}"
    yield "Checksum of the results", store.results_checksum() or "none while a run is under way, or was killed"
    yield "Solver", ", ".join(f"{name} {value}" for name, value in store.options.items())
    for k, retry in enumerate(store.retries, 1):
        yield f"Retry {k}", ", ".join(f"{name} {value}" for name, value in retry.get("settings", {}).items())


NEEDLES = "needles"
"""Contact law of needle bearings."""


def scene(view: View) -> tuple[str, str]:
    """Operating point and bearing, mounting and contact law, each with ``given`` or ``assumed``.

    A view whose study can no longer be read has lines without these words.
    """
    points = [view.store.points[name] for name in view.points]
    at = points[0].in_words if len(points) == 1 else f"{len(points)} operating points"
    axial, laws = recorded.mountings(view.store)
    bearing = "needle bearings" if set(laws) == {NEEDLES} else "plain bearings" if NEEDLES not in laws else "bearings"
    mounting, law = mounting_and_law(axial, laws).split("; ")
    assumed: set[str] | None = None  # where the study can no longer be read
    with suppress(TolstatError):
        assumed = {key for own in assumptions(view.study) for value in own.values for key in value}
    of_bearing = assumed is not None and any(key.startswith("bearing.") for key in assumed)
    first = f"{at}{_mark(assumed, False)}; {bearing}{_mark(assumed, of_bearing)}."
    second = f"{mounting}{_mark(assumed, AXIAL in (assumed or ()))}; {law}{_mark(assumed, LAW in (assumed or ()))}."
    return text.capital(first), text.capital(second)


def exact(view: View) -> str:
    """Note on errors that no tolerance mentions; empty where there are none."""
    with suppress(TolstatError):
        if names := unselected(view.study):
            return f"no tolerance, taken as exact: {', '.join(names)}"
    return ""


def _mark(assumed: set[str] | None, is_assumed: bool) -> str:
    return "" if assumed is None else " (assumed)" if is_assumed else " (given)"


UNIT = derived.UNITS | quantities(Joint)
DIGITS = 5


def joint_values(store: Reader) -> Listing:
    """Table of the values that differ from those of `DEFAULT_JOINT`, with the formula of those that were not given.

    Raises
    ------
    InputError
        When this version cannot read the joint in the file.
    """
    joint = strict.validate(Joint, store.joint, f"{store.path}: joint")
    given, own, default = leaves(joint.given()), _values(joint), _values(load(DEFAULT_JOINT, {}, DEFAULT_JOINT))
    rows = [
        (key, value, default.get(key, "-"), "given" if key in given else derived.DERIVED[key].formula)
        for key, value in own.items()
        if value != default.get(key) and (key in given or key in derived.DERIVED)
    ]
    title = f"The joint: values that differ from {DEFAULT_JOINT}"
    if not rows:
        return Listing(title, f"none: it is {DEFAULT_JOINT}")
    return Listing(title, text.align([("key", "value", DEFAULT_JOINT, "by"), *rows], [True, False, False, True]))


def _values(joint: Joint) -> dict[str, str]:
    """Values by dotted key, in the unit in which a joint file has them."""
    found = leaves(joint.model_dump(exclude=set(model.TOLD)))
    return {key: _written(key, value) for key, value in found.items() if value is not None}


def _written(key: str, value: Any) -> str:
    if not isinstance(value, (float, tuple)):
        return str(value)
    unit = UNIT.get(key, "1")
    like = examples().get(key, units.EXAMPLES[unit])
    numbers, name = [], ""
    for one in value if isinstance(value, tuple) else (value,):
        read = notation.read(str(units.written(one, unit, like[0] if isinstance(like, list) else like)))
        if read is not None:
            numbers.append(f"{read.number:.{DIGITS}g}")
            name = read.unit
    return f"{', '.join(numbers)} {name}".rstrip()
