"""Loads over the input angle: the band of the joints, and the error that scatters each load at its peak."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.analysis import sensitivity
from tolstat.analysis.sample import CONFIDENCE
from tolstat.common.channels import channels, histories_of
from tolstat.common.errors import TolstatError
from tolstat.common.loads import FloatArray, unit_text
from tolstat.common.tables import Status
from tolstat.display import drawing, style, text
from tolstat.display.answer import Asked, Axes, Panel, Panels, Part, Sentence
from tolstat.questions.shares import ORIGIN
from tolstat.store import revolutions
from tolstat.store.view import View

JOINTS = 1000
"""Default number of joints evaluated, the first settled ones."""
MIN_JOINTS = 100
"""Minimum number of settled joints."""
SPREAD = (0.05, 0.5, 0.95)
"""Shares of the joints at which quantiles of the load are shown."""


class Band(NamedTuple):
    """A load over the input angle.

    Attributes
    ----------
    load : str
        Its name.
    unit : str
        Its SI unit.
    theta : ndarray, shape (k,)
        Input angles, rad.
    nominal : ndarray, shape (k,)
        Load of the nominal joint, N or N m; NaN if there is none that settled.
    spread : ndarray, shape (3, k)
        Quantiles over the joints at the shares `SPREAD`, N or N m.
    """

    load: str
    unit: str
    theta: FloatArray
    nominal: FloatArray
    spread: FloatArray

    @property
    def peak(self) -> int:
        """Number of the angle at which the upper end of the band is largest."""
        return int(self.spread[2].argmax())


def followed(view: View, names: Sequence[str]) -> list[str]:
    """Those of some loads that are followed over the input angle; of several operating points none."""
    return [] if len(view.points) > 1 else [name for name in names if name in channels(view.mechanism)]


def over_angle(view: View, loads: Sequence[str], joints: int = JOINTS) -> list[Part]:
    """Pictures of loads over the input angle, and which error scatters each of them at its peak.

    Parameters
    ----------
    view : View
        A campaign whose joints are drawn from tolerances.
    loads : sequence of str
        Names in `channels.channels`; without any, there are no parts.
    joints : int
        Number of joints evaluated, the first settled ones. Without stored histories they are simulated again.

    Raises
    ------
    InputError
        When a joint has to be simulated again and this version cannot read the file's joint or options.
    """
    nominal, samples = _evaluated(view, joints)
    if not loads:
        return []
    if len(samples) < MIN_JOINTS:
        return [
            Sentence(
                f"nothing over the input angle: {len(samples)} settled joints to evaluate, {MIN_JOINTS} are needed"
            )
        ]
    found = revolutions.read(view.store, np.concatenate([nominal, view.slots(samples)]), loads)
    errors = sampling.components(view.study, view.errors(samples, sampling.columns(view.study)))
    x, panels, peaks = np.column_stack(list(errors.values())), list[Panel](), list[str]()
    for name in loads:
        without_errors, values = np.split(found.loads[name], [len(nominal)])
        drawn = without_errors[0] if len(nominal) else np.full(values.shape[1], np.nan)
        quantiles = np.asarray(np.quantile(values, SPREAD, axis=0, method="inverted_cdf"))
        band = Band(name, channels(view.mechanism)[name].unit, found.angles, drawn, quantiles)
        panels.append(_panel(band))
        index = sensitivity.first_order(x, values[:, band.peak], view.design.level(CONFIDENCE), view.design.independent)
        peaks.append(_at_peak(band, list(errors), index))
    how = f"Over the input angle: the first {len(samples)} settled joints, {ORIGIN[found.origin]}."
    if found.apart:
        how += f" Their largest loads differ by up to {found.apart:.1e} (relative) from the stored ones, which another "
        how += "machine or version computed."
    return [Panels(panels), Sentence(" ".join([*peaks, how]))]


def begin_replay(view: View, asked: Asked) -> None:
    """Begin to simulate again the joints whose loads over the input angle the page shows; see `revolutions.ahead`."""
    with suppress(TolstatError):  # the questions say what is wrong
        view.check_drawn()
        view.check()
        loads, (nominal, samples) = followed(view, view.leading), _evaluated(view, asked.replay)
        has_enough, histories = len(samples) >= MIN_JOINTS, histories_of(loads, view.mechanism)
        if loads and has_enough and not revolutions.held(view.store, histories):
            revolutions.ahead(view.store, np.concatenate([nominal, view.slots(samples)]), asked.processes)


def _evaluated(view: View, joints: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """File slots of the nominal joint, (1,), if it settled, else (0,); and the first settled samples."""
    samples = np.flatnonzero(view.status == Status.OK)[:joints]
    return view.nominal_slots[view.nominal["status"] == Status.OK], samples


def _at_peak(band: Band, errors: Sequence[str], index: sensitivity.FirstOrder) -> str:
    """Sentence on the error that explains most of the variance of a load at its peak, alone; `index` there."""
    top = f"{band.load} has its peak at {math.degrees(band.theta[band.peak]):.0f}°"
    top += f", where 5 % of the joints exceed {text.value(band.spread[2, band.peak], band.unit)}"
    if np.isnan(index.estimate).all():
        return f"{top}."
    most = int(np.nanargmax(index.estimate))
    share, low, high = (100.0 * end[most] for end in (index.estimate, index.lower, index.upper))
    interval = "" if math.isnan(low) else f" (95 % interval {low:.0f} .. {high:.0f} %)"
    return f"{top}; {errors[most]} scatters it most there, {share:.0f} % of the variance{interval}."


def _panel(band: Band) -> Panel:
    unit, (_, middle, high) = unit_text(band.unit), band.spread
    words = f"Median of the joints between {middle.min():.4g} and {middle.max():.4g} {unit} over the input angle; "
    words += f"95 % of the joints stay below {high.max():.4g} {unit} everywhere"
    title = f"{band.load} over the revolution"
    return Panel(f"angle-{band.load}", title, words, partial(_draw, band=band), (drawing.WIDTH, 3.1))


def _draw(ax: Axes, band: Band) -> None:
    theta, *loads = (np.append(values, values[0]) for values in (np.degrees(band.theta), band.nominal, *band.spread))
    theta[-1] = 360.0
    nominal, low, middle, high = loads
    label = "5 to 95 % of the joints"
    ax.fill_between(theta, low, high, color=style.COLOURS[0], alpha=0.2, lw=0, label=label)
    ax.plot(theta, middle, color=style.COLOURS[0], label="median")
    if np.isfinite(nominal).all():
        look: Any = {"color": style.INK, "lw": 1.0, "ls": (0.0, (4.0, 2.0)), "label": "without errors"}
        ax.plot(theta, nominal, **look)
    ax.set(xlim=(0.0, 360.0), xticks=range(0, 361, 60), xlabel="input shaft angle θ [deg]")
    ax.set_ylabel(f"|{band.load}| [{unit_text(band.unit)}]")
    ax.set_ylim(0.0, 1.05 * max(high.max(), np.nan_to_num(nominal).max()))
