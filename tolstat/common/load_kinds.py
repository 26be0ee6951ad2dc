"""Registry of the loads: kinds, and the places that have them.

A kind is one entry: columns of the result file, arrays of the kernels, limits, reports, histories and drawings follow
from it. `kernel.mechanics.loads` computes its values.
"""

from __future__ import annotations

import math
from itertools import accumulate
from typing import Any, NamedTuple

from tolstat.common.fields import Field


class Place(NamedTuple):
    """Where a load acts.

    Attributes
    ----------
    name : str
        What stands before the symbol in the name of a load; empty for the whole joint.
    view : str
        View of the joint that shows it, ``"front"`` or ``"side"``.
    group : str
        Places of one group are shown together, ``"cross"``.
    """

    name: str
    view: str
    group: str


PLACES = {
    place.name: place
    for place in (
        *(Place(f"cross{i}", "front", "cross") for i in (1, 2, 3, 4)),
        *(Place(f"fork{i}", "side", "fork") for i in (1, 2, 3, 4)),
        *(Place(f"pin{i}", "front", "pin") for i in (1, 2, 3, 4)),
        Place("input", "side", "shaft"),
        Place("output", "side", "shaft"),
        Place("", "side", "joint"),
    )
}
"""Registry of the places of loads, by name."""
JOINT = ("",)
"""Place of loads of the whole joint."""


def _places(*groups: str) -> tuple[str, ...]:
    return tuple(place.name for place in PLACES.values() if place.group in groups)


BUSHINGS, PINS, SHAFTS = _places("cross", "fork"), _places("pin"), _places("shaft")
CONTACTS = ("outer", "inner", "resultant")
"""Contact forces of a pin: normal force of its outermost and of its innermost station, and the resultant of all."""
OUTER, INNER, RESULTANT = range(3)


class Kind(NamedTuple):
    """A kind of loads. Higher is worse.

    Attributes
    ----------
    key : str
        Prefix of its fields in the results: ``F_max``, ``F_lower``, ``F_upper``.
    symbol : str
        What stands after the place in the name of a load: ``cross1.F``.
    noun : str
        What a load of the kind is called.
    unit : str
        SI unit.
    meaning : str
        What the field with its largest values holds the largest of, for the reader of the file.
    places : tuple of str
        Names in `PLACES`, each with such a load, or with one for each order.
    parts : tuple of str
        Values at each place, the largest of which is the load; empty if there is one.
    orders : tuple of int
        Orders of the input speed whose amplitudes are loads of their own: ``psi_1x``. Amplitudes belong to a whole
        revolution; kinds with orders come last in the registry.
    measure : str
        Key of the kind whose largest value errors and changes of the load are relative to; empty for its own.
    decides : bool
        Whether it decides when a joint has settled, where it is looked at closer, and how fine its steps are.
    shown : bool
        Whether every report shows it if the study keeps it.
    averaged : bool
        Whether results hold mean and range, too. The kinds that have them come first in the registry.
    modulus : bool
        Whether it is the modulus of a vector, whose square is followed by explicit steps.
    interpolated : bool
        Whether a largest value between two samples is interpolated by a parabola.
    components : tuple of str
        Components over the input angle that the load is the modulus of; histories and cycles hold them.
    """

    key: str
    symbol: str
    noun: str
    unit: str
    meaning: str
    places: tuple[str, ...] = JOINT
    parts: tuple[str, ...] = ()
    orders: tuple[int, ...] = ()
    measure: str = ""
    decides: bool = False
    shown: bool = False
    averaged: bool = False
    modulus: bool = False
    interpolated: bool = True
    components: tuple[str, ...] = ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of its fields in the results, without the interval's."""
        several = self.places if self.places != JOINT else ()
        return tuple(len(names) for names in (several, self.orders, self.parts) if names)

    @property
    def size(self) -> int:
        """Number of values."""
        return math.prod(self.shape)

    def loads(self) -> list[tuple[str, str]]:
        """Place and name of each of its loads: ``("cross1", "cross1.F")`` and so on."""
        symbols = [f"{self.symbol}_{n}x" for n in self.orders] or [self.symbol]
        return [(place, f"{place}.{symbol}" if place else symbol) for place in self.places for symbol in symbols]

    def columns(self, statistic: str) -> tuple[str, ...]:
        """Columns of a statistic, ``"max"``, ``"mean"`` or ``"range"``: ``pin1.contact_outer_max`` and so on."""
        parts = [f"_{part}" for part in self.parts] or [""]
        return tuple(f"{name}{part}_{statistic}" for _, name in self.loads() for part in parts)

    def statistics(self) -> dict[str, Field]:
        """Fields of the results with its statistics over the revolutions that count, by statistic."""
        texts = {"max": "largest"} | ({"mean": "mean", "range": "largest less smallest"} if self.averaged else {})
        return {
            name: Field(
                f"{self.key}_{name}",
                self.unit,
                f"{text} {self.meaning}",
                shape=self.shape,
                columns=self.columns(name) if self.shape else (),
            )
            for name, text in texts.items()
        }

    def ends(self) -> list[Field]:
        """Fields of the results with the ends of the interval of its largest loads."""
        of = f"of the interval of the largest {self.noun} of a stationary joint, in units of it; of others 1"
        return [Field(f"{self.key}_{end}", "1", f"{end} end {of}") for end in ("lower", "upper")]


