"""The page on paper: the same parts on A4 sheets by matplotlib, so that no browser is needed."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.ft2font import FT2Font, LoadFlags
from matplotlib.patches import Rectangle

from tolstat.common.files import writing
from tolstat.display import drawing, style
from tolstat.display.blocks import Block, Card, Cards, Facts, Listing, Page, Panel, Panels, Table, Text

WIDTH, HEIGHT, MARGIN = 8.27, 11.69, 0.7
"""A sheet and its margins, inches."""
INNER = WIDTH - 2.0 * MARGIN
SCALE = 0.66
"""Of the pictures: two of them stand beside each other."""
GAP = 0.22
SOFT, LINE, TINT = "#55585e", "#c9ccd1", "#f5f6f8"
EDGE = {"yes": "#00704F", "no": "#B84A00", "open": "#8a8d93", "": style.COLOURS[0]}
SANS, MONO = "DejaVu Sans", "DejaVu Sans Mono"


def write(page: Page, path: Path) -> None:
    """Write a page as PDF; the same page gives the same bytes.

    Parameters
    ----------
    page : Page
        The page; its reader, which needs a screen, is left out.
    path : Path
        PDF file.
    """
    metadata = {"Title": f"{page.title}: report", "CreationDate": None, "Creator": "tolstat", "Producer": None}
    with writing(path) as temporary, drawing.settings(SCALE), PdfPages(temporary, metadata=metadata) as file:
        sheets = _Sheets(file, page.title)
        sheets.text(page.title, 18, bold=True)
        sheets.text(page.subtitle, 8, SOFT)
        for section in page.sections:
            sheets.heading(section.title)
            for block in section.blocks:
                _put(sheets, block)
        sheets.end()


def _put(sheets: _Sheets, block: Block) -> None:
    match block:
        case Text():
            sheets.text(block.text, 7.2 if block.small else 9, SOFT if block.small else style.INK)
        case Cards():
            sheets.cards(block.cards)
        case Table():
            sheets.table(block)
        case Panels():
            sheets.panels(block.panels)
        case Facts():
            for name, value in block.items:
                sheets.text(f"{name}: {value}", 7.2)
        case Listing():
            sheets.text(block.title, 8.5, bold=True)
            for line in block.text.splitlines():
                sheets.text(line or " ", 6, font=MONO, after=0.0)


@cache
def _advances(bold: bool, font: str) -> tuple[FT2Font, dict[str, float]]:
    """A font, and how far each letter asked for so far takes the pen, in parts of the size."""
    found = findfont(FontProperties(family=font, weight="bold" if bold else "normal"))
    return get_font(found), {}


def _width(text: str, size: float, bold: bool = False, font: str = SANS) -> float:
    """Width of a text in inches, kerning left out."""
    face, advances = _advances(bold, font)
    for letter in set(text) - advances.keys():
        glyph = face.load_char(ord(letter), flags=LoadFlags.NO_SCALE)
        advances[letter] = glyph.horiAdvance / face.units_per_EM
    return size / 72.0 * sum(advances[letter] for letter in text)


def _wrap(text: str, size: float, width: float, bold: bool = False, font: str = SANS) -> list[str]:
    """Break a text into lines no wider than `width`; a word too long for a line is cut."""
    lines = [""]
    for word in text.split(" "):
        joined = f"{lines[-1]} {word}" if lines[-1] else word
        if _width(joined, size, bold, font) <= width:
            lines[-1] = joined
            continue
        if lines[-1]:
            lines.append("")
        while _width(word, size, bold, font) > width and len(word) > 1:
            fit = next(k for k in range(len(word) - 1, 0, -1) if k == 1 or _width(word[:k], size, bold, font) <= width)
            lines[-1:] = [word[:fit], ""]
            word = word[fit:]
        lines[-1] = word
    return lines


class _Sheets:
    """Sheets that are filled from top to bottom; `y` is how far down the current one is full, inches."""

    def __init__(self, file: PdfPages, name: str) -> None:
        self._file: Any = file  # figures can be saved to it, which matplotlib's annotations do not know
        self._name, self._number = name, 0
        self._new()

    def _new(self) -> None:
        self.figure, self.y = Figure(figsize=(WIDTH, HEIGHT)), MARGIN
        self._number += 1

    def end(self) -> None:
        """Finish the current sheet."""
        self._write(MARGIN, HEIGHT - 0.45, f"{self._name}    {self._number}", 6.5, SOFT)
        self.figure.savefig(self._file, format="pdf")

    def room(self, height: float) -> None:
        """Begin a new sheet where less than `height` is left on this one."""
        if self.y + height > HEIGHT - MARGIN and self.y > MARGIN:
            self.end()
            self._new()

    def _write(
        self,
        x: float,
        y: float,
        text: str,
        size: float,
        colour: str,
        bold: bool = False,
        font: str = SANS,
        ha: str = "left",
    ) -> None:
        """Write one line, its upper edge at `y`."""
        weight = "bold" if bold else "normal"
        place = (x / WIDTH, 1.0 - (y + 0.8 * size / 72.0) / HEIGHT)
        self.figure.text(*place, text, size=size, color=colour, weight=weight, family=font, ha=ha, va="baseline")

    def _box(self, x: float, y: float, width: float, height: float, colour: str) -> None:
        corner = (x / WIDTH, 1.0 - (y + height) / HEIGHT)
        self.figure.add_artist(Rectangle(corner, width / WIDTH, height / HEIGHT, color=colour, lw=0))

    def text(
        self, text: str, size: float, colour: str = style.INK, bold: bool = False, font: str = SANS, after: float = 0.07
    ) -> None:
        """Write a paragraph."""
        step = 1.4 * size / 72.0
        for line in _wrap(text, size, INNER, bold, font):
            self.room(step)
            self._write(MARGIN, self.y, line, size, colour, bold, font)
            self.y += step
        self.y += after

    def heading(self, title: str) -> None:
        """Begin a section."""
        self.room(2.4)
        self.y += 0.16 if self.y > MARGIN else 0.0
        self._box(MARGIN, self.y, INNER, 0.015, style.INK)
        self.y += 0.09
        self.text(title, 13, bold=True, after=0.1)

    def cards(self, cards: Sequence[Card]) -> None:
        """Put the figures of the headline beside each other."""
        width = (INNER - GAP * (len(cards) - 1)) / len(cards)
        inner = width - 0.22
        parts = [(_wrap(c.label, 7.2, inner), _wrap(c.note, 6.4, inner)) for c in cards]
        height = max(0.34 + 0.14 * len(label) + 0.125 * len(note) for label, note in parts) + 0.06
        self.room(height)
        for k, (card, (label, note)) in enumerate(zip(cards, parts, strict=True)):
            x, y = MARGIN + k * (width + GAP), self.y
            self._box(x, y, 0.05, height, EDGE[card.verdict])
            self._write(x + 0.14, y + 0.03, card.value, 14, style.INK, bold=True)
            y += 0.32
            for lines, size, colour, step in ((label, 7.2, style.INK, 0.14), (note, 6.4, SOFT, 0.125)):
                for line in lines:
                    self._write(x + 0.14, y, line, size, colour)
                    y += step
        self.y += height + 0.14

    def panels(self, panels: Sequence[Panel]) -> None:
        """Put pictures beside each other, two in a row."""
        for first in range(0, len(panels), 2):
            row = panels[first : first + 2]
            height = max(panel.size[1] for panel in row) * SCALE + 0.2
            self.room(height)
            for k, panel in enumerate(row):
                width, tall = (SCALE * side for side in panel.size)
                x = MARGIN + k * 0.5 * (INNER + GAP)
                self._write(x, self.y, panel.title, 7.8, style.INK, bold=True)
                left, bottom, wide, high = drawing.place(panel)
                foot = HEIGHT - self.y - 0.2 - tall
                box = ((x + left * width) / WIDTH, (foot + bottom * tall) / HEIGHT)
                panel.draw(self.figure.add_axes((*box, wide * width / WIDTH, high * tall / HEIGHT)))
            self.y += height + 0.08

    def table(self, table: Table) -> None:
        """Write a table, as small as it must be, its head on every sheet."""
        for size in (7.0, 6.4, 5.8, 5.2, 4.6):
            widths = _columns(table, size)
            if sum(widths) <= INNER:
                break
        wide = max(range(len(widths)), key=lambda k: widths[k])
        widths[wide] -= max(0.0, sum(widths) - INNER)  # the widest column is wrapped where nothing else helps
        step = 1.45 * size / 72.0
        cut = [max(width - 0.12, 0.2) for width in widths]
        head = [_wrap(cell, size, cut[k], bold=True) for k, cell in enumerate(table.head)]
        self.room(0.25 + step * (max(map(len, head)) + 3))
        self.text(table.title, 7.8, bold=True, after=0.03)
        self._row(table, head, widths, size, step, head=True)
        for i, row in enumerate(table.rows):
            cells = [_wrap(cell, size, cut[k]) for k, cell in enumerate(row)]
            if self.y + step * max(map(len, cells)) + 0.04 > HEIGHT - MARGIN:
                self.room(HEIGHT)
                self._row(table, head, widths, size, step, head=True)
            self._row(table, cells, widths, size, step, verdict=table.verdicts[i] if table.verdicts else "")
        self.y += 0.14

    def _row(
        self,
        table: Table,
        cells: list[list[str]],
        widths: list[float],
        size: float,
        step: float,
        head: bool = False,
        verdict: str = "",
    ) -> None:
        height = step * max(map(len, cells)) + 0.03
        if head:
            self._box(MARGIN, self.y, sum(widths), height, TINT)
        x = MARGIN
        for k, (lines, width) in enumerate(zip(cells, widths, strict=True)):
            left = k in table.words
            last = verdict and k == len(cells) - 1
            for i, line in enumerate(lines):
                place = x + 0.06 if left else x + width - 0.06
                colour = EDGE[verdict] if last else style.INK
                bold = head or bool(last)
                self._write(place, self.y + 0.02 + i * step, line, size, colour, bold, ha="left" if left else "right")
            x += width
        self.y += height
        self._box(MARGIN, self.y, sum(widths), 0.006, LINE)
        self.y += 0.006


def _columns(table: Table, size: float) -> list[float]:
    """Widths of the columns, inches: those of the cells, and of the longest word of the heading."""
    widths = []
    for k, name in enumerate(table.head):
        longest = max((_width(row[k], size) for row in table.rows), default=0.0)
        word = max((_width(word, size, True) for word in name.split(" ")), default=0.0)
        half = 0.55 * _width(name, size, True)  # a heading of two lines is no harm
        widths.append(max(longest, word, half) + 0.13)
    return widths
