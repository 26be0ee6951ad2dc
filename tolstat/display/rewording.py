"""Answers and pages told with the word for their rows, see `common.wording`; numbers and keys stay as they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from tolstat.common.wording import AS_WRITTEN, Wording
from tolstat.display.answer import Answer, Axes, Figure, Panel, Panels, Sentence, Sheet, Table
from tolstat.display.blocks import Decision, Page, Reader, Section
from tolstat.display.style import ticker
from tolstat.display.table import Column
from tolstat.display.verdict import Verdict


def answer(found: Answer, wording: Wording) -> Answer:
    """Tell an answer."""
    if wording == AS_WRITTEN:
        return found
    title = found.title if found.title in wording.names else wording(found.title)
    return Answer(found.name, title, [block(part, wording) for part in found.parts], values(found.facts, wording))


def page(composed: Page, wording: Wording) -> Page:
    """Tell a page; its title, description, scene and listings are the user's, or about the nominal joint."""
    if wording == AS_WRITTEN:
        return composed
    sections = [
        Section(each.key, wording(each.title), [block(one, wording) for one in each.blocks], each.folded)
        for each in composed.sections
    ]
    return replace(composed, sections=sections, provenance=wording(composed.provenance), wording=wording)


def values(found: Mapping[str, Any], wording: Wording) -> dict[str, Any]:
    """Tell the sentences in JSON values: keys and single words stay as they are."""
    return {key: _value(value, wording) for key, value in found.items()}


def block(part: Any, wording: Wording) -> Any:
    """Tell a part of an answer, or a block of a page; documents, listings and provenance stay as they are."""
    told = part
    if isinstance(part, Sentence):
        told = replace(part, text=wording(part.text))
    elif isinstance(part, Table):
        columns = [_column(column, wording) for column in part.columns]
        told = replace(part, title=wording(part.title), columns=columns)
    elif isinstance(part, Panels):
        panels, beside = ([block(one, wording) for one in group] for group in (part.panels, part.beside))
        told = replace(part, panels=panels, beside=beside)
    elif isinstance(part, Panel):
        told = _panel(part, wording)
    elif isinstance(part, Sheet):
        told = replace(part, draw=lambda: _figure(part.draw(), wording))
    elif isinstance(part, Reader):
        told = replace(part, wording=wording)
    elif isinstance(part, Decision):
        told = _decision(part, wording)
    return told


def _value(value: Any, wording: Wording) -> Any:
    if isinstance(value, dict):
        return values(value, wording)
    if isinstance(value, list):
        return [_value(one, wording) for one in value]
    return wording(value) if isinstance(value, str) and " " in value else value


def _column(column: Column, wording: Wording) -> Column:
    return column._replace(head=wording(column.head), cell=lambda row: wording(column.cell(row)))


def _decision(part: Decision, wording: Wording) -> Decision:
    verdicts, cards = ([_verdict(each, wording) for each in group] for group in (part.verdicts, part.cards))
    picture, chart = (block(panel, wording) for panel in (part.picture, part.chart))
    below = list(map(wording, part.below))
    return replace(part, verdicts=verdicts, cards=cards, picture=picture, chart=chart, below=below)


def _verdict(verdict: Verdict, wording: Wording) -> Verdict:
    notes = tuple(map(wording, verdict.notes))
    return verdict._replace(value=wording(verdict.value), words=wording(verdict.words), notes=notes)


def _panel(panel: Panel, wording: Wording) -> Panel:
    def draw(ax: Axes) -> None:
        panel.draw(ax)
        _axes(ax, wording)

    switches = [(name, wording(words)) for name, words in panel.switches]
    title, description, rows = wording(panel.title), wording(panel.description), list(map(wording, panel.rows))
    return replace(panel, title=title, description=description, draw=draw, rows=rows, switches=switches)


def _figure(figure: Figure, wording: Wording) -> Figure:
    """Tell all texts of a figure that is complete."""
    for ax in figure.axes:
        _labels_of_rows(ax, wording)
    texts: Any = figure.findobj(lambda artist: hasattr(artist, "set_text"))
    for words in texts:
        words.set_text(wording(words.get_text()))
    return figure


def _axes(ax: Axes, wording: Wording) -> None:
    """Tell the texts of a picture, and the names in its legend, which is made later."""
    _labels_of_rows(ax, wording)
    for words in (ax.xaxis.label, ax.yaxis.label, *ax.texts):
        words.set_text(wording(words.get_text()))
    for artist in ax.get_legend_handles_labels()[0]:
        artist.set_label(wording(str(artist.get_label())))


def _labels_of_rows(ax: Axes, wording: Wording) -> None:
    for axis in (ax.xaxis, ax.yaxis):
        formatter = axis.get_major_formatter()
        if isinstance(formatter, ticker.FixedFormatter):
            formatter.seq = list(map(wording, formatter.seq))
