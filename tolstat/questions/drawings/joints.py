"""A joint that is to be drawn, its dimensions and errors as plain numbers; figures and tables of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import joint as joints
from tolstat import study
from tolstat.common.errors import Fault, InputError
from tolstat.common.load_kinds import PINS
from tolstat.common.strict import read_toml, validate
from tolstat.common.tables import HOLES
from tolstat.display.joint_drawing import sheets
from tolstat.display.joint_drawing.geometry import MEANINGS, Dimensions, Feature, Pair, clearance
from tolstat.display.table import Rows
from tolstat.joint import Joint, Operation, nominal_errors, perturb
from tolstat.joint.perturbation import ARM_TRIADS, PIN_TRIADS
from tolstat.kernel.mechanics.topology import ARM, ARM_OF_PIN, FRAME, FRAME_F, FRAME_I, PIN
from tolstat.store import ResultFile
from tolstat.store.recorded import joint_of, operation_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Shown(NamedTuple):
    """A joint to be drawn: the nominal joint, its misalignment (rad), a headline, the errors of a row, (1,) ERROR."""

    joint: Joint
    alpha: float
    title: str
    errors: NDArray[np.void] | None = None


def read(source: str | Path, row: int | None = None, alpha: str | None = None) -> Shown:
    """Read the joint to be drawn.

    Parameters
    ----------
    source : str or Path
        Name of a joint that comes with the package, a joint file, study or case (TOML), or a result file (HDF5).
    row : int, optional
        Row of the campaign whose errors are drawn; of a result file.
    alpha : str, optional
        Misalignment in place of the source's own, ``"20 deg"``; a joint file has none: 15 deg by default.

    Raises
    ------
    InputError, StoreError
        When there is no such joint, row or misalignment, or a file cannot be read.
    """
    path = Path(source)
    given = validate(Operation, {"alpha": alpha or "15 deg", "speed": "1 rpm", "torque": "1 N*m"}, "--alpha").alpha
    if path.is_file() and path.suffix != ".toml":
        with ResultFile.open(path) as store:
            shown = _of_file(store, row)
    elif row is not None:
        raise InputError([Fault(str(source), "has no rows, which --row asks for", "give a result file: FILE.h5")])
    elif path.suffix == ".toml" and not {"joint", "operation"}.isdisjoint(data := read_toml(path)):
        case = study.load(path) if "sampling" in data else study.load_case(path)
        first = case.points[0].name if isinstance(case, study.Study) else ""
        shown = Shown(case.joint, case.operation.alpha, f"{path.stem}, at {first}" if first else path.stem)
    else:
        try:
            joint = joints.load(source, {}, str(source))
        except InputError as error:
            if path.suffix == ".toml":
                raise
            remedy = error.faults[0].remedy
            raise InputError([Fault(str(source), "is neither a file nor the name of a joint", remedy)]) from error
        shown = Shown(joint, given, joint.description or path.stem)
    return shown._replace(alpha=given) if alpha else shown


def _of_file(store: ResultFile, row: int | None) -> Shown:
    """Joint of a result file, of its first slot or of a row; of several operating points at the first."""
    at = store.each()[0]
    if row is None:
        where = f", at {at.point}" if at.point else ""
        return Shown(joint_of(store, 0), at.operation.alpha, f"{store.study_name}{where}")
    if row not in store.rows:
        found = f"has rows {store.rows[0]} to {store.rows[-1]}, not {row}"
        raise InputError([Fault(str(store.path), found, f"give one of these rows, for example --row {store.rows[0]}")])
    slot = store.slot(row)
    errors = store.errors(slice(slot, slot + 1))
    return Shown(joint_of(store, slot), operation_of(at, slot).alpha, f"{store.study_name}, row {row}", errors)


def dimensions(joint: Joint, alpha: float) -> Dimensions:
    """Dimensions of a joint and the pose of its ideal parts at the input angle 0, at a misalignment (rad)."""
    cos, sin = np.cos(alpha), np.sin(alpha)
    output = np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]])
    frames = np.array([output if FRAME[body] == FRAME_F else np.eye(3) for body in range(PIN, ARM + 4)])
    triads = np.concatenate([PIN_TRIADS, ARM_TRIADS]) @ frames.transpose(0, 2, 1)
    R, r_b, l_f, contact = joint.cross.R, joint.cross.r_b, joint.arm.l_f, joint.contact
    along = np.array([-l_f if FRAME[body] == FRAME_I else l_f for body in range(ARM, ARM + 4)])
    return Dimensions(
        R=R,
        r_b=r_b,
        l_f=l_f,
        pin=contact.D_P,
        hole=contact.D_H,
        z=contact.z,
        alpha=alpha,
        root=max(R - joint.pin.l, 0.1 * R),
        neck=min(joint.pin.d, contact.D_P),
        arm=(_side(joint, joint.arm.Jy), _side(joint, joint.arm.Jx)),
        triads=triads,
        markers=np.concatenate([r_b * triads[:4, 0], R * triads[4:, 0] + along[:, None] * triads[4:, 2]]),
        arm_of_pin=tuple(int(arm) for arm in ARM_OF_PIN),
    )


def _side(joint: Joint, inertia: float) -> float:
    """Diameter of a round arm, or side of a rectangular section with this second moment of area, m."""
    return joint.arm.d or float(np.sqrt(12.0 * inertia / joint.arm.A))


def pairs(joint: Joint, errors: NDArray[np.void]) -> list[Pair]:
    """Pins 1 to 4 with the holes that they turn in, of one joint; an error of the clearance widens the hole.

    Parameters
    ----------
    joint : Joint
        The nominal joint.
    errors : ndarray, shape (1,), dtype ERROR
        Its errors.
    """
    par = perturb(joint, Operation.model_construct(alpha=0.0, speed=1.0, torque=0.0), errors)[0]
    found = []
    for i, arm in enumerate(ARM_OF_PIN):
        pin, hole = ({kind: float(errors[f"{name}.{kind}"][0]) for kind in MEANINGS} for name in (PINS[i], HOLES[arm]))
        thick, t, u = joint.contact.D_P + pin["diameter"], PIN_TRIADS[i], ARM_TRIADS[arm]
        wide = thick + 2.0 * float(par["clearance"][i])
        inner = Feature(PINS[i], thick, t @ par["pin_point"][i], t @ par["pin_axis"][i], pin)
        outer = Feature(HOLES[arm], wide, u @ par["hole_point"][arm], u @ par["hole_axis"][arm], hole)
        found.append((inner, outer))
    return found


def positive(joint: Joint) -> dict[str, Pair]:
    """Pin 1 and hole 4, each with a positive error of one kind, by kind; large enough to be drawn as they are."""
    unit = 0.5 * (joint.contact.D_P + joint.contact.z)
    sizes = {"offset": 0.26 * unit, "tilt": np.radians(15.0), "diameter": 0.4 * unit}
    found = {}
    for kind in MEANINGS:
        errors = nominal_errors(1)
        for name in (PINS[0], HOLES[ARM_OF_PIN[0]]):
            errors[f"{name}.{kind}"] = sizes[kind.partition("_")[0]]
        found[kind] = pairs(joint, errors)[0]
    return found


def draw_joint(joint: Joint, alpha: float, title: str = "", columns: int = 2) -> Figure:
    """Draw a joint from its dimensions: the cross in its holes, both shafts, bushings, dimensions.

    Parameters
    ----------
    joint : Joint
        The nominal joint, such as ``study.joint``.
    alpha : float
        Misalignment, rad.
    title : str
        Headline; the joint's description by default.
    columns : int
        Number of drawings side by side: 1 for a narrow page.

    Returns
    -------
    matplotlib.figure.Figure
        Its parts have their names as ids in an SVG.
    """
    panels = sheets.joint(dimensions(joint, alpha))
    return sheets.figure(panels, title or joint.description or "Cardan joint", sheets.NOTES, columns)


def draw_errors(joint: Joint) -> Figure:
    """Draw what a positive error of each kind means, on pin 1 and hole 4 of a joint."""
    panel = sheets.errors(positive(joint), dimensions(joint, 0.0))
    return sheets.figure([panel], "Errors of a pin and a hole", sheets.ERRORS)


def draw_row(joint: Joint, errors: NDArray[np.void], title: str = "") -> Figure:
    """Draw the errors of one joint, enlarged together with its clearances, and write them beside the drawing.

    Parameters
    ----------
    joint : Joint
        The nominal joint.
    errors : ndarray, shape (1,), dtype ERROR
        Errors of the joint, such as ``store.errors(slice(17, 18))``.
    title : str
        Headline.
    """
    d = dimensions(joint, 0.0)
    panel = sheets.one(pairs(joint, errors), d, "Seen along z and along t of each pin", "row")
    return sheets.figure([panel], title or "Errors of one joint")


def lengths(joint: Joint, alpha: float) -> Rows:
    """Dimensions on the drawing: ``dimension``, ``value`` with its unit, ``meaning``."""
    d, arm = dimensions(joint, alpha), joint.arm
    rows = [
        ("cross.R", d.R, "centre of the joint to the middle of pin and hole"),
        ("cross.r_b", d.r_b, "centre of the joint to a cross bushing"),
        ("arm.l_f", d.l_f, "middle of a hole to a fork bushing, along the shaft"),
        ("contact.D_P", d.pin, "diameter of the pins"),
        ("contact.D_H", d.hole, "diameter of the holes"),
        ("clearance", 0.5 * (d.hole - d.pin), "radial clearance"),
        ("contact.z", d.z, "length of the contact"),
        ("pin.d", joint.pin.d, "diameter of a pin's beam"),
        ("pin.l", joint.pin.l, "length of a pin's beam"),
        ("arm.width", arm.width, "side of an arm's section along t"),
        ("arm.depth", arm.depth, "side of an arm's section along e"),
        ("arm.d", arm.d, "diameter of a round arm"),
    ]
    found = [(name, f"{1e3 * x:.5g} mm", meaning) for name, x, meaning in rows if x is not None]
    found.append(("operation.alpha", f"{np.degrees(alpha):.5g} deg", "misalignment of the shafts"))
    return [dict(zip(("dimension", "value", "meaning"), row, strict=True)) for row in found]


def meanings() -> Rows:
    """Kinds of errors: ``error``, and what ``a positive value`` does."""
    return [{"error": error, "a positive value": meaning} for error, meaning in MEANINGS.items()]


def numbers(joint: Joint, errors: NDArray[np.void]) -> Rows:
    """Errors of a joint, one row for each pin and hole, with the radial clearance of the pair.

    e, t, z: offsets; ⌀: deviation of the diameter. Lengths in mm, tilts in degrees, to four decimals.
    """
    heads = ("feature", "e [mm]", "t [mm]", "z [mm]", "tilt t [°]", "tilt z [°]", "⌀ [mm]", "gap [mm]")
    rows = []
    for pair in pairs(joint, errors):
        for part in pair:
            own = (np.degrees(x) if kind.startswith("tilt") else 1e3 * x for kind, x in part.errors.items())
            cells = [part.name, *(round(float(x), 4) for x in (*own, 1e3 * clearance(pair)))]
            rows.append(dict(zip(heads, cells, strict=True)))
    return rows
