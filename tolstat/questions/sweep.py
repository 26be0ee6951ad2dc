"""Joints that are no sample of a production: loads of a sweep against the swept value, and loads of listed joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.analysis import accuracy
from tolstat.campaign.remedy import remedy
from tolstat.common.columns import holds
from tolstat.common.error_fields import error_units
from tolstat.common.load_kinds import kinds
from tolstat.common.loads import FloatArray, LoadPanel, load_of, load_panels, names_of, panels, unit_text
from tolstat.common.mechanism import Mechanism
from tolstat.common.strict import read_section
from tolstat.common.tables import FAILED, SIMULATED, UNSETTLED, Status, tables
from tolstat.common.units import DISPLAY_UNITS
from tolstat.display import drawing, style, text
from tolstat.display.answer import Answer, Axes, Figure, Panel, Panels, Part, Row, Rows, Sentence, Sheet, Table, plain
from tolstat.questions.shares import inapplicable, rows_of
from tolstat.solver import refinement
from tolstat.store import Reader, recorded, verification
from tolstat.store.view import View
from tolstat.study.design import KEYS

MAX_LEGEND = 6
"""Maximum number of values of the second swept quantity in the legend."""
Look = dict[str, Any]


def sweep(view: View) -> Answer:
    """Compare the largest loads of the joints of a sweep.

    Parameters
    ----------
    view : View
        A campaign of the method ``sweep``.

    Returns
    -------
    Answer
        Table ``sweep``: one row per joint, pending and failed ones included, with the swept values, headed by label and
        unit for the reader (``pin*.diameter [mm]``); ``status``; force and torque of each bushing, SI, headed likewise;
        ``psi``; other loads with limits. Loads that the study does not keep are left out. Pictures of the loads against
        the first swept value.

    Raises
    ------
    NotApplicable
        When the campaign is no sweep.
    """
    if view.method != "sweep":
        raise inapplicable(view, "holds no sweep", "give the result file of a study with [sweep]")
    columns: dict[str, Sequence[object]] = {axis.head: axis.values.tolist() for axis in swept_axes(view)}
    columns["status"] = [Status(int(code)).label for code in view.status]
    names = dict.fromkeys([*view.shown_loads, *(name for name in view.kept_loads if name == "psi"), *view.limits])
    heads = {name: _head(name, load_of(name, view.mechanism).unit) for name in names}
    columns |= {head: view.simulated(name).tolist() for name, head in heads.items()}
    rows = rows_of(columns)
    seen = [_short(row, view.mechanism) for row in rows]
    limited = [heads[name] for name in view.limits]
    ranked = [name for name in (seen[0] if seen else ()) if "." in name and name not in limited][1:]
    table = Table("sweep", "Worst bushing", plain(seen, ranked), rows, seen=seen)
    drawn = [_panel(view, panel) for panel in load_panels(view.limits, view.mechanism) if _kept(view, panel)]
    pictures: list[Part] = [Panels(drawn), Sheet("sweep", partial(sheet, view))] if drawn else []
    return Answer("sweep", "Loads against the swept value", [*pictures, table])


def _kept(view: View, panel: LoadPanel) -> dict[str, FloatArray]:
    """Largest loads of a panel that the study keeps, (n,) each."""
    return {x: view.simulated(x) for x in panel.names if x in (*view.bushing_loads, *view.limits)}


def _head(name: str, unit: str) -> str:
    return name if unit in ("", "1") else f"{name} [{unit}]"


def _short(row: Row, mechanism: Mechanism) -> Row:
    """Row for people: largest force and torque of each group of bushings."""
    short = dict(row)
    for group, kind in panels(mechanism):
        heads = [_head(name, kind.unit) for name in names_of(group, kind, mechanism)]
        if kept := [short.pop(head) for head in heads if head in short]:
            short[f"{group}.{kind.symbol} [{kind.unit}]"] = float(np.fmax.reduce(kept))
    return short


def _panel(view: View, panel: LoadPanel) -> Panel:
    draw = partial(_draw, view=view, axes=swept_axes(view), panel=panel)
    words = f"Largest {panel.words} against the swept value"
    return Panel(f"sweep-{panel.key}", panel.title, words, draw, (drawing.WIDTH, 3.8))


def sheet(view: View) -> Figure:
    """Draw the loads against the first swept quantity.

    One swept quantity gives a line for each bushing. Several give a line for each combination of the others,
    of the largest load among the bushings of a group, coloured by the second.

    Parameters
    ----------
    view : View
        A campaign of the method ``sweep``.

    Returns
    -------
    Figure
        A panel for each group and kind, and for other loads with limits; joints that did not settle are hollow, those
        without a result are crosses at the foot.
    """
    axes, small = swept_axes(view), "largest modulus over the last revolution of each joint"
    if len(axes) > 1:
        group, kind = panels(view.mechanism)[0]
        bushings = text.in_words(len(names_of(group, kind, view.mechanism)))
        small = f"largest of the {bushings} bushings, coloured by {axes[1].head}"
    if len(axes) > 2:
        small += f"; one line for each {', '.join(axis.label for axis in axes[2:])}"
    title = f"{view.name}: largest loads against {axes[0].label if axes else 'the number of the joint'}"
    drawn = [_panel(view, panel) for panel in load_panels(view.limits, view.mechanism)]
    return drawing.sheet(drawn, title, [view.head(), small], columns=2)


def _draw(ax: Axes, view: View, axes: list[Axis], panel: LoadPanel) -> None:
    """Draw the loads of a panel."""
    first = axes[0] if axes else Axis("joint", "", np.arange(1, view.n + 1, dtype=np.float64))
    ax.set(xlabel=first.head, ylabel=f"largest {panel.quantity} [{unit_text(panel.unit) or '1'}]")
    ax.xaxis.set_major_locator(style.ticker.MaxNLocator(6))
    loads = _kept(view, panel)
    if not loads:
        drawing.empty(ax, "not kept by the study")
        return
    if len(axes) < 2:
        for i, name in enumerate(panel.names):
            if name in loads:
                place = load_of(name, view.mechanism).place
                bushing = place.name.replace(place.group, "bushing ") if name in view.bushing_loads else name
                _line(ax, view, first, loads[name], np.arange(view.n), **style.curve(i), label=bushing)
    else:
        largest, others = np.max(list(loads.values()), axis=0), np.column_stack([axis.values for axis in axes[1:]])
        values, shades = np.unique(axes[1].values), style.shades()
        numbers = np.linspace(0, len(shades) - 1, values.size).round().astype(int)
        named = values[np.linspace(0, values.size - 1, MAX_LEGEND).round().astype(int)]
        for point in np.unique(others, axis=0):
            label = f"{point[0]:.4g} {axes[1].unit}".strip() if point[0] in named else None
            shade = shades[numbers[np.searchsorted(values, point[0])]]
            _line(ax, view, first, largest, np.flatnonzero((others == point).all(axis=1)), color=shade, label=label)
    if len(view.nominal):
        nominal = max(load.nominal for load in view.loads(list(loads)))
        look: Look = {"color": style.FAINT, "lw": 1.1, "ls": (0.0, (1.0, 2.0)), "zorder": 1.5}
        ax.axhline(nominal, label="nominal joint, largest", **look)
    bottom, top = ax.get_ylim()
    for limit in sorted({view.limits[name] for name in loads if name in view.limits}):
        if limit < top + 0.5 * (top - bottom):
            label = f"limit {text.value(limit, panel.unit)}"
            ax.axhline(limit, color=style.INK, lw=1.3, ls=(0.0, (8.0, 3.0)), label=label)


def _line(ax: Axes, view: View, axis: Axis, values: FloatArray, joints: NDArray[np.intp], **look: Any) -> None:
    """Draw one line over some joints; it is broken where a joint has no result."""
    joints = joints[np.argsort(axis.values[joints], kind="stable")]
    x, status = axis.values[joints], view.status[joints]
    shown = np.where(np.isin(status, SIMULATED), values[joints], np.nan)
    ax.plot(x, shown, zorder=3, marker="o", ms=3.2, **look)
    loose, gone = np.isin(status, UNSETTLED), np.isin(status, FAILED)
    if loose.any():
        hollow: Look = {"ms": 6.5, "mfc": "white", "mec": look["color"], "label": "not settled"}
        ax.plot(x[loose], shown[loose], "o", zorder=4, **hollow)
    if gone.any():
        foot: Look = {"transform": ax.get_xaxis_transform(), "color": style.INK, "label": "no result"}
        ax.plot(x[gone], np.full(int(gone.sum()), 0.02), "x", zorder=4, **foot)


class Axis(NamedTuple):
    """One independently swept quantity.

    Attributes
    ----------
    label : str
        The study's pattern, such as ``pin*.diameter``, or the error's name.
    unit : str
        Display unit, such as ``mm``.
    values : ndarray, shape (n,)
        Value at each joint, in `unit`.
    """

    label: str
    unit: str
    values: FloatArray

    @property
    def head(self) -> str:
        """Label and unit."""
        return _head(self.label, self.unit)


def swept_axes(view: View) -> list[Axis]:
    """Quantities that a sweep varies, in the study's order.

    Errors and dimensions with equal values in every joint are swept together and form one axis.

    Parameters
    ----------
    view : View
        A campaign with the sampling method ``sweep``.

    Returns
    -------
    list of Axis
        Empty when nothing varies.
    """
    patterns = _patterns(read_section(view.store.path, view.store.study_text, "sweep"))
    errors = view.errors(np.arange(view.n))
    columns = {(field.name, field.unit): errors[field.name] for field in tables(view.mechanism).error_fields}
    if len(view.parts) == 1:  # of several operating points none is swept
        points = recorded.operating_points(view.store, slice(view.store.first_sample, None))
        units = error_units(view.mechanism)
        columns |= {(f"operation.{key}", units[f"operation.{key}"]): of for key, of in points.items()}
    if view.store.variants:
        columns |= {(key, KEYS[key]): of[view.store.first_sample :] for key, of in recorded.swept(view.store).items()}
    groups: dict[bytes, list[tuple[str, str]]] = {}
    for key, column in columns.items():
        if column.size and np.ptp(column) > 0:
            groups.setdefault(column.tobytes(), []).append(key)
    axes = []
    for keys in groups.values():
        unit, factor = DISPLAY_UNITS.get(keys[0][1], (keys[0][1], 1.0))
        values = columns[keys[0]] * factor
        values[np.abs(values) < 1e-12 * np.abs(values).max()] = 0.0  # rounding error of a sweep through zero
        names = [name for name, _ in keys]
        matching = (pattern for pattern in patterns if all(fnmatchcase(name, pattern) for name in names))
        label = next(matching, names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more")
        axes.append(Axis(label, unit, values))
    rank = {pattern: i for i, pattern in enumerate(patterns)}
    return sorted(axes, key=lambda axis: rank.get(axis.label, len(rank)))


def _patterns(table: Mapping[str, Any], before: str = "") -> list[str]:
    """Key paths of the entries of ``[sweep]``, whether quoted or dotted."""
    paths = []
    for key, value in table.items():
        is_section = isinstance(value, Mapping) and "from" not in value
        paths += _patterns(value, f"{before}{key}.") if is_section else [f"{before}{key}"]
    return paths


RANKED = ("status", "alpha [deg]", "period")
"""Columns that a narrow terminal leaves out, the last first."""


def cases(view: View) -> Answer:
    """Compare the largest loads of the listed joints.

    Parameters
    ----------
    view : View
        A file of a study whose method is ``cases``.

    Returns
    -------
    Answer
        Table ``cases``, one row per joint: ``variant``, the ``values`` that define it, ``note``, of Cardan joints
        ``alpha [deg]``, ``case``, ``status``, ``period``, ``revolutions``, ``cost`` (`refinement.work` relative to the
        first joint), ``remedy``; force and torque of each bushing, SI, and their Gamma, eq. (14), per cent; loads that
        the study does not keep are left out. If the file holds a comparison with the reference (``tolstat verify``),
        also ``reference`` (status of the reference simulation, empty for joints that were not compared),
        ``reference_change`` (its closure), ``error_F`` and ``error_T`` (error of the largest load of the worst bushing,
        relative to the largest of the kind).

    Raises
    ------
    NotApplicable
        When the study lists no joints.
    """
    store = view.store
    if not store.case_names:
        raise inapplicable(view, "does not list its joints", "give the result file of a study that lists its joints")
    rows = _listed(store)
    seen = [_worst(row, store.mechanism) for row in rows]
    title, counts = "Change of the loads by the errors of each joint", store.counts()
    parts: list[Part] = [Table("cases", title, plain(seen, RANKED), rows, seen=seen)]
    parts.append(Sentence(f"{counts.done} of {counts.total} joints, {counts.shortfall}"))
    parts += [Sentence(f"{row['variant']}, {row['case']}: {row['remedy']}") for row in rows if row["remedy"]]
    return Answer("cases", "Listed joints", parts)


def _listed(store: Reader) -> Rows:
    design, results = store.design, store.results()
    work = refinement.work(results)
    variants = [store.variants[i] for i in design["variant"]]
    columns: dict[str, Sequence[Any]] = {
        "variant": [variant.family for variant in variants],
        "values": ["; ".join(f"{key} = {value}" for key, value in variant.values.items()) for variant in variants],
        "note": [variant.note for variant in variants],
        "alpha [deg]": np.degrees(recorded.operating_points(store).get("alpha", [])).tolist(),
        "case": [store.case_names[i] for i in design["case"]],
        "status": [Status(int(code)).label for code in results["status"]],
        "period": results["period"].tolist(),
        "revolutions": results["revolutions"].tolist(),
        "cost": (work / max(1.0, float(work[0]))).tolist(),
    }
    set_by_variants = (
        {key.removeprefix("solver."): value for key, value in variant.values.items() if key.startswith("solver.")}
        for variant in variants
    )
    columns["remedy"] = [remedy(row, store.options | keys) for row, keys in zip(results, set_by_variants, strict=True)]
    gamma = relative_errors(results, design["group"])
    for b, bushing in enumerate(kinds(store.mechanism)["F"].places):
        for load, (letter, unit) in enumerate((("F", "N"), ("T", "N*m"))):
            if holds(store.columns, load_of(f"{bushing}.{letter}", store.mechanism)):
                columns[f"{bushing}.{letter} [{unit}]"] = results[f"{letter}_max"][:, b].tolist()
                columns[f"{bushing}.Gamma_{letter} [%]"] = gamma[:, b, load].tolist()
    return rows_of({name: values for name, values in columns.items() if len(values)} | _reference(store))


def relative_errors(results: NDArray[np.void], group: NDArray[np.int32]) -> NDArray[np.float64]:
    """Compare the largest loads of each joint with those of the first joint of its group: Gamma.

    Cirelli, Rossi, Valentini and Pennestri (2021), eq. (14).

    Parameters
    ----------
    results : ndarray of RESULT, shape (n,)
        Joints; the first of a group is the one without errors.
    group : ndarray of int, shape (n,)
        Group number of each joint; joints of a group differ in their errors only.

    Returns
    -------
    ndarray, shape (n, bushings, 2)
        Relative difference in per cent, signed: force, torque. NaN unless the joint and the first of its group are OK.
    """
    loads = np.stack([results["F_max"], results["T_max"]], axis=-1)
    loads[results["status"] != Status.OK] = np.nan
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    base = loads[first[inverse]]
    return np.asarray(100.0 * (loads / np.where(base > 0.0, base, np.nan) - 1.0))


def _reference(store: Reader) -> dict[str, Sequence[Any]]:
    """Columns that compare every joint with the tight reference; none if the file holds no comparison."""
    verified = verification.read(store)
    if verified is None or accuracy.REFERENCE not in verified.checks:
        return {}
    true, slots = verified.checks[accuracy.REFERENCE].results, store.slot(verified.rows)
    columns = {"reference": np.full(store.n, "", object)}
    columns |= {key: np.full(store.n, np.nan) for key in ("reference_change", "error_F", "error_T")}
    columns["reference"][slots] = [Status(int(code)).label for code in true["status"]]
    columns["reference_change"][slots] = true["closure"]
    error = accuracy.by_kind(accuracy.differences(verified.base, true, store.mechanism), store.mechanism)
    columns["error_F"][slots], columns["error_T"][slots] = error[:, 0], error[:, 1]
    return {name: values.tolist() for name, values in columns.items()}


def _worst(row: Row, mechanism: Mechanism) -> dict[str, Any]:
    """Row for people: Gamma of the largest modulus among the bushings kept, signed, for force and for torque."""
    shown = ("variant", "alpha [deg]", "case", "status", "period")
    short = {key: row[key] for key in shown if key in row}
    for head in ("Gamma_F [%]", "Gamma_T [%]"):
        names = [f"{bushing}.{head}" for bushing in kinds(mechanism)["F"].places]
        if gamma := [row[name] for name in names if name in row]:
            short[head] = max(gamma, key=lambda x: -1.0 if np.isnan(x) else abs(x))
    return short
