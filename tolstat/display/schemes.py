"""Colours of the page: a CSS variable and a dark value for each colour that its pictures are drawn with."""

from __future__ import annotations

import re
from typing import NamedTuple

from tolstat.display import style


class Colour(NamedTuple):
    """One colour: name of its CSS variable, and its value in the dark scheme."""

    variable: str
    dark: str


COLOURS = {
    "#ffffff": Colour("paper", "#16171a"),
    style.INK: Colour("ink", "#e8e8ea"),
    "#666666": Colour("soft", "#a9adb5"),
    style.FAINT: Colour("faint", "#8d929b"),
    "#b8b8b8": Colour("grey", "#6b7079"),
    "#e2e2e2": Colour("grid", "#33363c"),
    "#e6e6e6": Colour("pale", "#41454d"),
    style.COLOURS[0].lower(): Colour("line1", "#58aee6"),
    style.COLOURS[1].lower(): Colour("line2", "#f08c4e"),
    style.COLOURS[2].lower(): Colour("line3", "#3fbf93"),
    style.COLOURS[3].lower(): Colour("line4", "#b3dcf7"),
    "#c04a00": Colour("marked", "#ff9552"),
    "#cfe4f3": Colour("cross", "#24465e"),
    "#f6dfc6": Colour("input", "#5c4527"),
    "#cdebdd": Colour("output", "#24513d"),
} | {
    light: Colour(f"shade{i}", dark)
    for i, (light, dark) in enumerate(zip(style.SHADES, style.DARK_SHADES, strict=True))
}
"""Colours of the page's pictures, as matplotlib writes them."""


def with_variables(svg: str) -> str:
    """Replace the colours of an SVG by CSS variables; `style_sheet` gives their values.

    Colours that are not in `COLOURS` stay as they are in both schemes.
    """
    svg = re.sub(r' fill="(#[0-9a-f]{6})"', r' style="fill: \1"', svg)
    return re.sub(r'style="[^"]+"', lambda own: re.sub("#[0-9a-f]{6}", _variable, own[0]), svg)


def _variable(found: re.Match[str]) -> str:
    return f"var(--{COLOURS[found[0]].variable})" if found[0] in COLOURS else found[0]


def style_sheet() -> str:
    """CSS that defines the variables: light, and dark on a screen whose reader prefers it."""
    light = "; ".join(f"--{colour.variable}: {value}" for value, colour in COLOURS.items())
    dark = "; ".join(f"--{colour.variable}: {colour.dark}" for colour in COLOURS.values())
    return f":root {{ {light}; }}\n@media screen and (prefers-color-scheme: dark) {{ :root {{ {dark}; }} }}"
