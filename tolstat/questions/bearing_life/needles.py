"""Load along the needles of the joint with the shortest life, which is simulated again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.load_kinds import RESULTANT
from tolstat.common.loads import FloatArray
from tolstat.common.mechanism import Mechanism, prefixes
from tolstat.common.parameters import LAMINAE, PLACE, RELIEF
from tolstat.common.tables import Options
from tolstat.display import style, text
from tolstat.display.answer import Axes, Panel, Panels, Part
from tolstat.questions.bearing_life.lives import Lives
from tolstat.solver.compilation import warm_up
from tolstat.solver.simulation import simulate_rows
from tolstat.store import Reader, recorded

KEY = "needles"
"""Begins the keys of the pictures."""


class Pressed(NamedTuple):
    """The most loaded needle of each bearing of a joint, at the instant at which a lamina of it is loaded most.

    Attributes
    ----------
    x : ndarray, shape (pins, LAMINAE)
        Distance of the laminae from the middle of the needle, outward, m.
    load : ndarray, shape (pins, LAMINAE)
        Load of each lamina by its length, N/m.
    """

    x: FloatArray
    load: FloatArray


def line_loads(ends: tuple[float, float, float], clearance: float, kind: int, par: np.record) -> FloatArray:
    """Load by length of each lamina of the needle with the most loaded one, N/m, (LAMINAE,); eqs. (38) to (41).

    Arguments as of `kernel.revolution.laminae.lamina_load`, but that the pin is displaced as the force wants it.
    """
    (r, along, across), (x, relief) = ends, par.lamina[kind, [PLACE, RELIEF]]
    moved = np.array([r + x * along, x * across])
    far = np.hypot(*moved)
    most = (far - relief).argmax()
    approach = moved[:, most] @ moved / far[most] - clearance - relief
    return np.asarray(par.needle_k[kind] * np.maximum(approach, 0.0) ** (10.0 / 9.0) / (2.0 * par.needle_half[kind]))


def pressed(params: NDArray[np.void], options: Options, mechanism: Mechanism) -> Pressed:
    """Simulate one joint, (1,) table PARAM with the dimensions of its bearings, and look at its needles."""
    from tolstat.kernel.revolution.bearing import tilt_of
    from tolstat.kernel.revolution.laminae import lamina_load

    warm_up(mechanism=mechanism)
    histories = simulate_rows(params, options, "bearings", mechanism=mechanism).histories
    par, work, found = params.view(np.recarray)[0], np.empty((6, LAMINAE)), []
    for pin, kind in enumerate(par.pair_kind):
        most, load = 0.0, np.zeros(LAMINAE)
        for products, forces in zip(histories["ends"][0, :, pin], histories["contact"][0, :, pin], strict=True):
            (r, *ends), clearance = tilt_of(pin, products, par)[1], par.clearance[pin]
            line, more = lamina_load(float(forces[RESULTANT]), (r, *ends), 0.0, clearance, kind, par, work)[1:]
            if line > most:
                most, load = line, line_loads((r + more, *ends), clearance, kind, par)
        found.append((par.needle_half[kind] * par.lamina[kind, PLACE], load))
    return Pressed(*map(np.array, zip(*found, strict=True)))


def pictures(lives: Lives) -> list[Part]:
    """Pictures of the needles in the joint with the shortest life, one for each Cardan joint; none without a life.

    Of several operating points that with the largest line load is shown. The joint is simulated as it is drawn.
    """
    view, hours = lives.view, lives.hours[:, -1]
    if not np.isfinite(hours).any():
        return []
    sample = np.nanargmin(hours)
    slot = int(view.slots(sample))
    stored = [part.store.results(slice(slot, slot + 1), ("line_load",))["line_load"][0] for part in view.parts]
    largest = np.max(stored, axis=0)
    if not np.isfinite(largest).all():
        return []
    point = int(np.max(stored, axis=1).argmax())
    again = cache(partial(_again, view.parts[point].store, [slot, *view.nominal_slots]))
    at = f" at {view.points[point]}" if len(view.points) > 1 else ""
    title = f"Row {view.rows([sample])[0]}{at}, shortest life of all: load along the needle that is pressed most"
    panels = []
    for joint in prefixes(view.mechanism):
        pins = [k for k, pin in enumerate(lives.pins) if pin.startswith(joint)]
        most = ", ".join(f"{lives.pins[k]} {text.number(1e-3 * largest[k])} N/mm" for k in pins)
        words = f"Load of the most loaded needle of each bearing by its length, when it is largest; at most {most}"
        draw = partial(_draw, again=again, pins=pins, names=lives.pins)
        panels.append(Panel(f"{KEY}-{joint}".rstrip("-."), title, words, draw, (6.4, 3.5)))
    return [Panels(panels)]


def is_picture(part: Part) -> bool:
    """Whether a part of the answer is one of `pictures`."""
    return isinstance(part, Panels) and part.panels[0].key.startswith(KEY)


def _again(store: Reader, slots: Sequence[int]) -> list[Pressed]:
    def joint(slot: int) -> Pressed:
        options = recorded.options_of(store, slot, int(store.attempt(slice(slot, slot + 1))[0]))
        return pressed(recorded.parameters(store, np.array([slot])), options, store.mechanism)

    return [joint(int(slot)) for slot in slots]


def _draw(ax: Axes, again: Callable[[], list[Pressed]], pins: Sequence[int], names: Sequence[str]) -> None:
    worst, *nominal = again()
    for i, pin in enumerate(pins):
        ax.plot(1e3 * worst.x[pin], 1e-3 * worst.load[pin], **style.curve(i), label=names[pin])
        for joint in nominal:
            ax.plot(1e3 * joint.x[pin], 1e-3 * joint.load[pin], **style.curve(i) | {"lw": 0.8})
    if nominal:
        ax.plot([], [], color=style.INK, lw=0.8, label="thin: without errors")
    ax.set(xlabel="distance from the middle of the needle, outward [mm]", ylabel="load by length [N/mm]")
    ax.set_ylim(bottom=0.0)
