"""The report of a result file as one page: verdict, sections of the questions, provenance, written as HTML."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from tolstat.common import loads, notation, strict, units
from tolstat.common.columns import METHODS
from tolstat.common.errors import Fault, NotApplicable, StoreError, TolstatError
from tolstat.common.shell import quote
from tolstat.common.tables import SCHEMA_VERSION, VALID
from tolstat.display import html, progress, rewording, table, text
from tolstat.display.answer import Asked
from tolstat.display.blocks import Block, Decision, Facts, Listing, Page, Panels, Section, Sentence
from tolstat.display.verdict import WORDS, Verdict
from tolstat.joint import Joint, derived, load, model
from tolstat.joint.model import leaves
from tolstat.joint.reading import DEFAULT_JOINT, examples
from tolstat.joint.sections import quantities
from tolstat.questions import QUESTIONS, accuracy, shares
from tolstat.questions.assumptions import answer, sentences, variations
from tolstat.questions.causes import lines, revolution
from tolstat.questions.drawings.answer import place_of
from tolstat.questions.exceedance import rows as exceedance
from tolstat.report.answer import stopped
from tolstat.report.headline import headline, life_verdicts, tells_yield
from tolstat.solver import fidelity
from tolstat.store import Reader, recorded, viewed
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
        page = compose(view.at(point), asked, full, brief)
        stage("page: pictures")  # drawn from the view
        html.write(page, Path(out), processes)
    return Path(out)


def compose(view: View, asked: Asked, full: bool = False, brief: bool = False) -> Page:
    """Compose the page: verdict, open sections, folded sections, provenance.

    A brief one has the verdict with its drawing, and the line of the drawing to change. What cannot be evaluated is
    left out, and a note in the first section says why.
    """
    store, sections, listings = view.store, list[Section](), list[Facts | Listing]()
    asked.notes.extend(_notes(view))
    if brief:
        with asked.noting("nothing on the lines of the drawing"), suppress(NotApplicable):
            answer = lines.lines_on_page(view, asked)
            blocks = [block for block in answer.blocks() if isinstance(block, Sentence | Panels)]
            sections.append(Section("lines", answer.title, blocks[:2]))
    else:
        if asked.replay:
            revolution.begin_replay(view, asked)
        if len(view.points) > 1:
            point = view.point_of(view.most_exceeded) if view.leading else view.points[0]
            remedy = f"tolstat report {asked.path.name} --point {point} --out PAGE.html"
            asked.notes.append(f"loads over the input angle are on the page of one operating point: {remedy}")
        sections = sorted(sections_of(view, asked), key=lambda section: section.folded)
        listings = [Facts(tuple(_facts(store)), "Provenance"), joint_values(store)]
        listings.append(Listing("The study as it was run", store.study_text))
    composed = Page(
        view.name,
        recorded.description(store),
        scene(view),
        [decision(view, asked), *sections],
        f"{text.sentence(view.head())} Sampling {store.sampling['method']}, seed {store.sampling['seed']}; "
        f"begun {store.created}; tolstat {store.versions.get('tolstat', 'of unknown version')}; "
        f"result file {view.path.name}.",
        listings,
        full,
    )
    return rewording.page(composed, recorded.wording_of(store))


def sections_of(view: View, asked: Asked) -> Iterator[Section]:
    """Sections of the page, in the order of `QUESTIONS`; questions that the file cannot answer have none.

    Sentences name the file without its folder, so that the page does not depend on the folder.
    """
    for question in QUESTIONS:
        if question.page:
            asked.stage(f"page: {question.name}")
            with asked.noting(f"{question.name.replace('_', ' ')} is left out"), suppress(NotApplicable):
                answer = question.on_page(view, asked)
                blocks = [_without_folder(block, view.path) for block in answer.blocks()]
                yield Section(question.name.replace("_", "-"), answer.title, blocks, question.page == "folded")


def _without_folder(block: Block, path: Path) -> Block:
    if not isinstance(block, Sentence):
        return block
    return replace(block, text=block.text.replace(quote(str(path)), quote(path.name)).replace(str(path), path.name))


def _notes(view: View) -> list[str]:
    """What restricts the numbers of the whole page."""
    names: Sequence[str] = ()
    with suppress(TolstatError):  # a study that can no longer be read
        names = unselected(view.study)
    exact = f"no tolerance, taken as exact: {', '.join(names)}" if names else ""
    model = fidelity.sentence(view.store.options, view.store.fidelity)
    return [note for note in (exact, model, stopped(view), recorded.note_on_mounting(view.store)) if note]


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


def scene(view: View) -> tuple[str, str]:
    """Operating point and bearing, mounting and contact law, each with ``given`` or ``assumed``.

    A view whose study can no longer be read has lines without these words.
    """
    points = [view.store.points[name] for name in view.points]
    at = points[0].in_words if len(points) == 1 else f"{len(points)} operating points"
    bearing = recorded.bearings_in_words(view.store)
    mounting, law = recorded.in_words(view.store).split("; ")
    assumed: set[str] | None = None  # where the study can no longer be read
    with suppress(TolstatError):
        assumed = {key for assumption in assumptions(view.study) for value in assumption.values for key in value}

    def marked(words: str, key: str) -> str:
        if assumed is None:
            return words
        found = any(name == key or (key.endswith(".") and name.startswith(key)) for name in assumed)
        return f"{words} ({'assumed' if found else 'given'})"

    first = f"{marked(at, 'operation.')}; {marked(bearing, 'bearing.')}."
    second = f"{marked(mounting, variations.AXIAL)}; {marked(law, variations.LAW)}."
    return text.capital(first), text.capital(second)


def joint_values(store: Reader) -> Listing:
    """Table of the values that differ from those of `DEFAULT_JOINT`, with the formula of those that were not given.

    Raises
    ------
    InputError
        When this version cannot read the joint in the file.
    """
    joint, joint2 = strict.validate(Joint, store.joint, f"{store.path}: joint"), recorded.joint2_of(store)
    rows = _different("joint1." if joint2 else "", joint)
    rows += _different("joint2.", joint2) if joint2 else []
    title = f"The joint: values that differ from {DEFAULT_JOINT}"
    if not rows:
        return Listing(title, f"none: it is {DEFAULT_JOINT}")
    return Listing(title, text.align([("key", "value", DEFAULT_JOINT, "by"), *rows], [True, False, False, True]))


def _different(prefix: str, joint: Joint) -> list[tuple[str, str, str, str]]:
    """Values of a joint that differ from those of `DEFAULT_JOINT`: key behind a prefix, value, default, formula."""
    given_keys, default = leaves(joint.given()), _values(load(DEFAULT_JOINT, {}, DEFAULT_JOINT))
    return [
        (f"{prefix}{key}", value, default.get(key, "-"), "given" if key in given_keys else derived.DERIVED[key].formula)
        for key, value in _values(joint).items()
        if value != default.get(key) and (key in given_keys or key in derived.DERIVED)
    ]


def _values(joint: Joint) -> dict[str, str]:
    """Values by dotted key, in the unit in which a joint file has them."""
    values: dict[str, str] = {}
    units_of = derived.UNITS | quantities(Joint) | {f"shaft.{end}.bearings": "m" for end in ("input", "output")}
    left_out = {*model.TOLD} if "friction" in joint.parts else {*model.TOLD, "friction"}
    for key, value in leaves(joint.model_dump(exclude=left_out)).items():
        if isinstance(value, (float, list)):
            unit = units_of.get(key, "1")
            like = examples().get(key, units.EXAMPLES[unit])
            like = like[0] if isinstance(like, list) else like
            written = [str(units.written(number, unit, like)) for number in np.atleast_1d(value).tolist()]
            numbers = [number for number in map(notation.read, written) if number is not None]
            digits = ", ".join(f"{number.number:.5g}" for number in numbers)
            values[key] = f"{digits} {numbers[-1].unit if numbers else ''}".rstrip()
        elif value is not None:
            values[key] = str(value)
    return values


def decision(view: View, asked: Asked) -> Section:
    """Decide on the limits: question, verdicts, what they stand on, drawing with the worst bushing marked, numbers."""
    verdict = headline(view, asked.accepted)
    leading = verdict.load if verdict else next(iter(view.leading), "")
    lives = life_verdicts(view, asked.accepted, asked.replay)
    standing = variations.applicable(view, asked.accepted)
    below = [sentences.still(standing), sentences.shop(view)] if standing and standing.rows else []
    head = Decision(
        question_of(view.store.study_text),
        lives if verdict is None and lives else [verdict or _without_verdict(view), *lives],
        _cards(view, verdict),
        place_of(view, leading, asked),
        answer.bars(standing) if standing and standing.rows else None,
        [line for line in below if line],
    )
    notes = map(Sentence, asked.notes)
    return Section("verdict", "Verdict", [head, *_points(view), *notes])


def _points(view: View) -> list[table.Table]:
    """Operating points, and of the joints that keep all limits there; none of a file with one point."""
    if len(view.parts) == 1:
        return []
    rows = []
    for part in view.parts:
        point = part.store.points[part.points[0]]
        row = {"point": point.name, "operation": point._replace(share=np.nan).in_words, "share": point.share}
        if part.sampled and part.limits and tells_yield(part):
            together = shares.together(shares.good(part), len(part.limits))
            row |= {"kept": together.value if together.decides else WORDS["none"]}
        rows.append(row)
    columns = (
        table.Column("point", shares.word("point")),
        table.Column("misalignment, speed, torque", shares.word("operation")),
        table.Column("of the time", shares.share("share"), shown=table.has("share")),
        table.Column("keep all limits there", lambda row: row.get("kept", WORDS["none"]), shown=table.has("kept")),
    )
    return [table.Table("points", "Operating points", columns, rows)]


def question_of(study: str) -> str:
    """Question of a study: the paragraph ``# Question: ...`` of its opening comment; empty if there is none."""
    opening = re.match(r"(?:#.*\n?)*", study)
    comment = "\n".join(line.lstrip("#").strip() for line in (opening[0] if opening else "").splitlines())
    question = re.search(r"^Question:\s*(.*?)(?=^\w[\w ]*:|\Z)", comment, flags=re.DOTALL | re.MULTILINE)
    return " ".join(question[1].split()) if question else ""


