"""Which errors make a load scatter at which input angle: from histories of joints, or from joints simulated again."""

from __future__ import annotations

import math
from collections.abc import Container, Iterator, Mapping, Sequence
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import sensitivity
from tolstat.analysis.sensitivity import FirstOrder
from tolstat.common.channels import CHANNELS
from tolstat.common.errors import Fault, InputError, NotApplicable
from tolstat.common.loads import FloatArray, unit_text
from tolstat.common.strict import did_you_mean
from tolstat.common.tables import VALID, Status
from tolstat.display import drawing, style
from tolstat.display.answer import Answer, Asked, Axes, Column, Panel, Panels, Part, Sentence, Table
from tolstat.display.options import Load, Opt, Top
from tolstat.questions.shares import ORIGIN, between, check_sample, percent, with_ends, word
from tolstat.store import revolutions
from tolstat.store.hdf5 import store_error
from tolstat.store.view import View

JOINTS = 1000
"""Default number of joints evaluated, the first settled ones: some 2 s if they are simulated again."""
MIN_JOINTS = 100
"""Minimum number of joints for shares to be given."""
SPREAD = (0.05, 0.5, 0.95)
"""Shares of the joints at which quantiles of the load are shown."""
TITLE = "Causes over the input angle"
LINES = 4
"""Number of errors whose share is drawn."""
OVER_REVOLUTION = "Share of the variance over the whole revolution, every angle counted by its variance"


COLUMNS = (
    Column("load", word("load"), shown=lambda rows: len({row["load"] for row in rows}) > 1),
    Column("error", word("error"), words=True),
    Column("revolution, %", percent("share")),
    Column("95 % interval", between("share")),
    Column("largest, %", percent("largest")),
    Column("at, deg", lambda row: f"{math.degrees(row['theta']):.0f}"),
)
"""Columns of the table ``revolution``."""


def angles(
    view: View,
    by: Load = None,
    joints: Annotated[int, Opt("N", least=MIN_JOINTS)] = JOINTS,
    top: Top = 12,
    logarithm: bool = False,
) -> Answer:
    """Compute which errors scatter a load at each angle.

    Gives for each error the share of the load's variance that it explains alone, over the whole revolution and at the
    angle of its largest share (first-order Sobol' indices). With --out writes the shares at each angle, and pictures.
    Joints are simulated again if FILE has no load histories.

    Example: tolstat angles iso2768_f.h5 --by cross1.F

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    by : str, optional
        Force or torque, such as cross1.F or output.moment; by default the load whose limit most joints exceed.
    joints : int
        Number of joints used, the first settled ones.
    top : int
        Number of errors in the printed table.
    logarithm : bool
        Explain the variance of the load's logarithm instead of the load's.

    Returns
    -------
    Answer
        Table ``revolution``, one row per error: ``load``, ``error``, ``share`` with ends, ``largest`` share at any
        angle, at ``theta``. Table ``angles``, one row per angle and error: ``theta``, ``load``, ``unit``, ``std``,
        ``error``, ``share`` with ends.

    Raises
    ------
    InputError
        When a name is not a load over the input angle.
    StoreError
        See `against_angle`.
    """
    view, load = view.narrowed(by or view.most_exceeded)
    (indices,) = against_angle(view, [load], joints, (load,) if logarithm else ())
    std = np.sqrt(indices.first.variance).tolist()
    rows = [
        {"theta": theta, "load": load, "unit": indices.facts["unit"], "std": std[k], "error": name}
        | with_ends("share", (end[i, k] for end in indices.first[:3]))
        for k, theta in enumerate(indices.angles.tolist())
        for i, name in enumerate(indices.names)
    ]
    parts = _parts([indices], indices.names[:top])
    parts.insert(2, Table("angles", "Shares at each input angle", (), rows, {"theta": "rad"}))
    return Answer("angles", TITLE, parts, indices.facts)


def angles_on_page(view: View, asked: Asked) -> Answer:
    """Causes of the leading loads over the input angle; of a load with a long tail, those of its logarithm."""
    followed = [load for load in view.leading if load in CHANNELS]
    cannot = view.method == "sweep" or not view.count(*VALID) or view.design.refuses("index")
    if cannot or not (asked.replay and followed) or len(view.points) > 1:  # histories are those of one point
        raise NotApplicable
    with asked.noting("nothing over the input angle"):
        logarithmic = {load.name for load in view.loads(view.leading) if load.long_tailed}
        each = against_angle(view, followed, asked.replay, logarithmic)
        return Answer("angles", TITLE, _parts(each, {name for indices in each for name in indices.names[:LINES]}))
    raise NotApplicable


