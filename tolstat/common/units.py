"""Unit strings of input files: ``"0.1 mm"`` in a file becomes the SI float ``1e-4`` (m).

Every quantity of an input file is a string with its unit; `Quantity` turns it into an SI float while
pydantic validates, so that a wrong or missing unit is reported with the other faults of the file.
"""

from __future__ import annotations

import math
import sys
import tokenize
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

from pydantic import AfterValidator, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from tolstat.common import notation
from tolstat.common.notation import DIAMETER, PLUS_MINUS, Written, schema_of_quantity

if TYPE_CHECKING:
    import pint

ValueT = TypeVar("ValueT", bound=float | str)

_USUAL: dict[str, tuple[str, dict[str, float]]] = {
    "m": ("0.1 mm", {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "cm": 1e-2}),
    "m^2": ("11.34 cm^2", {"m^2": 1.0, "cm^2": 1e-4, "mm^2": 1e-6}),
    "m^4": ("1.02e-7 m^4", {"m^4": 1.0, "cm^4": 1e-8}),
    "rad": ("0.5 deg", {"rad": 1.0, "mrad": 1e-3, "deg": 0.017453292519943295, "°": 0.017453292519943295}),
    "rad/s": ("500 rpm", {"rad/s": 1.0, "rpm": 0.10471975511965977}),
    "s": ("5000 h", {"s": 1.0, "min": 60.0, "h": 3600.0}),
    "N": ("700 N", {"N": 1.0, "kN": 1e3}),
    "N*m": ("100 N*m", {"N*m": 1.0, "Nm": 1.0, "kN*m": 1e3}),
    "N*m/rad": ("5.9e5 N*m/rad", {"N*m/rad": 1.0}),
    "N/m": ("1.2e6 N/mm", {"N/m": 1.0, "N/mm": 1e3}),
    "N/m^2": ("7.5e7 N/mm^2", {"N/m^2": 1.0, "N/mm^2": 1e6}),
    "N*s/m": ("200 N*s/m", {"N*s/m": 1.0}),
    "m/s": ("16 mm/s", {"m/s": 1.0, "mm/s": 1e-3}),
    "W": ("30 W", {"W": 1.0, "kW": 1e3}),
    "Pa": ("210 GPa", {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9, "N/mm^2": 1e6}),
    "1/m^2": ("2.5 MPa/kN", {"MPa/kN": 1e3}),
    "1/m^3": ("0.2 MPa/(N*m)", {"MPa/Nm": 1e6, "MPa/(N*m)": 1e6}),
    "kg": ("0.32 kg", {"kg": 1.0, "g": 1e-3}),
    "kg*m": ("1e-3 kg*m", {"kg*m": 1.0, "g*mm": 1e-6}),
    "kg*m^2": ("0.01 kg*m^2", {"kg*m^2": 1.0}),
    "kg/m^3": ("7700 kg/m^3", {"kg/m^3": 1.0}),
    "1": ("0.5", {"": 1.0, "%": 1e-2, "ppm": 1e-6}),
}
"""By SI unit, how a value is written, and units as studies usually write them: the value times the factor has the bits
that pint gives it. Pint, which knows all others, takes 0.2 s to load."""
EXAMPLES = {unit: example for unit, (example, _) in _USUAL.items()}
"""How a value of each unit is written; shown in the remedy of a fault."""
FACTORS = {unit: factors for unit, (_, factors) in _USUAL.items()}
"""Factors of the units of `_USUAL`."""
DISPLAY_UNITS = {
    "m": ("mm", 1e3),
    "rad": ("deg", 180.0 / math.pi),
    "rad/s": ("rpm", 30.0 / math.pi),
    "N": ("N", 1.0),
    "N*m": ("N m", 1.0),
    "1": ("", 1.0),
}
"""Unit in which figures show errors of each SI unit, and the factor to it."""


