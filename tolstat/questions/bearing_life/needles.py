"""Load along the needles of the joint with the shortest life, which is simulated again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any

import numpy as np

from tolstat.common.load_kinds import RESULTANT
from tolstat.common.loads import FloatArray
from tolstat.common.mechanism import prefixes
from tolstat.common.parameters import LAMINAE, PLACE, RELIEF
from tolstat.common.tables import VALID
from tolstat.display import style, text
from tolstat.display.answer import Axes, Panel, Panels, Part
from tolstat.questions.bearing_life.lives import Lives
from tolstat.solver.compilation import warm_up
from tolstat.solver.simulation import simulate_rows
from tolstat.store import Reader, recorded


def line_loads(ends: tuple[float, float, float], clearance: float, kind: int, par: Any) -> FloatArray:
    """Load by length of each lamina of the needle that has the most loaded one, N/m, (LAMINAE,).

    Approach and load are those of ISO/TS 16281:2008, eqs. (38) to (41).

    Parameters
    ----------
    ends : tuple of 3 float
        Displacement of the pin's middle with which needles carry its force, m; what a needle's end is displaced beyond
        it, along and across it, m.
    clearance, kind, par
        Radial clearance, m; kind of the pair; the joint, record of PARAM.
    """
    (r, along, across), (x, relief) = ends, par.lamina[kind, [PLACE, RELIEF]]
    moved = np.array([r + x * along, x * across])
    far = np.hypot(*moved)
    most = (far - relief).argmax()
    approach = moved[:, most] @ moved / far[most] - clearance - relief
    return np.asarray(par.needle_k[kind] * np.maximum(approach, 0.0) ** (10.0 / 9.0) / (2.0 * par.needle_half[kind]))


def pressed(store: Reader, slot: int) -> FloatArray:
    """Simulate a joint of a campaign again and look at the needle of each bearing that has the most loaded lamina.

    Parameters
    ----------
    store : Reader
        The campaign at one operating point; its bearings have `joint.bearing.DIAMETERS`.
    slot : int
        File slot of the joint.

    Returns
    -------
    ndarray, shape (pins, 2, LAMINAE)
        Distance of each lamina from the middle of the needle, outward, m, and its load by length, N/m, at the sample
        of the last revolution at which the largest one is largest.

    Raises
    ------
    InputError
        When this version cannot read the file's joint or options.
    """
    from tolstat.kernel.revolution.bearing import tilt_of
    from tolstat.kernel.revolution.laminae import lamina_load

    options = recorded.options_of(store, slot, int(store.attempt(slice(slot, slot + 1))[0]))
    params, work, found = recorded.parameters(store, np.array([slot])), np.empty((6, LAMINAE)), []
    warm_up(mechanism=store.mechanism)
    histories = simulate_rows(params, options, "bearings", mechanism=store.mechanism).histories
    par = params.view(np.recarray)[0]
    for pin, kind in enumerate(par.pair_kind):
        most, loads, clearance = 0.0, np.zeros(LAMINAE), par.clearance[pin]
        for products, forces in zip(histories["ends"][0, :, pin], histories["contact"][0, :, pin], strict=True):
            _, (r, *beyond) = tilt_of(pin, products, par)
            _, line, more = lamina_load(float(forces[RESULTANT]), (r, *beyond), 0.0, clearance, kind, par, work)
            if line > most:
                most, loads = line, line_loads((r + more, *beyond), clearance, kind, par)
        found.append((par.needle_half[kind] * par.lamina[kind, PLACE], loads))
    return np.array(found)


def pictures(lives: Lives) -> list[Part]:
    """Pictures of the needles in the joint with the shortest life, one for each Cardan joint.

    There are none without a life, or of ideal joints. Of several operating points the one with the largest line load is
    shown. The joint is simulated once a picture is drawn.
    """
    view, hours, pressure = lives.view, lives.hours[:, -1], lives.worst["pressure"].max(axis=1)
    known = np.isin(view.status, VALID) & np.isfinite(hours) & np.isfinite(pressure)
    if not known.any():
        return []
    sample = np.where(known, hours, np.inf).argmin()
    slot = int(view.slots(sample))
    stored = np.array([part.read_results(("line_load",))["line_load"][sample] for part in view.parts])
    point = int(stored.max(axis=1).argmax())
    store, slots = view.parts[point].store, (slot, *view.nominal_slots.tolist())
    again = cache(lambda: [pressed(store, one) for one in slots])
    at = f" at {view.points[point]}" if len(view.points) > 1 else ""
    title = f"Load along the most loaded needle, row {view.rows(sample)}{at} (shortest life)"
    panels = []
    for joint in prefixes(view.mechanism):
        pins = {pin: k for k, pin in enumerate(lives.pins) if pin.startswith(joint)}
        most = ", ".join(f"{pin} {text.number(1e-3 * stored[point, k])} N/mm" for pin, k in pins.items())
        words = f"Load of the most loaded needle of each bearing by its length, along the needle; at most {most}"
        panels.append(Panel(f"{joint}needles", title, words, partial(_draw, again=again, pins=pins), (6.4, 3.5)))
    return [Panels(panels)]


def _draw(ax: Axes, again: Callable[[], Sequence[FloatArray]], pins: dict[str, int]) -> None:
    worst, *nominal = again()
    for i, (pin, k) in enumerate(pins.items()):
        ax.plot(1e3 * worst[k, 0], 1e-3 * worst[k, 1], **style.curve(i), label=pin)
    for joint in nominal:
        for k in pins.values():
            ax.plot(1e3 * joint[k, 0], 1e-3 * joint[k, 1], color=style.INK, lw=0.8, label="without errors")
    ax.set(xlabel="distance from the middle of the needle, outward [mm]", ylabel="load by length [N/mm]")
    ax.set_ylim(bottom=0.0)
