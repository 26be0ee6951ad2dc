"""Registry of the loads over the input angle: what histories hold, and the channels that follow from it.

They follow from the components of the kinds of loads, `load_kinds.LOAD_KINDS`. Causes over the input angle, orbits and
load cycles read them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.load_kinds import BUSHINGS, LOAD_KINDS, SHAFTS, Kind


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
    meaning, channels : str
        What it holds, and what the channels are that follow from it, for the reader of the file.
    """

    name: str
    prefix: str
    places: tuple[str, ...]
    components: tuple[str, ...]
    axes: tuple[str, str]
    meaning: str
    channels: str

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
    "of bushings cross 1-4, fork 1-4 in turn: force e, t, z, torque e, t, z, modulus of force, of torque",
)
SHAFT_LOADS = LoadHistory(
    "shafts",
    "shaft_",
    SHAFTS,
    ("f_x", "f_y", "f_z", "m_x", "m_y", "m_z"),
    ("shaft", "shaft_component"),
    "force x, y, z (N) and moment x, y, z (N m) about O that the joint exerts on input and output shaft, in axes that "
    "do not turn: z along the shaft, y along the fork's pins at theta = 90 deg",
    "of input and output shaft in turn: force x, y, z, moment x, y, z, modulus of axial force, of lateral force, of "
    "bending moment, of the input shaft's driving torque",
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
UNIT_OF_CHANNEL = {name: channel.unit for name, channel in CHANNELS.items()}
"""SI unit of each channel."""


def channels_of(history: LoadHistory) -> tuple[Channel, ...]:
    """Channels that follow from a history, in the order of `CHANNELS`."""
    return tuple(channel for channel in CHANNELS.values() if channel.history == history)


def histories_of(names: Iterable[str]) -> tuple[LoadHistory, ...]:
    """Histories that channels follow from, in the order of `LOAD_HISTORIES`."""
    used = {CHANNELS[name].history for name in names}
    return tuple(history for history in LOAD_HISTORIES if history in used)