OVER = "over the revolutions that count"
ORDERS = (1, 2, 3, 4)
"""Multiples of the input speed whose amplitudes are loads."""
_BUSHING: dict[str, Any] = {"places": BUSHINGS, "decides": True, "shown": True, "averaged": True, "modulus": True}
_SHAFT: dict[str, Any] = {"places": SHAFTS, "decides": True}
_ACROSS = _SHAFT | {"modulus": True}
_ROOT = "bending moment at the root of pin or arm"
_FORCE = f"modulus of the bushing force {OVER}"
_TORQUE = f"modulus of the {_ROOT} (torque of the bushing) {OVER}"
_CONTACT = "contact force of the pin: of its outermost station, of its innermost one, resultant of all stations"
_PSI = "|Psi|, relative error of the speed ratio, eq. (13)"
_AXIAL = f"force along the shaft, of a sliding output shaft that on its bearing, {OVER}"
_LATERAL = f"force across the shaft {OVER}"
_MOMENT = f"bending moment of the shaft about the joint's centre {OVER}"
_DRIVE = f"torque about the input shaft {OVER}"
LOAD_KINDS = (
    Kind("F", "F", "bushing force", "N", _FORCE, components=("F_e", "F_t", "F_z"), **_BUSHING),
    Kind("T", "T", _ROOT, "N*m", _TORQUE, components=("T_e", "T_t", "T_z"), **_BUSHING),
    Kind("contact", "contact", "contact force", "N", _CONTACT, PINS, CONTACTS),
    Kind("psi", "psi", "|Psi|", "1", _PSI, interpolated=False),
    Kind("axial", "axial", "axial force", "N", _AXIAL, measure="F", components=("f_z",), **_SHAFT),
    Kind("lateral", "lateral", "lateral force", "N", _LATERAL, measure="F", components=("f_x", "f_y"), **_ACROSS),
    Kind("moment", "moment", "bending moment", "N*m", _MOMENT, measure="T", components=("m_x", "m_y"), **_ACROSS),
    Kind("drive", "drive", "driving torque", "N*m", _DRIVE, ("input",), measure="T", decides=True, components=("m_z",)),
    *(
        Kind(
            f"{symbol}_orders",
            symbol,
            f"amplitude of the {noun}",
            unit,
            f"amplitude of the {noun} at multiples of the input speed, in axes that do not turn, of any revolution",
            places,
            orders=ORDERS,
            measure=measure,
        )
        for symbol, noun, unit, places, measure in (
            ("lateral", "lateral force", "N", SHAFTS, "F"),
            ("moment", "bending moment", "N*m", SHAFTS, "T"),
            ("drive", "driving torque", "N*m", ("input",), "T"),
            ("psi", "speed error Psi", "1", JOINT, "psi"),
        )
    ),
)
"""Registry of the kinds, in the order of reports."""
KIND = {kind.key: kind for kind in LOAD_KINDS}
"""Kinds by key."""
_ENDS = [*accumulate((kind.size for kind in LOAD_KINDS), initial=0)]
SPAN = {kind.key: slice(_ENDS[i], _ENDS[i + 1]) for i, kind in enumerate(LOAD_KINDS)}
"""Elements of each kind in arrays with the values of all loads, kind after kind."""


def measure_of(kind: Kind) -> Kind:
    """Kind whose largest value errors and changes of a load are relative to."""
    return KIND[kind.measure] if kind.measure else kind