def _without_verdict(view: View) -> Verdict:
    why = "The study sets no limits" if view.sampled else f"Joints of a {METHODS[view.method]} are no sample"
    return Verdict("", "", f"{why}, so there is no verdict.")


def _cards(view: View, verdict: Verdict | None) -> list[Verdict]:
    """Unless the verdict says it, the yield and the limit exceeded most; next delivery, number of joints, errors."""
    cards = []
    if verdict is not None and tells_yield(view):
        row = shares.good(view)
        if verdict.answer:
            together = shares.together(row, len(view.limits))
            cards.append(Verdict("", together.value, together.words, ("Yield",)))
        if (interval := text.ends(row["next_lower"], row["next_upper"], ".0f")) != "-":
            exceeded = "at least one limit" if len(view.limits) > 1 else "the limit"
            exceeded += " or cannot be assembled" if row["scrap"] else ""
            predicted = f"of the next {row['delivery']} joints{view.design.of_delivery} exceed {exceeded}"
            cards.append(Verdict("", interval, predicted, ("95 % prediction interval",)))
    if verdict is not None and verdict.load and verdict.load not in verdict.words:
        most = next(row for row in exceedance.limit_rows(view) if row["load"] == verdict.load)
        label = f"exceed {text.value(most['level'], most['unit'])} on {most['load']}, the limit exceeded most"
        low, high = exceedance.ends(most)
        interval = "no interval" if np.isnan(low) else f"total interval {text.span(low, high)}"
        note = f"{shares.above(most)} joints with a valid load; {interval}"
        cards.append(Verdict("", exceedance.share_of(most), label, (note,)))
    return [*cards, *_basis(view)]


def _basis(view: View) -> list[Verdict]:
    counts = view.counts
    pending = counts.total - counts.done
    note = counts.shortfall + (f", {pending} still pending" if pending else "")
    whole = view.count(*VALID) == counts.total
    cards = [Verdict("" if whole else "open", str(counts.done), "joints simulated", (note,))]
    kinds = {loads.load_of(name, view.mechanism).kind.key for name in view.leading}
    usual = {k: error for k, error in view.numerical_error.items() if k in kinds and not np.isnan(error)}
    if usual and view.verification:
        kind = max(usual, key=lambda name: usual[name])
        label = f"numerical error of the largest loads ({accuracy.called_for_people(kind, view.mechanism)})"
        cards.append(Verdict("", accuracy.in_percent(usual[kind]), label, (accuracy.basis(view.verification),)))
    return cards
