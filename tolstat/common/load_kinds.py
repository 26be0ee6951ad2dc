"""Registry of the loads: kinds, and the places that have them.

A kind is one entry: columns of the result file, arrays of the kernels, limits, reports, histories and drawings follow
from it. `kernel.mechanics.loads` computes its values.
"""

from __future__ import annotations

import math
from functools import cache
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat.common.fields import Field
from tolstat.common.mechanism import Mechanism, carried


class Place(NamedTuple):
    """Where a load acts.

    Attributes
    ----------
    name : str
        What stands before the symbol in the name of a load; empty for the whole mechanism.
    group : str
        Places of one group are shown together, ``"cross"``.
    """

    name: str
    group: str


@cache
def places(mechanism: Mechanism) -> dict[str, Place]:
    """Places of the loads of a mechanism, by name."""
    found = [
        *(Place(bushing.name, bushing.group) for bushing in mechanism.bushings),
        *(Place(pair.pin, "pin") for pair in mechanism.pairs),
        *(Place(face.name, "thrust") for face in mechanism.faces),
        *(Place(shaft.name, "shaft") for shaft in mechanism.shafts),
        Place("", "joint"),
    ]
    return {place.name: place for place in found}


JOINT = ("",)
"""Place of loads of the whole mechanism."""
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
        Orders of the input speed whose amplitudes are loads of their own: ``psi_1x``.
    of_revolution : bool
        Whether it belongs to a whole revolution, as amplitudes do; such kinds come last in the registry.
    measure : Kind, optional
        Kind whose largest value errors and changes of the load are relative to; by default itself.
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
    of_revolution: bool = False
    measure: Kind | None = None
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


EXPONENTS = {"balls": "3", "rollers": "10/3"}
"""Exponents of the life of ball and roller bearings (ISO 281)."""
OVER = "over the revolutions that count"
ORDERS = (1, 2, 3, 4)
"""Multiples of the input speed whose amplitudes are loads."""
_ROOT = "bending moment at the root of pin or arm"
_MIDDLE = "torque at the middle of pin or eye"
_FORCE = f"modulus of the bushing force {OVER}"
_CONTACT = "contact force of the pin: of its outermost station, of its innermost one, resultant of all stations"
_PSI = "|Psi|, relative error of the speed ratio, eq. (13)"
_AXIAL = f"force along the shaft, of a sliding output shaft that on its bearing, {OVER}"
_LATERAL = f"force across the shaft {OVER}"
_MOMENT = f"bending moment of the shaft about the joint's centre {OVER}"
_THRUST = f"force of the thrust face {OVER}"
_BEARING = f"radial load of the shaft's bearing {OVER}"
_EQUIVALENT = "radial load of the shaft's bearing, mean over any revolution with exponent"
_STRESS = f"stress at the root of the pin, of bending and torsion together (von Mises), {OVER}"
_LOSS = "mean power that friction takes in a pin's bearing, or in all, of any revolution"
_DRIVE = f"torque about the input shaft {OVER}"


@cache
def all_kinds(mechanism: Mechanism) -> dict[str, Kind]:
    """All kinds by key, in the order of reports and of kernels; those that a mechanism lacks have no places."""
    bushings = tuple(bushing.name for bushing in mechanism.bushings)
    pins = tuple(pair.pin for pair in mechanism.pairs)
    shafts = tuple(mechanism.shafts[i].name for i in carried(mechanism))
    whole = JOINT if mechanism.rotations else ()
    driven = tuple(shaft.name for shaft in mechanism.shafts if shaft.driven)
    borne = tuple(shaft.name for shaft in mechanism.shafts if shaft.borne)
    faces = tuple(face.name for face in mechanism.faces)
    bushing: dict[str, Any] = {"decides": True, "shown": True, "averaged": True, "modulus": True}
    F = Kind("F", "F", "bushing force", "N", _FORCE, bushings, components=("F_e", "F_t", "F_z"), **bushing)
    torque = _MIDDLE if mechanism.placed else _ROOT
    of_bushing = f"modulus of the {torque} (torque of the bushing) {OVER}"
    T = Kind("T", "T", torque, "N*m", of_bushing, bushings, components=("T_e", "T_t", "T_z"), **bushing)
    psi = Kind("psi", "psi", "|Psi|", "1", _PSI, whole, interpolated=False)
    of_force: dict[str, Any] = {"unit": "N", "measure": F, "decides": True}
    # of placed members, the moments about their origins are small differences of large ones
    of_moment: dict[str, Any] = {"unit": "N*m", "measure": T, "decides": not mechanism.placed}
    across: dict[str, Any] = {"places": shafts, "modulus": True}
    found = [
        F,
        T,
        Kind("contact", "contact", "contact force", "N", _CONTACT, pins, CONTACTS),
        psi,
        Kind("axial", "axial", "axial force", meaning=_AXIAL, places=shafts, components=("f_z",), **of_force),
        Kind("lateral", "lateral", "lateral force", meaning=_LATERAL, components=("f_x", "f_y"), **of_force, **across),
        Kind("moment", "moment", "bending moment", meaning=_MOMENT, components=("m_x", "m_y"), **of_moment, **across),
        Kind("drive", "drive", "driving torque", meaning=_DRIVE, places=driven, components=("m_z",), **of_moment),
        Kind("thrust", "F", "thrust force", "N", _THRUST, faces, measure=F),
        *(
            Kind(key, key, noun, "N", _BEARING, borne, measure=F, modulus=True)
            for key, noun in (("bearing_a", "load of bearing a"), ("bearing_b", "load of bearing b"))
        ),
        Kind("stress", "stress", "stress at the root", "Pa", _STRESS, mechanism.roots, modulus=True),
    ]
    of_orders = (
        ("lateral", "lateral force", "N", shafts, F),
        ("moment", "bending moment", "N*m", shafts, T),
        ("drive", "driving torque", "N*m", driven, T),
        ("psi", "speed error Psi", "1", whole, psi),
        ("bearing_a", "load of bearing a", "N", borne, F),
        ("bearing_b", "load of bearing b", "N", borne, F),
    )
    for symbol, noun, unit, where, measure in of_orders:
        meaning = (
            f"amplitude of the {noun} at multiples of the input speed, in axes that do not turn, of any revolution"
        )
        key, noun = f"{symbol}_orders", f"amplitude of the {noun}"
        found.append(Kind(key, symbol, noun, unit, meaning, where, orders=ORDERS, of_revolution=True, measure=measure))
    for end in "ab":
        for rolling, exponent in EXPONENTS.items():
            key, noun = f"bearing_{end}_{rolling}", f"equivalent load of bearing {end} with {rolling}"
            found.append(Kind(key, key, noun, "N", f"{_EQUIVALENT} {exponent}", borne, of_revolution=True, measure=F))
    found.append(
        Kind("loss", "loss", "loss", "W", _LOSS, (*pins, "") if mechanism.friction else (), of_revolution=True)
    )
    return {kind.key: kind for kind in found}


