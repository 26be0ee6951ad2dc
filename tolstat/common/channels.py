"""Registry of the loads over the input angle: what histories hold, the channels and the signals that follow from it.

They follow from the components of the kinds of loads, `load_kinds.LOAD_KINDS`. A channel is drawn over the input angle;
cycles are counted of a signal, which has a sign.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.load_kinds import BUSHINGS, LOAD_KINDS, PLACES, SHAFTS, Kind


class LoadHistory(NamedTuple):
    """Loads over the input angle that histories hold in one array, (samples, places, components).

    Attributes
    ----------
    name : str
        Name of the array in full histories.
    prefix : str
        What stands before ``coefficients_real``, ``cycles`` and ``channel`` in the names of what is made of it.
    places : tuple of str
        Names in `PLACES`.
    components : tuple of str
        Components at each place, those of forces first.
    axes : tuple of str
        Names of the axes of places and components in a result file.
    meaning, signals : str
        What it holds, and what the channels are that follow from it, for the reader of the file.
    """

    name: str
    prefix: str
    places: tuple[str, ...]
    components: tuple[str, ...]
    axes: tuple[str, str]
    meaning: str
    signals: str

    @property
    def shape(self) -> tuple[int, int]:
        """Number of places and of components."""
        return len(self.places), len(self.components)


FOLLOWED = tuple(kind for kind in LOAD_KINDS if kind.components)
"""Kinds whose components histories and cycles hold."""
MEASURING = tuple(kind for kind in FOLLOWED if not kind.measure)
"""Those that the others are measured against: force and torque of a bushing."""
BUSHING_LOADS = LoadHistory(
    "loads",
    "",
    BUSHINGS,
    ("F_e", "F_t", "F_z", "T_e", "T_t", "T_z"),
    ("bushing", "component"),
    "force e, t, z (N), torque e, t, z (N m) of bushings cross 1-4, fork 1-4 on the lump, in base marker axes",
    "of bushings cross 1-4, fork 1-4 in turn: force e, t, z, torque e, t, z",
)
SHAFT_LOADS = LoadHistory(
    "shafts",
    "shaft_",
    SHAFTS,
    ("f_x", "f_y", "f_z", "m_x", "m_y", "m_z"),
    ("shaft", "shaft_component"),
    "force x, y, z (N) and moment x, y, z (N m) about O that the joint exerts on input and output shaft, in axes that "
    "do not turn: z along the shaft, y along the fork's pins at theta = 90 deg",
    "of input and output shaft in turn: force x, y, z, moment x, y, z",
)
LOAD_HISTORIES = (BUSHING_LOADS, SHAFT_LOADS)
"""Registry of the loads over the input angle."""


class Channel(NamedTuple):
    """A load over the input angle: a component, or the modulus of several, which is a load of `LOAD_KINDS`.

    Attributes
    ----------
    name : str
        ``cross1.F_e``, ``cross1.F``, ``output.moment``.
    kind : Kind
        Kind of the load.
    place : str
        Where it acts.
    history : LoadHistory
        What holds its components.
    components : slice
        Its components among those of the history.
    is_modulus : bool
        Whether it is the modulus of its components.
    """

    name: str
    kind: Kind
    place: str
    history: LoadHistory
    components: slice
    is_modulus: bool

    @property
    def unit(self) -> str:
        """SI unit."""
        return self.kind.unit

    def of(self, loads: Mapping[str, NDArray[np.floating]]) -> NDArray[np.float64]:
        """Values (...,), N or N m, of histories by name, each (..., places, components)."""
        index = self.history.places.index(self.place)
        values: NDArray[np.float64] = loads[self.history.name][..., index, self.components].astype(float)
        return np.asarray(np.linalg.norm(values, axis=-1) if self.is_modulus else values[..., 0])


def _channels() -> Iterator[Channel]:
    """Components, then moduli, of each place."""
    for history in LOAD_HISTORIES:
        kinds = [kind for kind in FOLLOWED if set(kind.components) <= set(history.components)]
        kind_of = {component: kind for kind in kinds for component in kind.components}
        for place in history.places:
            for i, name in enumerate(history.components):
                yield Channel(f"{place}.{name}", kind_of[name], place, history, slice(i, i + 1), False)
            for kind in (kind for kind in kinds if place in kind.places):
                first = history.components.index(kind.components[0])
                span = slice(first, first + len(kind.components))
                yield Channel(f"{place}.{kind.symbol}", kind, place, history, span, True)


CHANNELS = {channel.name: channel for channel in _channels()}
"""Loads over the input angle by name, history after history."""


class Signal(NamedTuple):
    """Sum of the components at one place, each times a factor: a component, a direction, or the stress at a point.

    Attributes
    ----------
    name : str
        ``cross1.F_t``, ``cross1.F at 30 deg``. Of several with one name, the worst counts.
    unit : str
        SI unit.
    history : LoadHistory
        What holds the components.
    place : str
        Where they act.
    factors : tuple of float
        Factor of each component of the history.
    """

    name: str
    unit: str
    history: LoadHistory
    place: str
    factors: tuple[float, ...]


def _components() -> Iterator[Signal]:
    for channel in CHANNELS.values():
        if not channel.is_modulus:
            factors = np.zeros(len(channel.history.components))
            factors[channel.components] = 1.0
            yield Signal(channel.name, channel.unit, channel.history, channel.place, tuple(factors.tolist()))


COMPONENTS = {signal.name: signal for signal in _components()}
"""Components by name, history after history."""


def _planes() -> Iterator[tuple[str, tuple[str, str]]]:
    for channel in CHANNELS.values():
        names = channel.history.components[channel.components]
        if len(names) == 3:  # of a bushing: across the arm's axis z, across the pin's axis e
            names = names[:2] if PLACES[channel.place].group == "fork" else names[1:]
        if len(names) == 2:
            yield channel.name, (f"{channel.place}.{names[0]}", f"{channel.place}.{names[1]}")


PLANES = dict(_planes())
"""Two components across the axis of pin, arm or shaft, by name of a modulus: of ``cross1.F`` those along t and z."""
WORST = "worst"
AROUND = 24
"""Number of directions in half a turn of which the worst counts (opposite ones have the same cycles); the load between
two of them is at most 1 - cos(3.75 deg), 0.2 %, above theirs."""


def signals_of(name: str) -> tuple[Signal, ...]:
    """Signals of a name: of a component, ``cross1.F_t``; along a direction, ``cross1.F at 30 deg``, ``... at worst``.

    The angle is from the first component of `PLANES` towards the second.
    """
    if name in COMPONENTS:
        return (COMPONENTS[name],)
    plane, _, direction = name.partition(" at ")
    first, second = (COMPONENTS[component] for component in PLANES[plane])
    degrees = 180.0 * np.arange(AROUND) / AROUND if direction == WORST else [float(direction.removesuffix(" deg"))]
    angles = np.radians(degrees)
    factors = np.outer(np.cos(angles), first.factors) + np.outer(np.sin(angles), second.factors)
    return tuple(first._replace(name=name, factors=tuple(each)) for each in factors.tolist())


def unit_of(name: str) -> str:
    """SI unit of a signal, by its name."""
    return signals_of(name)[0].unit


def histories_of(names: Iterable[str]) -> tuple[LoadHistory, ...]:
    """Histories that channels follow from, in the order of `LOAD_HISTORIES`."""
    used = {CHANNELS[name].history for name in names}
    return tuple(history for history in LOAD_HISTORIES if history in used)
