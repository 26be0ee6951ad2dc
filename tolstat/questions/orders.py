"""Amplitudes of the shafts' loads at multiples of the input speed, and orbits of their lateral forces."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from tolstat.analysis.sample import Sample
from tolstat.common.columns import result_columns
from tolstat.common.errors import InputError, NotApplicable
from tolstat.common.load_kinds import EXPONENTS, ORDERS, kinds
from tolstat.common.loads import AT, FloatArray, load_of, loads_of
from tolstat.common.tables import VALID
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Part, Row, Rows, Sentence, Table, has
from tolstat.questions.shares import ORIGIN, unusable, value, values, with_ends, word
from tolstat.store import revolutions
from tolstat.store.view import View

SHARES = {"q5": 0.05, "qmedian": 0.5, "q95": 0.95}
"""Shares of the joints at which quantiles of an amplitude are given, by key."""
NEAR = {"median": 0.5, "95 %": 0.95}
"""Quantiles of the largest lateral force; the orbit of the joint nearest to each is shown."""
INTRODUCTION = (
    "Amplitudes of the loads on the shafts and of Ψ at multiples of the input speed. Forces and moments across a shaft "
    "are taken in axes that do not turn; there the vector of one order moves on an ellipse, whose semi-major axis is "
    "the amplitude. An orbit also holds the mean force; its dot is the input angle 0, its arrow points on."
)
SMALL = 0.05
"""Orbits below this part of the largest one are too small for an arrow."""
LOOKS: dict[str, tuple[str, str, style.Dash]] = {
    "nominal": ("nominal joint", style.INK, style.DASHES[2]),
    "median": ("near median", style.COLOURS[0], style.DASHES[0]),
    "95 %": ("near 95 %", style.COLOURS[1], style.DASHES[0]),
}
"""Label, colour and dash of the orbits, by `Orbit.near`."""


class Orbit(NamedTuple):
    """Lateral force on a shaft over the last revolution, in axes that do not turn.

    Attributes
    ----------
    shaft : str
        Name of the shaft: ``"input"``.
    near : str
        Which joint: ``"nominal"``, or the name in `NEAR` of the quantile that its largest lateral force is nearest to.
    row : int
        Row of the joint in the campaign.
    point : str
        Operating point: of several the one at which the lateral force matters most.
    force : ndarray, shape (k, 2)
        Components f_x (in the plane of both shafts) and f_y (normal to it), N, at equally spaced input angles from 0.
    """

    shaft: str
    near: str
    row: int
    point: str
    force: FloatArray

    @property
    def label(self) -> str:
        """Which joint, in words."""
        return LOOKS[self.near][0]

    @property
    def largest(self) -> float:
        """Largest force, N."""
        return float(np.linalg.norm(self.force, axis=1).max())


COLUMNS = (
    Column("amplitude", word("load")),
    Column("nominal joint", value("nominal")),
    Column("5 %", value("q5")),
    Column("interval of 5 %", values("q5_lower", "q5_upper"), shown=has("q5_lower"), rank=3),
    Column("median", value("qmedian")),
    Column("interval of median", values("qmedian_lower", "qmedian_upper"), shown=has("qmedian_lower"), rank=2),
    Column("95 %", value("q95")),
    Column("interval of 95 %", values("q95_lower", "q95_upper"), shown=has("q95_lower"), rank=1),
)
"""Columns of the table ``amplitudes``: quantiles over the joints with their intervals."""
BEARING_COLUMNS = (Column("equivalent load", word("load")), *COLUMNS[1:])
"""Columns of the table ``bearings``."""


def orders(view: View, orbits: bool = False) -> Answer:
    """Estimate the orders of the loads that the shafts carry.

    Gives the amplitudes of lateral force, bending moment, driving torque and speed error at one to four times the
    input speed: of the nominal joint, and their 5, 50 and 95 % quantiles over the joints with 95 % intervals. Of
    bearings of shafts also the equivalent loads over the duty cycle, with exponents 3 and 10/3; without shares of the
    operating points those at each. With --orbits also the orbits of the lateral forces in axes that do not turn. --out
    writes pictures of them.

    Example: tolstat orders iso2768_f.h5 --orbits --out orders

    Parameters
    ----------
    view : View
        A campaign.
    orbits : bool
        Read the orbits of the lateral forces, too; joints without histories of them are simulated again.

    Returns
    -------
    Answer
        Table ``amplitudes``, one row per quantity and order that the study keeps, SI: ``quantity``
        (``input.lateral``), ``noun``, ``order``, ``load`` (``input.lateral_2x``), ``unit``; ``nominal`` (NaN without a
        nominal joint); ``q5``, ``qmedian``, ``q95`` (amplitude that this share of the joints does not exceed), each
        with ``_lower`` and ``_upper``, which are NaN for dependent samples; too few joints give 0 and infinity. Table
        ``bearings``, likewise, where the bearings of shafts are given: their equivalent loads over the duty cycle, by
        shares of the revolutions, with exponent 3 for balls and 10/3 for rollers. With
        `orbits` table ``orbits``, one row per point: ``shaft``, ``near``, ``row``, ``point`` as in `Orbit`, ``theta``
        (input angle), ``f_x``, ``f_y``. Facts ``joints`` and ``left_out``: joints with and without a valid result,
        those pending not counted; ``origin`` and ``apart`` of the orbits, see `store.revolutions.Revolutions`.

    Raises
    ------
    StoreError
        When the study keeps no amplitude, no joint has a valid result, or the file holds levels of a subset simulation.
    InputError
        When a joint has to be simulated again and this version cannot read the file's joint or options.
    """
    kind_of = {name: load.kind for name, load in loads_of(view.mechanism).items()}
    names = [name for name in view.kept_loads if kind_of[name].orders]
    if not names:
        remedy = 'let [output] results of the study select them, such as "*_1x_max", and run it again'
        raise unusable(view, "holds no amplitudes of orders", remedy)
    joints = view.count(*VALID)
    if not joints:
        raise unusable(view, "has no joint with a valid result", "resume the campaign")
    in_order = list(kinds(view.mechanism))
    rows = [_amplitude(view, name) for name in sorted(names, key=lambda name: in_order.index(kind_of[name].key))]
    facts: dict[str, Any] = {"joints": joints, "left_out": view.counts.done - joints}
    parts: list[Part] = [Table("amplitudes", "Amplitudes over the joints", COLUMNS, rows)]
    bearings = _bearings(view)
    if bearings:
        over = "at each operating point" if any(AT in row["load"] for row in bearings) else "over the duty cycle"
        parts.append(Table("bearings", f"Equivalent loads of the shafts' bearings {over}", BEARING_COLUMNS, bearings))
    notes = [f"{text.several(joints, 'joint')}, {facts['left_out']} without a valid load left out"]
    if has("q95_lower")(rows):
        notes[0] += "; 95 % intervals"
    else:
        notes.append("no intervals: the joints are not independent")
    read, origin, apart = _orbits(view) if orbits else ([], "", 0.0)
    if read:
        facts |= {"origin": origin, "apart": apart}
        source = f"{ORIGIN[origin]}{' of them' * (origin == revolutions.AGAIN)}"
        points = [row for shaft in read for orbit in shaft for row in _points(orbit)]
        units = {"theta": "rad", "f_x": "N", "f_y": "N"}
        parts.append(Table("orbits", "Lateral force over one revolution", (), points, units))
        notes.append(f"orbits: {'; '.join(map(_which, read))}; nearest in the largest lateral force; {source}")
    if apart:
        words = f"largest loads of these joints differ by up to {apart:.1e} (relative) from the stored ones"
        notes.append(f"{words}, which another machine or version computed")
    drawn = Panels([*_amplitude_panels(rows), *map(_orbit_panel, read)])
    return Answer("orders", "Orders of what the shafts carry", [drawn, *parts, *map(Sentence, notes)], facts)


def orders_on_page(view: View, asked: Asked) -> Answer:
    """Orders where the study asks for loads of the shafts; orbits where the page shows histories at all."""
    if not (view.sampled and view.count(*VALID) and are_asked(view)):
        raise NotApplicable
    answer = orders(view, orbits=asked.replay > 0)
    return replace(answer, parts=[Sentence(INTRODUCTION, "lead"), *answer.parts])


def are_asked(view: View) -> bool:
    """Whether the study asks for loads of the shafts or orders: by a limit, or by selecting them among its results."""
    selected = view.kept_loads if len(view.columns) < len(result_columns(view.mechanism)) else ()
    asked = [load_of(name, view.mechanism) for name in (*view.limits, *selected)]
    return any(load.kind.orders or load.place.group == "shaft" for load in asked)


def _amplitude(view: View, name: str) -> Row:
    """One row of the table ``amplitudes``."""
    quantity, _, order = name.removesuffix("x").rpartition("_")
    noun = load_of(name, view.mechanism).kind.noun
    return {"quantity": quantity, "noun": noun, "order": int(order), **_quantiles(view.load(name))}


def _quantiles(load: Sample) -> Row:
    row = {"load": load.name, "unit": load.unit, "nominal": load.nominal}
    for key, share in SHARES.items():
        quantile = load.quantile(share)
        row |= with_ends(key, (quantile.estimate, max(quantile.lower, 0.0), quantile.upper))
    return row


def _bearings(view: View) -> Rows:
    """Rows of the table ``bearings``: equivalent loads over the duty cycle, each point by its share of the turns.

    Where the study gives no shares, there is a row for each operating point.
    """
    keys = {f"bearing_{end}_{rolling}": exponent for end in "ab" for rolling, exponent in EXPONENTS.items()}
    exponent_of = {load.name: keys.get(load.kind.key) for load in loads_of(view.mechanism).values()}
    names = [name for name in view.kept_loads if exponent_of[name]]
    of_points = [f"{AT}{point}" for point in view.points] if len(view.points) > 1 else [""]
    try:
        share = view.shares_of_revolutions if names else np.ones(1)
    except InputError:
        return [_quantiles(view.load(f"{name}{at}")) for name in names for at in of_points]
    rows = []
    for name in names:
        p, each = float(Fraction(exponent_of[name] or 1)), [view.load(f"{name}{at}") for at in of_points]
        nominal = (share @ np.array([load.nominal for load in each]) ** p) ** (1 / p)
        values = (share @ np.array([load.values for load in each]) ** p) ** (1 / p)
        rows.append(_quantiles(Sample.of(values, view.status, view.design, name, "N", float(nominal))))
    return rows


def _orbits(view: View) -> tuple[list[list[Orbit]], str, float]:
    """Orbits of each shaft whose lateral force is kept, their source, and how far from the stored values."""
    orbits, origin, apart = list[list[Orbit]](), "", 0.0
    for shaft in kinds(view.mechanism)["lateral"].places:
        name = f"{shaft}.lateral"
        if name not in view.kept_loads or not view.load(name).valid.size:
            continue
        at = view.at(view.point_of(name))
        load, slots = at.load(name), {"nominal": int(at.nominal_slots[0])} if at.nominal_slots.size else {}
        for near, share in NEAR.items():
            away = np.abs(load.values - load.quantile(share).estimate)
            slots |= {near: int(at.slots(np.nanargmin(away)))} if np.isfinite(away).any() else {}
        names, samples = [f"{shaft}.f_x", f"{shaft}.f_y"], int(at.store.options["steps_per_rev"])
        orbits.append([])
        for near, slot in slots.items():
            turn = revolutions.read(at.store, np.array([slot]), names, samples)
            force = np.column_stack([turn.loads[component][0] for component in names])
            origin, apart = turn.origin, max(apart, turn.apart)
            orbits[-1].append(Orbit(shaft, near, int(at.store.row(slot)), at.points[0], force))
    return orbits, origin, apart


def _points(orbit: Orbit) -> Rows:
    """Rows of the table ``orbits`` for one orbit."""
    head = {"shaft": orbit.shaft, "near": orbit.near, "row": orbit.row, "point": orbit.point}
    theta = 2 * np.pi * np.arange(len(orbit.force)) / len(orbit.force)
    return [head | {"theta": angle, "f_x": x, "f_y": y} for angle, (x, y) in zip(theta, orbit.force, strict=True)]


def _which(orbits: Sequence[Orbit]) -> str:
    """Words on which joints the orbits of a shaft are of."""
    where = f"{orbits[0].shaft} shaft{f' at {orbits[0].point}' if orbits[0].point else ''}"
    return f"{where} {', '.join(f'{orbit.label} row {orbit.row}' for orbit in orbits)}"


def _amplitude_panels(rows: Rows) -> Iterator[Panel]:
    """Pictures of the amplitude over the order, one of each quantity."""
    for name in dict.fromkeys(row["quantity"] for row in rows):
        amplitudes = [row for row in rows if row["quantity"] == name]
        most, shaft = max(amplitudes, key=lambda row: float(row["qmedian"])), name.rpartition(".")[0]
        title = f"{text.capital(most['noun'])}{f', {shaft} shaft' if shaft else ''}".replace("Psi", "Ψ")
        words = f"The median of the joints is largest at order {most['order']}, {value('qmedian')(most)}."
        yield Panel(f"amplitude-{name}", title, words, partial(_bars, rows=amplitudes), (drawing.WIDTH, 2.7))


def _orbit_panel(orbits: Sequence[Orbit]) -> Panel:
    """Picture of the lateral force on a shaft."""
    shaft, point = orbits[0].shaft, orbits[0].point
    title = f"Lateral force on the {shaft} shaft over one revolution{f', at {point}' if point else ''}"
    words = "Orbit of the force in axes that do not turn, of the nominal joint and of two others. "
    words += " ".join(f"{orbit.label}: up to {text.value(orbit.largest, 'N')}." for orbit in orbits)
    return Panel(f"orbit-{shaft}", title, words, partial(_draw_orbits, orbits=orbits), (drawing.WIDTH, 4.6))


def _bars(ax: Axes, rows: Rows) -> None:
    """Draw the nominal joint beside the median, with the range from 5 to 95 % of the joints."""
    keys = ("order", "nominal", "q5", "qmedian", "q95")
    order, nominal, low, middle, high = (np.nan_to_num([row[key] for row in rows]) for key in keys)
    ends = np.clip([middle - low, high - middle], 0.0, None)
    ax.bar(order - 0.18, nominal, 0.32, color=drawing.GREY, label="nominal joint")
    ax.bar(order + 0.18, middle, 0.32, color=style.COLOURS[0], label="median")
    look: Any = {"fmt": "none", "ecolor": style.INK, "elinewidth": 1.3, "capsize": 4.0, "label": "5 to 95 %"}
    ax.errorbar(order + 0.18, middle, ends, **look)
    top = float(max(high.max(), nominal.max()))
    ax.set(xticks=list(ORDERS), xticklabels=[f"{n}×" for n in ORDERS], xlabel="order, multiple of the input speed")
    ax.set(xlim=(ORDERS[0] - 0.6, ORDERS[-1] + 0.6), ylim=(0.0, 1.08 * top or 1.0))
    ax.grid(axis="x", visible=False)
    unit = drawing.loads_axis(ax.yaxis, top, rows[0]["unit"])
    if not unit:
        ax.yaxis.set_major_formatter(style.ticker.FuncFormatter(lambda x, _: f"{x:.3g}"))
    ax.set_ylabel(f"amplitude [{unit or '1'}]")


def _draw_orbits(ax: Axes, orbits: Sequence[Orbit]) -> None:
    """Draw the orbits about zero force; a dot is the input angle 0, an arrow head points on."""
    largest = max(orbit.largest for orbit in orbits)
    for line in (ax.axhline, ax.axvline):
        line(0.0, color=style.FAINT, lw=0.8)
    for orbit in orbits:
        _, colour, dash = LOOKS[orbit.near]
        x, y = np.vstack([orbit.force, orbit.force[:1]]).T
        small = orbit.near == "nominal"  # mostly a point at the centre, where other orbits pass
        size, order = (4.0, 4) if small else (6.0, 3)
        ax.plot(x, y, "o", markevery=[0], ms=size, zorder=order, color=colour, ls=dash, label=orbit.label)
        k = max(1, len(orbit.force) // 12)
        if orbit.largest > SMALL * largest:
            head = {"arrowstyle": "-|>", "color": colour, "mutation_scale": 16.0}
            ax.annotate("", (x[k], y[k]), (x[k - 1], y[k - 1]), arrowprops=head)
    ax.set_aspect("equal", adjustable="datalim")
    ax.margins(0.08)
    unit = drawing.loads_axis(ax.xaxis, largest, "N")
    drawing.loads_axis(ax.yaxis, largest, "N")
    ax.set(xlabel=f"f_x, in the plane of both shafts [{unit}]", ylabel=f"f_y, normal to that plane [{unit}]")
