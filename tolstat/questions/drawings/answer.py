"""What a joint looks like: the joint on the page, with the place of a load marked; figures and tables of any joint."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tolstat import joint as joints
from tolstat import study
from tolstat.common.errors import Fault, InputError
from tolstat.common.loads import load_of
from tolstat.common.mechanism import Mechanism, prefixes
from tolstat.common.strict import read_toml, validate
from tolstat.common.tables import SIMULATED
from tolstat.display import drawing, text
from tolstat.display.answer import Answer, Asked, Figure, Panel, Panels, Part, Row, Rows, Sentence
from tolstat.questions.drawings import shaft, views
from tolstat.store import ResultFile, recorded
from tolstat.store.view import View

LEGEND = (
    "The joint from its own dimensions. Marked: the bushings, pins and shafts of the leading loads. Loads of cross1–4 "
    "act on the pins, those of fork1–4 on the arms; their components are along and about the axes e, t, z of each."
)
"""Text below the drawings of the joint."""
PLAIN = (
    "Lines go from pins and holes over their bushings to the hub or shaft that carries them; without errors, at the "
    "mean input angle 0. The ends of shafts are sketched."
)
"""Text below the plain picture of a mechanism."""
WORST = "Pins and holes stand where their errors have them. To draw another joint: tolstat show FILE --row ROW"
"""Text below the drawings of the worst joints."""
NOTES = (
    "⊕ bushings: cross1–4 carry the pins, fork1–4 the arms. Their loads, the force F and the bending moment T at the "
    "root of pin or arm, act on the pin or arm; components are along and about its e, t, z.",
    "pin1.contact: force between pin 1 and the hole of arm 4. ⊙ axis towards the reader, ⊗ away from the reader.",
    "Blue: cross; orange: input fork; green: output fork.",
    "Sketched, since the model has no such dimension: walls of the holes, forks, shafts, width of the hub.",
)
"""How to read the drawing of a joint."""
ERRORS = ("Dashed: without error. e points away from the centre of the joint; every pin and hole has its own e, t, z.",)
"""How to read the drawing of the kinds of errors."""
ROW = (
    "Diameters and contact to scale. Cross and forks in their ideal place: they give way where pin and hole overlap.",
)
"""How to read the drawing of the errors of one joint."""


def place_of(view: View, load: str, asked: Asked) -> Panel | None:
    """Drawing of the joint in the view that shows the place of a load, which is marked; None if it cannot be read.

    Parameters
    ----------
    view : View
        A campaign.
    load : str
        The load; empty for a view without a mark.
    asked : Asked
        Takes a note if there is no drawing.
    """
    with asked.noting("the joint is not drawn"):
        names, side, title = [""], True, "The joint"
        if load:
            place = load_of(load, view.mechanism).place
            names, side = [place.name], place.group not in ("cross", "pin")
            sample, which = view.load(load), "the largest loads"
            if sample.limit is not None:
                which = f"{'most often above' if sample.above(sample.limit).count else 'nearest to'} its limit"
            title = f"{place.name or load}: {which}"
            title += f", at {view.point_of(load)}" if len(view.points) > 1 else ""
        drawn = _joints(view, names, load)
        before = next((before for before in drawn if names[0].startswith(before)), next(iter(drawn)))
        return replace(drawn[before][side], key="joint-worst", title=title)
    return None


def _joints(view: View, marked: Collection[str], load: str) -> dict[str, tuple[Panel, Panel]]:
    """Front and side view of each Cardan joint at the operating point at which a load matters most, else at the first.

    By what stands before the names of its parts, see `mechanism.prefixes`.
    """
    point, joint = view.point_of(load) if load else view.points[0], recorded.joint_of(view.store, 0)
    alphas, drawn = view.at(point).store.operation.alphas, {}
    for before, alpha in zip(prefixes(view.mechanism), alphas, strict=True):
        own = [name.removeprefix(before) for name in marked if name.startswith(before)]
        front, side = _named(views.views(joint, alpha, own), before)
        drawn[before] = front, replace(side, title=f"{side.title}, at {point}") if point else side
    return drawn


def _named(panels: tuple[Panel, Panel], before: str) -> list[Panel]:
    """Drawings with the name of their joint, of several."""
    name = before.rstrip(".")
    return [replace(p, key=f"{p.key}-{name}", title=f"{name}: {p.title}") if name else p for p in panels]


def drawings(view: View) -> Answer:
    """Draw the joint, its errors and its worst rows.

    Parameters
    ----------
    view : View
        A campaign.

    Returns
    -------
    Answer
        Pictures: the joint from all sides, with the places of the leading loads marked, before it a drive shaft as a
        whole; the kinds of its errors; errors of the joints with the largest leading loads, enlarged.
    """
    marked = sorted({load_of(name, view.mechanism).place.name for name in view.leading} - {""})
    kinds = views.kinds_of_errors(recorded.joint_of(view.store, 0))
    drawn = chain.from_iterable(_joints(view, marked, next(iter(view.leading), "")).values())
    operation = view.at(view.points[0]).store.operation
    whole: list[Part] = []
    if isinstance(operation, joints.OperationOfShaft):
        whole = [Panels([shaft.picture(recorded.joint_of(view.store, 0), operation)])]
    parts: list[Part] = [*whole, Panels([*drawn, kinds]), Sentence(LEGEND)]
    if view.method != "sweep" and (worst := _worst(view)):
        parts += [Panels(worst), Sentence(WORST)]
    return Answer("drawings", "The joint and its errors, drawn", parts)


def _worst(view: View) -> list[Panel]:
    """One drawing for each joint that has the largest of a leading load."""
    loads: dict[int, list[str]] = {}
    for name in view.leading:
        load = view.load(name)
        values = np.where(np.isin(load.status, SIMULATED), load.values, np.nan)
        sample = int(np.nanargmax(values))
        loads.setdefault(sample, []).append(f"{name} {text.value(float(values[sample]), load.unit)}")
    panels = []
    for sample, words in loads.items():
        joint, row = recorded.joint_of(view.store, int(view.slots(sample))), int(view.rows(sample))
        errors, title = view.errors(np.array([sample])), f"Row {row}: {', '.join(words)}"
        panels += _errors_of(joint, errors, title, f"drawn-{row}")
    return panels


def _errors_of(joint: joints.Joint, errors: NDArray[np.void], title: str, key: str) -> list[Panel]:
    """Drawing of the errors of each Cardan joint of one mechanism."""
    panels = []
    for before in views.joints_in(errors.dtype):
        name, own = before.rstrip("."), views.errors_in(joint, errors, before)
        of, suffix = (f"{name}: ", f"-{name}") if name else ("", "")
        panels.append(views.errors_of(joint, own, f"{of}{title}", f"{key}{suffix}"))
    return panels


def read(
    source: str | Path, row: int | None = None, alpha: str | None = None
) -> tuple[joints.Joint, list[float], str, NDArray[np.void] | None]:
    """Read the joint to be drawn.

    Parameters
    ----------
    source : str or Path
        Name of a joint that comes with the package, a joint file, study or case (TOML), or a result file (HDF5).
    row : int, optional
        Row of the campaign whose errors are drawn; of a result file.
    alpha : str, optional
        Misalignment in place of the source's own, ``"20 deg"``, of drive shafts that of the first; a joint file has
        none: 15 deg by default.

    Returns
    -------
    joint : Joint
        The nominal joint; of a result file that of its first slot, or of the row.
    alphas : list of float
        Its misalignment, rad, of drive shafts that of each; of several operating points those of the first.
    title : str
        A headline.
    errors : ndarray, shape (1,), dtype ERROR, or None
        Errors of the row.

    Raises
    ------
    InputError, StoreError
        When there is no such joint, row or misalignment, or a file cannot be read.
    """
    path, errors, point = Path(source), None, ""
    asked_alpha = validate(
        joints.Operation, {"alpha": alpha or "15 deg", "speed": "1 rpm", "torque": "1 N*m"}, "--alpha"
    ).alpha
    if path.is_file() and path.suffix.lower() != ".toml":
        with ResultFile.open(path) as store:
            if row is not None and row not in store.rows:
                holds = f"has rows {store.rows[0]} to {store.rows[-1]}, not {row}"
                remedy = f"give one of these rows, for example --row {store.rows[0]}"
                raise InputError([Fault(str(path), holds, remedy)])
            first, slot, title = store.each()[0], 0 if row is None else store.slot(row), store.study_name
            joint = recorded.joint_of(store, slot)
            alphas = list(recorded.operation_of(first, slot).alphas)
            if row is None:
                point = first.point or ""
            else:
                errors, title = store.errors(slice(slot, slot + 1)), f"{title}, row {row}"
    elif row is not None:
        raise InputError([Fault(str(source), "has no rows, which --row asks for", "give a result file: FILE.h5")])
    elif path.suffix.lower() == ".toml" and not {"joint", "operation"}.isdisjoint(data := read_toml(path)):
        case = study.load(path) if "sampling" in data else study.load_case(path)
        joint, title = case.joint, path.stem
        alphas = list(case.operation.alphas)
        point = case.points[0].name if isinstance(case, study.Study) else ""
    else:
        joint, alphas = joints.load(source, {}, str(source)), [asked_alpha]
        title = joint.description or path.stem
    if alpha:
        alphas[0] = asked_alpha
    return joint, alphas, f"{title}, at {point}" if point else title, errors


def draw_joint(joint: joints.Joint, alpha: float | Sequence[float], title: str = "", columns: int = 2) -> Figure:
    """Draw a joint from its dimensions: the cross in its holes, both shafts, bushings, dimensions.

    Parameters
    ----------
    joint : Joint
        The nominal joint, such as ``study.joint``.
    alpha : float or sequence of float
        Misalignment, rad; of drive shafts that of each.
    title : str
        Headline; the joint's description by default.
    columns : int
        Number of drawings side by side: 1 for a narrow page.

    Returns
    -------
    matplotlib.figure.Figure
        Its parts have their names as ids in an SVG.
    """
    alphas = np.atleast_1d(alpha).tolist()
    names = [f"joint{i}." for i in range(1, len(alphas) + 1)] if len(alphas) > 1 else [""]
    each = [_named(views.views(joint, own), name) for own, name in zip(alphas, names, strict=True)]
    panels = list(chain.from_iterable(each))
    return drawing.sheet(panels, title or joint.description or "Cardan joint", NOTES, columns)


def draw_mechanism(
    mechanism: Mechanism, params: NDArray[np.void], title: str = "", marked: Collection[str] = ()
) -> Figure:
    """Draw any mechanism from its geometry: three views with members as lines and pins in their holes as circles.

    Parameters
    ----------
    mechanism : Mechanism
        The mechanism.
    params : ndarray, shape (1,), dtype PARAM
        Its parameters.
    title : str
        Headline; the mechanism's name by default.
    marked : collection of str
        Bushings, pins and shafts that stand out.
    """
    from tolstat.questions.drawings import plain

    row = params.view(np.recarray)[0]
    panel = plain.views(mechanism, row, plain.frames(mechanism, row), marked)
    return drawing.sheet([panel], title or mechanism.name, [PLAIN])


def draw_errors(joint: joints.Joint) -> Figure:
    """Draw what a positive error of each kind means, on pin 1 and hole 4 of a joint."""
    return drawing.sheet([views.kinds_of_errors(joint)], "Errors of a pin and a hole", ERRORS)


def draw_row(joint: joints.Joint, errors: NDArray[np.void], title: str = "") -> Figure:
    """Draw the errors of one joint, enlarged together with its clearances.

    Parameters
    ----------
    joint : Joint
        The nominal joint.
    errors : ndarray, shape (1,), dtype ERROR
        Errors of the joint, such as ``store.errors(slice(17, 18))``.
    title : str
        Headline.
    """
    panels = _errors_of(joint, errors, "Seen along z and along t of each pin", "row")
    return drawing.sheet(panels, title or "Errors of one joint", ROW)


def numbers(joint: joints.Joint, errors: NDArray[np.void]) -> Rows:
    """Errors of each pin and hole of one joint, see `views.numbers`; names as in `errors`."""
    rows = list[Row]()
    for before in views.joints_in(errors.dtype):
        own = views.numbers(joint, views.errors_in(joint, errors, before))
        rows += [{**row, "feature": f"{before}{row['feature']}"} for row in own]
    return rows


def lengths(joint: joints.Joint, alphas: Sequence[float]) -> Rows:
    """Dimensions of a joint, and what else it has: ``dimension``, ``value`` with its unit, ``meaning``."""
    arm, contact = joint.arm, joint.contact
    rows = [
        ("cross.R", joint.cross.R, "centre of the joint to the middle of pin and hole"),
        ("cross.r_b", joint.cross.r_b, "centre of the joint to a cross bushing"),
        ("arm.l_f", arm.l_f, "middle of a hole to a fork bushing, along the shaft"),
        ("contact.D_P", contact.D_P, "diameter of the pins"),
        ("contact.D_H", contact.D_H, "diameter of the holes"),
        ("clearance", 0.5 * (contact.D_H - contact.D_P), "radial clearance"),
        ("contact.z", contact.z, "length of the contact"),
        ("pin.d", joint.pin.d, "diameter of a pin's beam"),
        ("pin.l", joint.pin.l, "length of a pin's beam"),
        ("arm.width", arm.width, "side of an arm's section along t"),
        ("arm.depth", arm.depth, "side of an arm's section along e"),
        ("arm.d", arm.d, "diameter of a round arm"),
    ]
    shown = [(name, f"{1e3 * x:.5g} mm", meaning) for name, x, meaning in rows if x is not None]
    for key, alpha in zip(("operation.alpha", "shaft.alpha"), alphas, strict=False):
        shown.append((key, f"{np.degrees(alpha):.5g} deg", "misalignment of the shafts"))
    if joint.thrust is not None:
        shown.append(
            ("thrust.end_play", f"{1e3 * joint.thrust.end_play:.5g} mm", "play of the cross between its faces")
        )
    if joint.friction.mu is not None:
        shown.append(("friction.mu", f"{joint.friction.mu:.5g}", "coefficient of friction of the pins"))
    for end, borne in (("input", joint.shaft.input), ("output", joint.shaft.output)):
        if borne is not None:
            places = ", ".join(f"{1e3 * place:.5g}" for place in borne.bearings)
            shown.append(
                (f"shaft.{end}.bearings", f"{places} mm", f"bearings of the {end} shaft from the joint's centre")
            )
    if joint.shaft.unbalance is not None:
        shown.append(
            (
                "shaft.unbalance",
                f"{1e6 * joint.shaft.unbalance.size(joint.shaft.mass):.5g} g*mm",
                "unbalance of the output shaft",
            )
        )
    return [{"dimension": name, "value": value, "meaning": meaning} for name, value, meaning in shown]


def meanings() -> Rows:
    """Kinds of errors: ``error``, and what ``a positive value`` does."""
    return [{"error": error, "a positive value": meaning} for error, meaning in views.MEANINGS.items()]