class AgainstAngle(NamedTuple):
    """First-order indices of a load at each input angle.

    Attributes
    ----------
    facts : mapping
        ``load`` (the load at an angle, not its largest over the revolution), its SI ``unit``; ``logarithm``, whether
        the variance of the logarithm is decomposed; ``joints`` evaluated; ``origin`` and ``apart``, as in
        `revolutions.Revolutions`; ``additive``, share of the variance over the revolution that all errors explain
        alone.
    angles : ndarray, shape (k,)
        Input angles, rad.
    nominal : ndarray, shape (k,)
        Load of the nominal joint; NaN if there is none that settled.
    spread : ndarray, shape (3, k)
        Quantiles of the load over the joints, at the shares `SPREAD`.
    names : tuple of str
        The d errors, in descending order of their share over the revolution.
    first : FirstOrder
        Shares of the variance at each angle, (d, k); variance (k,).
    overall : FirstOrder
        Shares over the whole revolution, (d,).
    """

    facts: Mapping[str, Any]
    angles: FloatArray
    nominal: FloatArray
    spread: FloatArray
    names: tuple[str, ...]
    first: FirstOrder
    overall: FirstOrder

    @property
    def quantity(self) -> str:
        """Name of the decomposed quantity: the load, or its logarithm."""
        return f"log {self.facts['load']}" if self.facts["logarithm"] else str(self.facts["load"])


def against_angle(
    view: View, loads: Sequence[str], joints: int = JOINTS, logarithmic: Container[str] = ()
) -> list[AgainstAngle]:
    """Find which errors make loads scatter at which input angle.

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    loads : sequence of str
        Keys of `channels.CHANNELS`: ``cross1.F``, ``output.moment``.
    joints : int
        Number of joints evaluated, the first settled ones. Without stored histories they are simulated again.
    logarithmic : container of str
        Loads for which the variance of the logarithm is decomposed.

    Returns
    -------
    list of AgainstAngle
        One for each load.

    Raises
    ------
    InputError
        When a name is not a load over the input angle.
    StoreError
        When the joints are not drawn from tolerances, or fewer than
        `MIN_JOINTS` have settled.
    """
    for name in loads:
        if name not in CHANNELS:
            raise InputError([Fault(name, "is not a load over the input angle", did_you_mean(name, list(CHANNELS)))])
    nominal, samples = evaluated(view, joints)
    histories = revolutions.read(view.store, np.concatenate([nominal, view.slots(samples)]), loads)
    errors = view.errors(samples, sampling.columns(view.study))
    components = {n: x for n, x in sampling.components(view.study, errors).items() if np.ptp(x) > 0}
    x, names, iid = np.column_stack(list(components.values())), list(components), view.design.has_interval("index")
    each = []
    for name in loads:
        without_errors, y = np.split(histories.loads[name], [len(nominal)])
        is_log, drawn = name in logarithmic, without_errors[0] if len(nominal) else np.full(y.shape[1], np.nan)
        of_angles = sensitivity.over_revolution(x, np.log(y) if is_log else y, iid=iid)
        order = np.argsort(-of_angles[1].estimate, kind="stable")
        first, overall = (FirstOrder._make((*(end[order] for end in i[:3]), i.variance)) for i in of_angles)
        facts = {"load": name, "unit": CHANNELS[name].unit, "logarithm": is_log, "joints": len(y)}
        facts |= {"origin": histories.origin, "apart": histories.apart}
        facts["additive"] = float(np.nansum(overall.estimate))
        ordered = tuple(names[i] for i in order)
        each.append(AgainstAngle(facts, histories.angles, drawn, _quantiles(y), ordered, first, overall))
    return each


