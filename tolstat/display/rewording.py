"""Answers and pages told with the word for their rows, see `common.wording`; numbers and keys stay as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

from tolstat.common.wording import AS_WRITTEN, Wording
from tolstat.display.answer import Answer, Axes, Figure, Panel, Panels, Sentence, Sheet, Table
from tolstat.display.blocks import Decision, Page, Reader, Section
from tolstat.display.style import ticker
from tolstat.display.table import Column
from tolstat.display.verdict import Verdict

WORDS: Mapping[type, tuple[str, ...]] = {
    Answer: ("parts",),
    Page: ("sections", "provenance"),
    Section: ("title", "blocks"),
    Sentence: ("text",),
    Table: ("title", "columns"),
    Column: ("head",),
    Panels: ("panels", "beside"),
    Panel: ("title", "description", "rows"),
    Decision: ("verdicts", "cards", "picture", "chart", "below"),
    Verdict: ("value", "words", "notes"),
}
"""Attributes that are told, by type; those of other types, documents and listings, stay as they are."""


def answer(found: Answer, wording: Wording) -> Answer:
    """Tell an answer."""
    if wording == AS_WRITTEN:
        return found
    title = found.title if found.title in wording.names else wording(found.title)
    told: Answer = _told(found, wording)
    return replace(told, title=title, facts=values(found.facts, wording))


def page(composed: Page, wording: Wording) -> Page:
    """Tell a page; its title, description, scene and listings are the user's, or about the nominal joint."""
    told: Page = composed if wording == AS_WRITTEN else _told(composed, wording)
    return told


def values(found: Mapping[str, Any], wording: Wording) -> dict[str, Any]:
    """Tell the sentences in JSON values: keys and single words stay as they are."""
    return {key: _value(value, wording) for key, value in found.items()}


def _value(value: Any, wording: Wording) -> Any:
    if isinstance(value, dict):
        return values(value, wording)
    if isinstance(value, list):
        return [_value(one, wording) for one in value]
    return wording(value) if isinstance(value, str) and " " in value else value


def _told(found: Any, wording: Wording) -> Any:
    """Tell a text, each of several, or a part of an answer or page by its attributes `WORDS`."""
    if isinstance(found, str):
        return wording(found)
    if type(found) in (list, tuple):
        return type(found)(_told(one, wording) for one in found)
    changes = {name: _told(getattr(found, name), wording) for name in WORDS.get(type(found), ())}
    match found:
        case Column():
            return found._replace(**changes, cell=lambda row: wording(found.cell(row)))
        case Verdict():
            return found._replace(**changes)
        case Panel():
            switches = [(name, wording(words)) for name, words in found.switches]
            return replace(found, **changes, draw=partial(_draw, found, wording), switches=switches)
        case Sheet():
            return replace(found, draw=lambda: _figure(found.draw(), wording))
        case Page() | Reader():
            return replace(found, **changes, wording=wording)
    return replace(found, **changes) if changes else found


def _draw(panel: Panel, wording: Wording, ax: Axes) -> None:
    """Draw a picture, and tell its texts and the names in its legend, which is made later."""
    panel.draw(ax)
    _labels_of_rows(ax, wording)
    for words in (ax.xaxis.label, ax.yaxis.label, *ax.texts):
        words.set_text(wording(words.get_text()))
    for artist in ax.get_legend_handles_labels()[0]:
        artist.set_label(wording(str(artist.get_label())))


def _figure(figure: Figure, wording: Wording) -> Figure:
    """Tell all texts of a figure that is complete."""
    for ax in figure.axes:
        _labels_of_rows(ax, wording)
    texts: Any = figure.findobj(lambda artist: hasattr(artist, "set_text"))
    for words in texts:
        words.set_text(wording(words.get_text()))
    return figure


def _labels_of_rows(ax: Axes, wording: Wording) -> None:
    for axis in (ax.xaxis, ax.yaxis):
        formatter = axis.get_major_formatter()
        if isinstance(formatter, ticker.FixedFormatter):
            formatter.seq = list(map(wording, formatter.seq))