def shown(value: float, unit: str, digits: int = 3) -> str:
    """Text of an SI value for people: ``shown(1e-4, "m")`` is ``"0.1 mm"``."""
    name, factor = DISPLAY_UNITS.get(unit, (unit, 1.0))
    return f"{factor * value:.{digits}g} {name}".rstrip()


@cache
def registry() -> pint.UnitRegistry[float]:
    """Return the only unit registry (created on first use, which takes some 0.3 s)."""
    import pint

    units: pint.UnitRegistry[float] = pint.UnitRegistry()
    units.define("@alias turn = rev")
    return units


_NOT_PARSED = ValueError, TypeError, AttributeError, SyntaxError, ArithmeticError, AssertionError, LookupError
"""Exceptions besides pint's own that its parser raises for a text that is not a unit."""


def _fault(found: str, unit: str, remedy: str = "") -> PydanticCustomError:
    example = f'write "{EXAMPLES.get(unit, "1 " + unit)}"' if unit != "1" else "write a number without unit"
    return PydanticCustomError("quantity", "{found}", {"found": found, "remedy": remedy or example})


def to_si(value: object, unit: str, mark: str = "") -> float:
    """Convert a quantity as written in a file to an SI float.

    Parameters
    ----------
    value : object
        A string such as ``"0.1 mm"``; a bare number only where `unit` is ``"1"``.
    unit : str
        SI unit that the value must be convertible to.
    mark : str
        Sign that may stand before the number: `DIAMETER` or `PLUS_MINUS` of `notation`. All others are refused.

    Returns
    -------
    float
        Value in `unit`. A sign does not change it: ``"⌀0.1 mm"`` is 1e-4 m, the diameter.

    Raises
    ------
    pydantic_core.PydanticCustomError
        For a missing, unknown or wrong unit, a sign that means another quantity, or a value that is not finite.
    """
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise _fault(f"{value!r} is not a quantity", unit)
    if isinstance(value, (int, float)):
        if unit != "1":
            raise _without_unit(value, unit)
        if not abs(value) <= sys.float_info.max:  # also an integer too long for a float
            raise _fault(f"{value!r} is not a finite number", unit)
        return float(value)
    read = notation.read(value)
    if len(value) > notation.MAX_LENGTH:
        raise _fault(f"{value[:30]!r}... has {len(value)} characters, which no number with a unit has", unit)
    if read is None:
        point = value.replace(",", ".").translate(notation.MINUS)
        sign = "decimal point" if "," in value else "hyphen for minus"
        remedy = f'write a {sign}: "{point}"' if point != value and notation.read(point) else ""
        raise _fault(f"{value!r} is not a number with a unit", unit, remedy)
    if unit != "1" and not read.unit:
        raise _without_unit(value, unit)
    si = _value(read, unit, value)
    if not math.isfinite(si):
        raise _fault(f"{value!r} is not a finite number", unit)
    if read.mark not in ("", mark):
        raise _marked(read, value, unit, mark)
    return si


def _without_unit(value: object, unit: str) -> PydanticCustomError:
    usual = EXAMPLES.get(unit, f"1 {unit}").partition(" ")[2]
    remedy = " or ".join(f'"{str(value).strip()} {name}"' for name in dict.fromkeys((usual, unit)))
    return _fault(f"{value!r} has no unit", unit, f"write {remedy}")


def _marked(read: Written, value: str, unit: str, mark: str) -> PydanticCustomError:
    """Fault of a value with a sign that means another quantity."""
    plain = f"{_short(read.number)} {read.unit}".strip()
    half = f"{_short(0.5 * read.number)} {read.unit}".strip()
    if mark == PLUS_MINUS:
        return _fault(f"{value!r} is a diameter where a half width is meant", unit, f'write half of it: "{half}"')
    remedy = f'write "{plain}"'
    if read.mark == DIAMETER:
        remedy += f', or "{half}" where a radius is meant'
    return _fault(f"{value!r} is {notation.NAMES[read.mark]} where another quantity is meant", unit, remedy)


def _short(number: float) -> str:
    return f"{number:.12g}"


