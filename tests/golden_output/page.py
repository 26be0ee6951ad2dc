"""A page as text, section by section: headings, sentences, tables as rows, links; no pictures, scripts and styles."""

from __future__ import annotations

from html.parser import HTMLParser

SKIPPED = {"style", "script", "svg"}
BLOCKS = {
    *("p", "div", "section", "nav", "header", "footer", "main", "figure", "figcaption", "form", "fieldset", "details"),
    *("summary", "ul", "ol", "li", "dl", "table", "thead", "tbody", "tr", "h1", "h2", "h3", "h4", "pre", "label"),
}
"""Elements that begin and end a line."""


class _Page(HTMLParser):
    """Collects lines; `_line` is the one that is being written."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []
        self._line = ""
        self._skipped: list[str] = []
        self._as_it_is = False
        self._targets: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        own = dict(attrs)
        if tag in SKIPPED:
            self._skipped.append(tag)
        elif self._skipped:
            return
        elif tag in BLOCKS | {"dt"}:
            self._end_line()
        elif tag in {"td", "th"} and self._line:
            self._line += " | "
        elif tag == "dd":
            self._line += ": "
        elif tag in {"span", "small", "option", "button"} and self._line:
            self._line += " "
        elif tag == "a":
            self._targets.append(own.get("href") or "")
            self._line += "["
        elif tag == "img":
            self._line += f"(picture: {own.get('alt') or ''})"
        if tag == "section":
            self.lines += ["", f"[section {own.get('id')}]"]
        elif tag in {"h1", "h2", "h3", "h4"}:
            self._line = "#" * int(tag[1]) + " "
        elif tag == "li":
            self._line = "- "
        elif tag == "pre":
            self._as_it_is = True

    def handle_endtag(self, tag: str) -> None:
        if self._skipped:
            if tag == self._skipped[-1]:
                self._skipped.pop()
            return
        if tag == "a":
            self._line += f"]({self._targets.pop()})"
        elif tag in BLOCKS | {"dd", "title"}:
            self._end_line()
        if tag == "pre":
            self._as_it_is = False

    def handle_data(self, data: str) -> None:
        if self._skipped:
            return
        if self._as_it_is:
            *whole, self._line = (self._line + data).split("\n")
            self.lines += whole
        else:
            words = " ".join(data.split())
            before = " " if self._line and data[:1].isspace() and not self._line.endswith(" ") else ""
            self._line += before + words + (" " if words and data[-1:].isspace() else "")

    def _end_line(self) -> None:
        if self._line.strip(" -#"):
            self.lines.append(self._line.rstrip())
        self._line = ""


def as_text(html: str) -> str:
    """Text of a page."""
    page = _Page()
    page.feed(html)
    page.close()
    return "\n".join(page.lines)