@cache
def kinds(mechanism: Mechanism) -> dict[str, Kind]:
    """Kinds of the loads that a mechanism has, as of `all_kinds`."""
    return {key: kind for key, kind in all_kinds(mechanism).items() if kind.places}


@cache
def spans(mechanism: Mechanism) -> dict[str, slice]:
    """Elements of each kind in arrays with the values of all loads, kind after kind, by key."""
    ends = _ends(kinds(mechanism))
    return {key: slice(ends[i], ends[i + 1]) for i, key in enumerate(kinds(mechanism))}


def _ends(of: dict[str, Kind]) -> list[int]:
    return [*accumulate((kind.size if kind.places else 0 for kind in of.values()), initial=0)]


@cache
def load_numbers(mechanism: Mechanism) -> dict[str, NDArray[np.int64]]:
    """What kernels read of the loads of a mechanism.

    Returns
    -------
    dict of str to ndarray of int
        ``begin``: (kinds,) first element of each of `all_kinds`. ``modulus``, ``interpolated``: (n,) of each load at
        one instant, whether kernels write its square, and whether a largest value between samples is interpolated.
        ``measured``: (measures, 2) first and last + 1 of the loads that changes are relative to. ``deciding``:
        loads that decide on settling, closer look and steps; those compared with measure m are number
        ``of_measure[m, 0]`` to ``of_measure[m, 1]`` - 1 of them, first those that measure. ``others``: those at one
        instant that do not decide.
    """
    by_key, span = kinds(mechanism), spans(mechanism)
    instant = [kind for kind in by_key.values() if not kind.of_revolution]
    sizes = [kind.size for kind in instant]
    measured = list(dict.fromkeys(measure_of(kind).key for kind in instant if kind.decides))
    deciding, bounds = [], [0]
    for key in measured:
        alike = [kind.key for kind in instant if kind.decides and measure_of(kind).key == key]
        deciding += [i for name in alike for i in range(span[name].start, span[name].stop)]
        bounds.append(len(deciding))
    numbers: dict[str, Any] = {
        "begin": _ends(all_kinds(mechanism))[:-1],
        "modulus": np.repeat([kind.modulus for kind in instant], sizes),
        "interpolated": np.repeat([kind.interpolated for kind in instant], sizes),
        "measured": [(span[key].start, span[key].stop) for key in measured],
        "of_measure": np.array([bounds[:-1], bounds[1:]]).T,
        "deciding": deciding,
        "others": np.setdiff1d(np.arange(sum(sizes)), deciding),
    }
    return {name: np.array(values, np.int64) for name, values in numbers.items()}


class Sizes(NamedTuple):
    """Numbers of loads: of all; of those at one instant; of those that have mean and range; that decide.

    All but the last come first in arrays with the values of all loads.
    """

    loads: int
    instant: int
    averaged: int
    deciding: int


def sizes(mechanism: Mechanism) -> Sizes:
    """Numbers of the loads of a mechanism."""
    every = kinds(mechanism).values()
    return Sizes(
        sum(kind.size for kind in every),
        sum(kind.size for kind in every if not kind.of_revolution),
        sum(kind.size for kind in every if kind.averaged),
        len(load_numbers(mechanism)["deciding"]),
    )


def measure_of(kind: Kind) -> Kind:
    """Kind whose largest value errors and changes of a load are relative to."""
    return kind.measure or kind