def _value(read: Written, unit: str, value: str) -> float:
    """Value in `unit`, which `value` must be convertible to."""
    factor = FACTORS.get(unit, {}).get(read.unit)
    if factor is not None:
        return read.number * factor
    import pint

    try:
        quantity = registry().Quantity(read.number, notation.pint_unit(read.unit) or "dimensionless")
        return _convert(quantity, unit, value)
    except PydanticCustomError:
        raise
    except pint.DimensionalityError as error:
        raise _fault(f"{value!r} cannot be a value in {unit}", unit) from error
    except pint.UndefinedUnitError as error:
        raise _fault(f"{value!r} has an unknown unit", unit) from error
    except (pint.PintError, tokenize.TokenError, *_NOT_PARSED) as error:
        raise _fault(f"{value!r} is not a number with a unit", unit) from error


def _convert(quantity: Any, unit: str, value: str) -> float:
    if unit == "1":
        if not (quantity.unitless or str(quantity.units) == "percent"):
            raise _fault(f"{value!r} has a unit where a pure number is expected", unit)
        return float(quantity.to("").magnitude)
    if unit == "rad/s":
        return _speed(quantity, value)
    if unit == "rad" and set(dict(quantity.unit_items())) - ANGLES:
        raise _fault(f"{value!r} cannot be a value in {unit}", unit)
    return float(quantity.to(unit).magnitude)


ANGLES = frozenset(
    f"{prefix}{name}"
    for prefix in ("", "milli", "micro")
    for name in ("radian", "degree", "arcminute", "arcsecond", "grade", "turn")
)
"""Names of the units of an angle in the registry."""
_ROTATIONS = {f"{prefix}revolutions_per_{time}" for prefix in ("", "kilo") for time in ("second", "minute", "hour")}


def _speed(quantity: Any, value: str) -> float:
    """Angular velocity, rad/s; a value that may be in revolutions or in radians is refused.

    A speed is an angle over a time, or revolutions over a time by name (rpm). 1/min and min^-1 mean revolutions, as on
    drawings (ISO 80000-3 gives them to the rotational frequency only). Hz and 1/s are units of both.
    """
    powers = dict(quantity.unit_items())
    speed = float(quantity.to("rad/s").magnitude)
    if list(powers) == ["minute"]:
        return speed * 2.0 * math.pi
    turning = [power for name, power in powers.items() if name in ANGLES | _ROTATIONS]
    if not turning:
        number = _short(quantity.to("1/s").magnitude)
        remedy = f'write "{number} rev/s" or "{number} rad/s"'
        raise _fault(f"{value!r} is ambiguous: revolutions or radians", "rad/s", remedy)
    if turning != [1] or sorted(powers.values()) not in ([1], [-1, 1]):
        raise _fault(f"{value!r} cannot be a value in rad/s", "rad/s")
    return speed


def written(value: float, unit: str, like: object, digits: int = 12) -> str | float:
    """Write an SI value in the unit of another one, for a file: the inverse of `to_si`.

    Parameters
    ----------
    value : float
        Value in `unit`.
    unit : str
        SI unit.
    like : object
        Quantity as written in a file, convertible to `unit`; the result has its unit.
    digits : int
        Significant digits to round to.

    Returns
    -------
    str or float
        ``"0.08 mm"``, with the sign of `like`, or a number where `like` has no unit.
    """
    number, name, mark = value, "", ""
    if isinstance(like, str) and (read := notation.read(like)) is not None:
        name, mark = read.unit, read.mark
        number = value / to_si(f"1 {name}" if name else 1.0, unit)
    number = float(f"{number:.{digits}g}")
    return f"{mark}{number!r} {name}" if name else number


