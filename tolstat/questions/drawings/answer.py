"""What a joint looks like: the joint on the page, the place of a load marked; figures of a joint and its errors."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import NamedTuple

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
from tolstat.display.answer import Answer, Asked, Figure, Panel, Panels, Part, Rows, Sentence
from tolstat.questions.drawings import shaft, views
from tolstat.store import ResultFile, recorded
from tolstat.store.view import View
from tolstat.study.points import Point

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
OF_LINKAGE = (
    "Lines go from pins and eyes to the mass centre of their member, or to the axis of a driven one without a pair in "
    "the ground; without errors. Pale lines: every 45 deg of the input angle, of a swing eight times a period."
)
"""Text below the picture of a linkage."""
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
ROW = ("Diameters and contact to scale. Members stand in their ideal place: they give way where pin and hole overlap.",)
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
        if not view.mechanism.cardan:
            panel = _linkage(recorded.joint_of(view.store, 0), view.at(view.points[0]).store.operation, names)
            return replace(panel, key="joint-worst", title=f"{panel.title}; {title}" if load else panel.title)
        drawn = _joints(view, names, load)
        before = next((before for before in drawn if names[0].startswith(before)), next(iter(drawn)))
        return replace(drawn[before][side], key="joint-worst", title=title)
    return None


def _linkage(joint: joints.Joint, operation: joints.Operation, marked: Collection[str] = ()) -> Panel:
    """Three views of a linkage without errors; bushings, pins and members in `marked` stand out."""
    from tolstat.questions.drawings import plain

    mechanism = joints.mechanism_of(joint, operation)
    row = joints.perturb(joint, operation, joints.nominal_errors(1, mechanism)).view(np.recarray)[0]
    return plain.views(mechanism, row, plain.frames(mechanism, row), marked)


def _joints(view: View, marked: Collection[str], load: str) -> dict[str, tuple[Panel, Panel]]:
    """Front and side view of each Cardan joint at the operating point at which a load matters most, else at the first.

    By what stands before the names of its parts, see `mechanism.prefixes`.
    """
    point, each = view.point_of(load) if load else view.points[0], recorded.joints_at(view.store, 0)
    alphas, drawn = view.at(point).store.operation.alphas, {}
    for before, alpha, joint in zip(prefixes(view.mechanism), alphas, each, strict=True):
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
    joint, operation = recorded.joint_of(view.store, 0), view.at(view.points[0]).store.operation
    kinds, parts = views.kinds_of_errors(joint), list[Part]()
    if isinstance(operation, joints.OperationOfShaft):
        parts.append(Panels([shaft.picture(joint, operation)]))
    if view.mechanism.cardan:
        drawn = chain.from_iterable(_joints(view, marked, next(iter(view.leading), "")).values())
        parts += [Panels([*drawn, kinds]), Sentence(LEGEND)]
    else:
        parts += [Panels([_linkage(joint, operation, marked), kinds]), Sentence(OF_LINKAGE)]
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
        slot, row = int(view.slots(sample)), int(view.rows(sample))
        joint, operation = recorded.joint_of(view.store, slot), view.at(view.points[0]).store.operation
        errors, title = view.errors(np.array([sample])), f"Row {row}: {', '.join(words)}"
        panels += views.errors_of(joint, operation, errors, title, f"drawn-{row}")
    return panels


class Drawn(NamedTuple):
    """What a source holds to be drawn.

    Attributes
    ----------
    joint : Joint
        The nominal joint; of a result file that of its first slot, or of the row.
    points : list of Point
        Its operating points, the first of which is drawn; of a joint file one of a misalignment alone.
    title : str
        A headline.
    errors : ndarray, shape (1,), dtype ERROR, or None
        Errors of the row.
    """

    joint: joints.Joint
    points: list[Point]
    title: str
    errors: NDArray[np.void] | None = None


def read(source: str | Path, row: int | None = None, alpha: str | None = None) -> Drawn:
    """Read the joint to be drawn.

    Parameters
    ----------
    source : str or Path
        Name of a joint that comes with the package, a joint file, study or case (TOML), or a result file (HDF5).
    row : int, optional
        Row of the campaign whose errors are drawn; of a result file.
    alpha : str, optional
        Misalignment in place of the source's own at its first operating point, ``"20 deg"``, of drive shafts that of
        joint 1; a joint file has none: 15 deg by default.

    Raises
    ------
    InputError, StoreError
        When there is no such joint, row or misalignment, or a file cannot be read.
    """
    path = Path(source)
    asked = validate(joints.Operation, {"alpha": alpha or "15 deg", "speed": "1 rpm", "torque": "1 N*m"}, "--alpha")
    if path.is_file() and path.suffix.lower() != ".toml":
        drawn = _of_results(path, row)
    elif row is not None:
        raise InputError([Fault(str(source), "has no rows, which --row asks for", "give a result file: FILE.h5")])
    elif path.suffix.lower() == ".toml" and not {"joint", "operation"}.isdisjoint(data := read_toml(path)):
        case = study.load(path) if "sampling" in data else study.load_case(path)
        points = list(case.points) if isinstance(case, study.Study) else [Point("", case.operation)]
        drawn = Drawn(case.joint, points, path.stem)
    else:
        joint = joints.load(source, {}, str(source))
        drawn = Drawn(joint, [Point("", asked)], joint.description or path.stem)
    first = drawn.points[0]
    if alpha:
        operation = first.operation.model_copy(update={"alpha": asked.alpha})
        drawn = drawn._replace(points=[first._replace(operation=operation)])
    at = f", at {first.name}" if first.name and row is None else ""
    return drawn._replace(title=f"{drawn.title}{at}")


def _of_results(path: Path, row: int | None) -> Drawn:
    """Joint of a result file, or of one of its rows."""
    with ResultFile.open(path) as store:
        if row is not None and row not in store.rows:
            holds = f"has rows {store.rows[0]} to {store.rows[-1]}, not {row}"
            remedy = f"give one of these rows, for example --row {store.rows[0]}"
            raise InputError([Fault(str(path), holds, remedy)])
        slot = 0 if row is None else store.slot(row)
        points = [
            point._replace(operation=recorded.operation_of(at, slot))
            for at, point in zip(store.each(), store.points.values(), strict=True)
        ]
        errors = None if row is None else store.errors(slice(slot, slot + 1))
        title = store.study_name if row is None else f"{store.study_name}, row {row}"
        return Drawn(recorded.joint_of(store, slot), points, title, errors)


def draw_joint(joint: joints.Joint, at: float | joints.Operation, title: str = "", columns: int = 2) -> Figure:
    """Draw a joint from its dimensions: the cross in its holes, both shafts, bushings, dimensions.

    Parameters
    ----------
    joint : Joint
        The nominal joint, such as ``study.joint``.
    at : float or Operation
        Misalignment, rad; or the operating point, such as ``study.operation``: a drive shaft is drawn as a whole, too.
    title : str
        Headline; the joint's description by default.
    columns : int
        Number of drawings side by side: 1 for a narrow page.

    Returns
    -------
    matplotlib.figure.Figure
        Its parts have their names as ids in an SVG.
    """
    if isinstance(at, joints.OperationOfLinkage):
        return drawing.sheet([_linkage(joint, at)], title or at.linkage.description, [OF_LINKAGE])
    if isinstance(at, joints.OperationOfShaft):
        each = [views.views(own, alpha) for own, alpha in zip(joints.joints_of(joint, at), at.alphas, strict=True)]
        named = [_named(panels, f"joint{number}.") for number, panels in enumerate(each, 1)]
        fronts = [front for front, _ in named] if at.joint2 else [each[0][0]]
        panels = [shaft.picture(joint, at), *fronts, *(side for _, side in named)]
    else:
        panels = list(views.views(joint, at.alpha if isinstance(at, joints.Operation) else at))
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


def draw_row(joint: joints.Joint, operation: joints.Operation, errors: NDArray[np.void], title: str = "") -> Figure:
    """Draw the errors of one joint, drive shaft or linkage, enlarged together with its clearances.

    Parameters
    ----------
    joint, operation : Joint, Operation
        What is simulated, such as ``study.joint``, ``study.operation``.
    errors : ndarray, shape (1,), dtype ERROR
        Its errors, such as ``store.errors(slice(17, 18))``.
    title : str
        Headline.
    """
    panels = views.errors_of(joint, operation, errors, "Seen along z and along t of each pin", "row")
    return drawing.sheet(panels, title or "Errors of one joint", ROW)


def errors_in_numbers(joint: joints.Joint, operation: joints.Operation, errors: NDArray[np.void]) -> Rows:
    """Errors of each pin and hole, see `views.numbers`; parameters as of `draw_row`."""
    return views.numbers(joint, operation, errors)


def meanings() -> Rows:
    """Kinds of errors: ``error``, and what ``a positive value`` does."""
    return [{"error": error, "a positive value": meaning} for error, meaning in views.MEANINGS.items()]
