"""The page of the paper's study: printed and computed side by side, one HTML file with its pictures inside."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any, NamedTuple

import jinja2
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

import tolstat
from studies.cirelli2021 import choices as paper_choices
from studies.cirelli2021 import distances as paper_distances
from studies.cirelli2021 import page_checks as paper_checks
from studies.cirelli2021 import page_choices_figures as paper_choices_figures
from studies.cirelli2021 import page_curves as paper_curves
from studies.cirelli2021 import page_equations as paper_equations
from studies.cirelli2021 import tables as paper
from studies.cirelli2021.page_main import revolutions
from studies.cirelli2021.page_source import PaperStudy
from tolstat.common.files import write_text
from tolstat.display import style, text

DPI = 110
REPRODUCED = 0.5
"""Mean distance at which a joint would be said to give the printed tables, percentage points."""
KEYS = {"contact.D_P": "clearance", "cross.R": "R", "cross.r_b": "r_b", "arm.l_f": "fork lever"}


class Cell(NamedTuple):
    """One entry of Tables 4 to 7: printed and computed Gamma (per cent), and whether they are far apart."""

    printed: float
    computed: float
    apart: str


class Line(NamedTuple):
    """One line of a table: printed case, direction that comes nearest, ties, mean distance, entries F, T by bushing."""

    case: str
    direction: str
    ties: tuple[str, ...]
    distance: float
    cells: list[Cell]


class Grid(NamedTuple):
    """One of Tables 4 to 7."""

    number: int
    title: str
    bushings: list[str]
    lines: list[Line]


class Alternative(NamedTuple):
    """A joint of the study beside the printed tables."""

    name: str
    values: str
    objective: float
    distances: list[paper_distances.Distance]
    cases: str
    settled: str


def write(study: PaperStudy, path: Path) -> None:
    """Write the page.

    Parameters
    ----------
    study : PaperStudy
        The study; every number and picture comes from it, the printed values from the package's data.
    path : Path
        HTML file.
    """
    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    environment = jinja2.Environment(loader=loader, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    environment.filters["picture"] = _picture
    environment.filters["number"] = _number
    page = environment.get_template("paper.html.j2").render(context(study))
    write_text(path, page)


def context(study: PaperStudy) -> dict[str, Any]:
    """Everything that the template shows."""
    angles = [float(a) for a in paper.printed().alpha]
    return {
        "study": study,
        "version": tolstat.__version__,
        "answers": study.answers,
        "laws": study.laws,
        "grids": grids(study),
        "distances": paper_distances.distances(study.computed),
        "signed": signed(study),
        "signed_distances": paper_distances.distances(paper.tabulated(study.main.gamma, study.signed), signed=True),
        "contradictions": study.contradictions(),
        "exclusions": study.exclusions(),
        "alternatives": [alternative(study, v) for v in singles(study)],
        "search": search(study),
        "no_effect": paper_choices.no_effect(),
        "misprints": paper_checks.misprints(study),
        "equations": equations(study),
        "figures": figures(study, angles),
    }


def equations(study: PaperStudy) -> dict[str, Any]:
    """Equations and Tables 1 to 3."""
    joint, of = study.joint, paper_equations
    tables = {"elastic": of.elastic(joint), "contact": of.contact(joint), "stiffness": of.stiffness(joint)}
    values = {"bushings": of.bushings(joint), "ratios": of.ratios(study), "damping": of.damping(study)}
    linkages = {"mobility": of.mobility(study), "linkage": of.linkage(study)}
    return {"fit_load": of.hertz(joint)[0], "xi": joint.bushing.xi} | tables | values | linkages


def signed(study: PaperStudy) -> list[tuple[paper.Match, paper.Match]]:
    """Nearest direction of each printed case by the modulus of Gamma, and with its sign."""
    return list(zip(study.matches, study.signed, strict=True))


def search(study: PaperStudy) -> dict[str, Any] | None:
    """What the search came to; None where the study has none."""
    members, keys = study.searched()
    if not members:
        return None
    best = min((f for f in study.fits if np.isfinite(f.objective)), key=lambda fit: fit.objective)
    laws = list(dict.fromkeys(str(study.variants[v].values.get("contact.law", "")) for v in members))
    return {
        "joints": len(members),
        "keys": [KEYS.get(key, key) for key in keys] + (["contact law"] if len(laws) > 1 else []),
        "best": alternative(study, best.variant),
        "found": best.objective <= REPRODUCED,
        "own": next(f.objective for f in study.fits if f.variant == 0),
    }


def figures(study: PaperStudy, angles: list[float]) -> dict[str, tuple[str, Figure]]:
    """All pictures by name, with the text that stands in for each."""
    straight, bent = angles
    return {
        "contact": ("Contact force against displacement", paper_choices_figures.contact(study)),
        "psi": ("Error of the speed ratio over the input angle", paper_curves.speed_ratio(study)),
        "cross0": ("Cross bushings at 0 degrees", paper_curves.bushings(study, (0, 1), straight, "13, 14")),
        "cross15": ("Cross bushings at 15 degrees", paper_curves.bushings(study, (0, 1), bent, "15, 16")),
        "fork0": ("Output fork bushings at 0 degrees", paper_curves.bushings(study, (6, 7), straight, "17, 18")),
        "fork15": ("Output fork bushings at 15 degrees", paper_curves.bushings(study, (6, 7), bent, "19, 20")),
        "springs": ("Contact springs at 15 degrees", paper_curves.springs(study, bent)),
        "spectra": ("Amplitudes at multiples of the input speed", paper_choices_figures.spectra(study, bent)),
    } | _choices(study)


def _choices(study: PaperStudy) -> dict[str, tuple[str, Figure]]:
    found = {}
    if study.sweeps():
        found["sweeps"] = ("Gamma against each unprinted value", paper_choices_figures.sweeps(study))
    if study.searched()[0]:
        found["search"] = ("Distance from the tables over the search", paper_choices_figures.search(study))
    return found


def grids(study: PaperStudy) -> list[Grid]:
    """Tables 4 to 7, computed beside printed."""
    table = paper.printed()
    found = []
    for column, part in enumerate((paper.CROSS, paper.FORK)):
        for a, alpha in enumerate(table.alpha):
            lines = []
            for c, case in enumerate(table.cases):
                match = next(m for m in study.matches if m.printed == case and abs(m.alpha - alpha) < paper.SAME_ALPHA)
                pairs = zip(table.gamma[c, a, part].flat, study.computed[c, a, part].flat, strict=True)
                cells = [_cell(float(p), float(x)) for p, x in pairs]
                lines.append(Line(case, match.case, match.ties, match.distance, cells))
            title = f"{'cross' if column == 0 else 'fork'} bushings, α = {np.degrees(alpha):.0f}°"
            found.append(Grid(int(table.tables[a, column]), title, list(paper.BUSHINGS[part]), lines))
    return sorted(found)


def _cell(printed: float, computed: float) -> Cell:
    far = abs(abs(computed) - printed)
    return Cell(printed, computed, "near" if far <= 2.0 else "mid" if far <= 8.0 else "far")


def singles(study: PaperStudy) -> list[int]:
    """Variants that are alone in their family: contact laws, the joint as printed."""
    return [v for v, family in enumerate(study.families) if study.families.count(family) == 1]


def alternative(study: PaperStudy, variant: int) -> Alternative:
    """One joint of the study beside the printed tables."""
    here = study.variant == variant
    found = paper.nearest(study.gamma[here], study.case[here], study.alpha[here], study.cases)
    fit = next(f for f in study.fits if f.variant == variant)
    turns = revolutions(study.results[here])
    done = turns[np.isfinite(turns)]
    settled = f"{done.size} of {turns.size}, most {done.max(initial=0.0):.1f} rev"
    values = ", ".join(_value(key, value) for key, value in study.variants[variant].values.items() if value is not None)
    distances = paper_distances.distances(paper.tabulated(study.gamma[here], found))
    family = study.families[variant]
    return Alternative(family, values or "the joint file", fit.objective, distances, ", ".join(fit.cases), settled)


def _value(key: str, value: Any) -> str:
    if isinstance(value, float):
        lengths = ("contact.D_P", "cross.R", "cross.r_b", "arm.l_f")
        return f"{key} = {1e3 * value:.2f} mm" if key in lengths else f"{key} = {value:.4g}"
    return f"{key} = {value}"


def _number(value: float, form: str) -> str:
    """A number, a dash where there is none, and never a minus before zero."""
    if not np.isfinite(value):
        return "–"
    text = form % value
    return text if float(text) else form.replace("+", "") % 0.0  # no "-0.0"


def _picture(figure: Figure) -> str:
    """Figure as base64 PNG."""
    buffer = io.BytesIO()
    with style.settings():
        figure.savefig(buffer, format="png", dpi=DPI)
    return base64.b64encode(buffer.getvalue()).decode("ascii")


def summary(study: PaperStudy) -> str:
    """Text for standard output: distances of the tables, then the answers."""
    rows = [["table", "median", "mean", "worst", "rank correlation"]]
    for d in paper_distances.distances(study.computed):
        values = [f"{x:.2f}" for x in (d.median, d.mean, d.worst, d.correlation)]
        rows.append([d.label, *values])
    said = [f"{'yes' if a.yes else 'no ':3}  {a.claim}\n     {a.figures}" for a in study.answers]
    head = "|Gamma| against the printed tables, nearest directions, percentage points"
    return "\n".join([head, text.align(rows), "", *said])


def entries(study: PaperStudy) -> pd.DataFrame:
    """Tables 4 to 7 in long form: printed and computed, one row an entry; Gamma in per cent, computed with its sign."""
    rows = []
    for grid in grids(study):
        for line in grid.lines:
            for k, cell in enumerate(line.cells):
                place = (grid.number, line.case, line.direction, grid.bushings[k // 2])
                rows.append((*place, ("Gamma_F", "Gamma_T")[k % 2], cell.printed, cell.computed))
    return pd.DataFrame(rows, columns=["table", "case", "direction", "bushing", "load", "printed", "computed"])
