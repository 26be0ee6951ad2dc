"""Registry of the loads over the input angle: what histories hold, the channels and the signals that follow from it.

They follow from the components of the kinds of loads, `load_kinds.kinds`. A channel is drawn over the input angle;
cycles are counted of a signal, which has a sign.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.load_kinds import Kind, all_kinds, kinds, places
from tolstat.common.mechanism import Mechanism


class LoadHistory(NamedTuple):
    """Loads over the input angle that histories hold in one array, (samples, places, components).

    Attributes
    ----------
    name : str
        Name of the array in full histories.
    prefix : str
        What stands before ``coefficients_real``, ``cycles`` and ``channel`` in the names of what is made of it.
    places : tuple of str
        Names of the places.
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


FORCES_AND_TORQUES = ("F_e", "F_t", "F_z", "T_e", "T_t", "T_z")
"""Components of a bushing's loads."""
BUSHING_LOADS, SHAFT_LOADS = "loads", "shafts"
"""Names of the histories."""


@cache
def load_histories(mechanism: Mechanism) -> dict[str, LoadHistory]:
    """What histories hold of the loads of a mechanism, by name."""
    bushings, shafts = all_kinds(mechanism)["F"].places, all_kinds(mechanism)["axial"].places
    of_bushings, of_shafts = _in_words(bushings), " and ".join(shafts)
    found = (
        LoadHistory(
            BUSHING_LOADS,
            "",
            bushings,
            FORCES_AND_TORQUES,
            ("bushing", "component"),
            f"force e, t, z (N), torque e, t, z (N m) of bushings {of_bushings} on the lump, in base marker axes",
            f"of bushings {of_bushings} in turn: force e, t, z, torque e, t, z",
        ),
        LoadHistory(
            SHAFT_LOADS,
            "shaft_",
            shafts,
            ("f_x", "f_y", "f_z", "m_x", "m_y", "m_z"),
            ("shaft", "shaft_component"),
            f"force x, y, z (N) and moment x, y, z (N m) about O that the joint exerts on {of_shafts} shaft, in axes "
            "that do not turn: z along the shaft, y along the fork's pins at theta = 90 deg",
            f"of {of_shafts} shaft in turn: force x, y, z, moment x, y, z",
        ),
    )
    return {history.name: history for history in found}


def _in_words(names: Iterable[str]) -> str:
    """Numbered names: ``cross 1-4, fork 1-4``."""
    numbers: dict[str, list[str]] = {}
    for name in names:
        numbers.setdefault(name.rstrip("0123456789"), []).append(name[len(name.rstrip("0123456789")) :])
    return ", ".join(f"{name} {each[0]}-{each[-1]}" for name, each in numbers.items())


def followed(mechanism: Mechanism) -> list[Kind]:
    """Kinds whose components histories and cycles hold."""
    return [kind for kind in kinds(mechanism).values() if kind.components]


class Channel(NamedTuple):
    """A load over the input angle: a component, or the modulus of several, which is a load.

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


@cache
def channels(mechanism: Mechanism) -> dict[str, Channel]:
    """Loads over the input angle by name: components, then moduli, of each place, history after history."""
    found = []
    for history in load_histories(mechanism).values():
        here = [kind for kind in followed(mechanism) if set(kind.components) <= set(history.components)]
        kind_of = {component: kind for kind in here for component in kind.components}
        for place in history.places:
            for i, name in enumerate(history.components):
                found.append(Channel(f"{place}.{name}", kind_of[name], place, history, slice(i, i + 1), False))
            for kind in (kind for kind in here if place in kind.places):
                first = history.components.index(kind.components[0])
                span = slice(first, first + len(kind.components))
                found.append(Channel(f"{place}.{kind.symbol}", kind, place, history, span, True))
    return {channel.name: channel for channel in found}


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


@cache
def components(mechanism: Mechanism) -> dict[str, Signal]:
    """Components by name, history after history."""
    found = {}
    for channel in channels(mechanism).values():
        if not channel.is_modulus:
            factors = np.zeros(len(channel.history.components))
            factors[channel.components] = 1.0
            signal = Signal(channel.name, channel.unit, channel.history, channel.place, tuple(factors.tolist()))
            found[signal.name] = signal
    return found


@cache
def planes(mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """Two components across the axis of pin, arm or shaft, by name of a modulus: t and z of ``cross1.F``."""
    found = {}
    for channel in channels(mechanism).values():
        names = channel.history.components[channel.components]
        if len(names) == 3:  # of a bushing: across the arm's axis z, across the pin's axis e
            names = names[:2] if places(mechanism)[channel.place].group == "fork" else names[1:]
        if len(names) == 2:
            found[channel.name] = (f"{channel.place}.{names[0]}", f"{channel.place}.{names[1]}")
    return found


WORST = "worst"
AROUND = 24
"""Number of directions in half a turn of which the worst counts (opposite ones have the same cycles); the load between
two of them is at most 1 - cos(3.75 deg), 0.2 %, above theirs."""


def signals_of(name: str, mechanism: Mechanism) -> tuple[Signal, ...]:
    """Signals of a name: of a component, ``cross1.F_t``; along a direction, ``cross1.F at 30 deg``, ``... at worst``.

    The angle is from the first component of `planes` towards the second.
    """
    if name in components(mechanism):
        return (components(mechanism)[name],)
    plane, _, direction = name.partition(" at ")
    first, second = (components(mechanism)[component] for component in planes(mechanism)[plane])
    degrees = 180.0 * np.arange(AROUND) / AROUND if direction == WORST else [float(direction.removesuffix(" deg"))]
    angles = np.radians(degrees)
    factors = np.outer(np.cos(angles), first.factors) + np.outer(np.sin(angles), second.factors)
    return tuple(first._replace(name=name, factors=tuple(each)) for each in factors.tolist())


def unit_of(name: str, mechanism: Mechanism) -> str:
    """SI unit of a signal, by its name."""
    return signals_of(name, mechanism)[0].unit


def histories_of(names: Iterable[str], mechanism: Mechanism) -> tuple[LoadHistory, ...]:
    """Histories that channels follow from, in the order of `load_histories`."""
    used = {channels(mechanism)[name].history for name in names}
    return tuple(history for history in load_histories(mechanism).values() if history in used)