@dataclass(frozen=True)
class Quantity:
    """Annotation that makes a pydantic ``float`` field read a unit string.

    ``Annotated[float, Quantity("m")]`` accepts ``"0.1 mm"`` and holds ``1e-4``. SI floats are written back
    as ``"0.0001 m"`` by ``model_dump(mode="json")``, so that a dump can be read again. With the validation context
    ``{"si": True}`` values are SI floats already. `mark`: the sign that may stand before the number, see `to_si`.
    """

    unit: str
    mark: str = ""
    words: tuple[str, ...] = ()

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the schema: parse on validation, write value and unit on JSON dump."""

        def read(value: object, info: core_schema.ValidationInfo) -> float | str:
            if isinstance(value, str) and self.words and notation.read(value) is None:
                return self._word(value)
            si = isinstance(value, float) and bool(info.context and info.context.get("si"))
            return to_si(value, "1" if si else self.unit, self.mark)

        writing = core_schema.plain_serializer_function_ser_schema(self.written, when_used="json")
        return core_schema.with_info_plain_validator_function(read, serialization=writing)

    def _word(self, value: str) -> str:
        if value in self.words:
            return value
        quoted = ", ".join(f'"{word}"' for word in self.words)
        remedy = f'write {quoted} or a quantity such as "{EXAMPLES[self.unit]}"'
        raise _fault(f"{value!r} is neither a word of this key nor a number with a unit", self.unit, remedy)

    def written(self, value: float | str) -> str | float:
        """Return an SI value, or a word, as a file writes it: ``"0.0001 m"``."""
        return value if self.unit == "1" or isinstance(value, str) else f"{value!r} {self.unit}"

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the JSON schema of the quantity as a file writes it."""
        return schema_of_quantity(self.unit, EXAMPLES[self.unit], self.words)


def _signed(holds: Callable[[float], bool], must: str, remedy: str) -> Callable[[ValueT], ValueT]:
    """Validator of the sign of a quantity; a word in its place passes."""

    def validate(value: ValueT) -> ValueT:
        if isinstance(value, str) or holds(value):
            return value
        # `strict` replaces {input} by the value as written
        raise PydanticCustomError("sign", "{found}", {"found": f"{{input}} {must}", "remedy": remedy})

    return validate


positive = _signed(lambda value: value > 0, "must be positive", "give a value above zero")
not_negative = _signed(lambda value: value >= 0, "must not be negative", "give zero or a value above it")
not_zero = _signed(lambda value: value != 0, "must not be zero", "give a value other than zero")
"""Validators of quantities."""

SIGNS: dict[Callable[..., Any], str] = {positive: "exclusiveMinimum", not_negative: "minimum"}
"""Keyword of JSON schema for each validator of a sign."""

POSITIVE, NOT_NEGATIVE = AfterValidator(positive), AfterValidator(not_negative)
Length = Annotated[float, Quantity("m")]
Diameter = Annotated[float, Quantity("m", DIAMETER), POSITIVE]
Area = Annotated[float, Quantity("m^2"), POSITIVE]
AreaMoment = Annotated[float, Quantity("m^4"), POSITIVE]
Angle = Annotated[float, Quantity("rad")]
Speed = Annotated[float, Quantity("rad/s")]
Unbalance = Annotated[float, Quantity("kg*m"), POSITIVE]
Velocity = Annotated[float, Quantity("m/s")]
Force = Annotated[float, Quantity("N")]
Torque = Annotated[float, Quantity("N*m")]
Stress = Annotated[float, Quantity("Pa")]
Time = Annotated[float, Quantity("s"), POSITIVE]
Mass = Annotated[float, Quantity("kg"), POSITIVE]
Inertia = Annotated[float, Quantity("kg*m^2"), POSITIVE]
Density = Annotated[float, Quantity("kg/m^3"), POSITIVE]
Stiffness = Annotated[float, Quantity("N/m")]
RotaryStiffness = Annotated[float, Quantity("N*m/rad"), POSITIVE]
QuadraticStiffness = Annotated[float, Quantity("N/m^2"), NOT_NEGATIVE]
Damping = Annotated[float, Quantity("N*s/m"), NOT_NEGATIVE]
Number = Annotated[float, Quantity("1")]