def spreads(view: View, loads: Sequence[str], joints: int) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Input angles, rad, and quantiles over the joints at the shares `SPREAD`, (3, k), of the loads of `against_angle`.

    Raises as `against_angle`.
    """
    histories = revolutions.read(view.store, view.slots(evaluated(view, joints)[1]), loads)
    return {name: (histories.angles, _quantiles(histories.loads[name])) for name in loads}


def evaluated(view: View, joints: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """File slots of the nominal joint, (1,), if it settled, else (0,); and the samples that `against_angle` evaluates.

    Raises
    ------
    StoreError
        As `against_angle`.
    """
    check_sample(view, "index")
    samples = np.flatnonzero(view.status == Status.OK)[:joints]
    if len(samples) < MIN_JOINTS:
        few = f"has {len(samples)} settled joints to evaluate"
        raise store_error(view.path, few, f"{MIN_JOINTS} are needed: run more joints")
    return view.nominal_slots[view.nominal["status"] == Status.OK], samples


def _quantiles(values: FloatArray) -> FloatArray:
    return np.asarray(np.quantile(values, SPREAD, axis=0, method="inverted_cdf"))


def closed(values: FloatArray) -> FloatArray:
    """Append the first sample of a revolution to its end."""
    return np.concatenate([values, values[..., :1]], axis=-1)


def theta_axis(ax: Axes, theta: FloatArray) -> FloatArray:
    """Set up the x axis for input angles; return the angles in degrees, with 360 appended."""
    ax.set(xlim=(0.0, 360.0), xticks=range(0, 361, 60), xlabel="input shaft angle θ [deg]")
    return np.append(np.degrees(theta), 360.0)


def _parts(each: Sequence[AgainstAngle], shown: Container[str]) -> list[Part]:
    """Pictures; shares over the revolution, of which people see those of the errors `shown`; a note."""
    rows = [
        {"load": indices.facts["load"], "error": name, **with_ends("share", (end[i] for end in indices.overall[:3]))}
        | {"largest": float(indices.first.estimate[i, k]), "theta": float(indices.angles[k])}
        for indices in each
        for i, (name, k) in enumerate(zip(indices.names, indices.first.estimate.argmax(axis=1), strict=True))
    ]
    seen = [row for row in rows if row["error"] in shown]
    table = Table("revolution", OVER_REVOLUTION, COLUMNS, rows, {"theta": "rad"}, seen)
    first = each[0].facts
    alone = (f"{100 * indices.facts['additive']:.0f} % of the variance of {indices.quantity}" for indices in each)
    note = (
        f"All errors alone explain {', '.join(alone)}. Over the input angle: the first {first['joints']} settled "
        f"joints, {ORIGIN[first['origin']]}; bands are the 95 % intervals at each angle. Shares are corrected for "
        "chance: an error without effect has the mean share 0, and its estimate may be negative."
    )
    if first["apart"]:
        apart = f"The largest loads differ by up to {first['apart']:.1e} (relative) from the stored ones"
        note += f" {apart}, which another machine or version computed."
    return [Panels([panel for indices in each for panel in _panels(indices)]), table, Sentence(note)]


def _panels(indices: AgainstAngle) -> Iterator[Panel]:
    """Load over the revolution, and shares of its variance."""
    key, unit, leading = indices.facts["load"], unit_text(indices.facts["unit"]), indices.names[:LINES]
    low, middle, high = indices.spread

    def draw_loads(ax: Axes) -> None:
        theta = theta_axis(ax, indices.angles)
        band = "5 to 95 % of the joints"
        ax.fill_between(theta, closed(low), closed(high), color=style.COLOURS[0], alpha=0.2, lw=0, label=band)
        ax.plot(theta, closed(middle), color=style.COLOURS[0], label="median")
        if np.isfinite(indices.nominal).all():
            nominal: Any = {"color": style.INK, "lw": 1.0, "ls": (0.0, (4.0, 2.0)), "label": "without errors"}
            ax.plot(theta, closed(indices.nominal), **nominal)
        ax.set_ylabel(f"|{key}| [{unit}]")
        ax.set_ylim(0.0, 1.05 * max(high.max(), np.nan_to_num(indices.nominal).max()))

    def draw_shares(ax: Axes) -> None:
        estimate, lower, upper = (100.0 * closed(end[: len(leading)]) for end in indices.first[:3])
        has_bands = np.isfinite(lower).all()
        curves = dict(zip(leading, zip(estimate, lower, upper, strict=True), strict=True))
        drawing.curves(ax, theta_axis(ax, indices.angles), curves, bands=LINES if has_bands else 0)
        ceiling = float(np.nanmax(upper if has_bands else estimate, initial=1.0))
        ax.set(ylim=(0.0, 1.05 * ceiling), ylabel="share of the variance [%]")

    description = (
        f"Median of the joints between {middle.min():.4g} and {middle.max():.4g} {unit} over the input angle; "
        f"95 % of the joints stay below {high.max():.4g} {unit} everywhere"
    )
    size = (drawing.WIDTH, 3.1)
    yield Panel(f"angle-{key}", f"{key} over the revolution", description, draw_loads, size)
    estimates = zip(leading, indices.overall.estimate, strict=False)
    description = f"Over the whole revolution: {', '.join(f'{name} {100 * x:.1f} %' for name, x in estimates)}"
    title = f"{indices.quantity}: share of the variance over the input angle"
    yield Panel(f"angle-shares-{key}", title, description, draw_shares, size)
