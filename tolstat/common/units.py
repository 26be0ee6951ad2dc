"""Unit strings of input files: ``"0.1 mm"`` in a file becomes the SI float ``1e-4`` (m).

Every quantity of an input file is a string with its unit; `Quantity` turns it into an SI float while
pydantic validates, so that a wrong or missing unit is reported with the other faults of the file.
"""

from __future__ import annotations

import math
import re
import sys
import tokenize
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from tolstat.common import json_schema

if TYPE_CHECKING:
    import pint

EXAMPLES = {
    "m": "0.1 mm",
    "m^2": "11.34 cm^2",
    "m^4": "1.02e-7 m^4",
    "rad": "0.5 deg",
    "rad/s": "500 rpm",
    "N": "700 N",
    "N*m": "100 N*m",
    "N*m/rad": "5.9e5 N*m/rad",
    "N/m": "1.2e6 N/mm",
    "N/m^2": "7.5e7 N/mm^2",
    "N*s/m": "200 N*s/m",
    "Pa": "210 GPa",
    "kg": "0.32 kg",
    "kg*m^2": "0.01 kg*m^2",
    "kg/m^3": "7700 kg/m^3",
    "1": "0.5",
}
"""How a value of each unit is written; shown in the remedy of a fault."""
DISPLAY_UNITS = {
    "m": ("mm", 1e3),
    "rad": ("deg", 180.0 / math.pi),
    "rad/s": ("rpm", 30.0 / math.pi),
    "N*m": ("N m", 1.0),
    "1": ("", 1.0),
}
"""Unit in which figures show errors of each SI unit, and the factor to it."""


@cache
def registry() -> pint.UnitRegistry[float]:
    """Return the only unit registry (created on first use, which takes some 0.3 s)."""
    import pint

    units: pint.UnitRegistry[float] = pint.UnitRegistry()
    units.define("@alias turn = rev")
    return units


_QUANTITY = re.compile(
    r"\s*(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf(?:inity)?)(?![a-z]))"
    r"\s*(?P<unit>|(?:1?\s*/\s*)?[A-Za-zµμ°%][\w µμ°%*/^().·⁻¹²³⁴-]{0,40})\s*",
    re.ASCII | re.IGNORECASE,
)
"""A number and a unit. Anything else is refused: pint would read "1,5 mm" as 15 mm and "0,1 mm" as nothing."""


@lru_cache(maxsize=1024)
def _parsed(text: str) -> Any:
    """Parse a text as a quantity, None if it is not one; cached, because variants of a joint share most values."""
    found = _QUANTITY.fullmatch(text)
    if found is None:
        return None
    unit = found["unit"].replace("·", "*")
    if unit.startswith("/"):
        unit = f"1{unit}"
    return registry().Quantity(float(found["number"]), unit or "dimensionless")


_NOT_PARSED = (
    *(ValueError, TypeError, AttributeError, SyntaxError, ArithmeticError, AssertionError, LookupError),
    tokenize.TokenError,
)
"""Exceptions besides pint's own that its parser raises for a text that is not a unit."""


def _fault(found: str, unit: str) -> PydanticCustomError:
    remedy = f'write "{EXAMPLES.get(unit, "1 " + unit)}"' if unit != "1" else "write a number without unit"
    return PydanticCustomError("quantity", "{found}", {"found": found, "remedy": remedy})


def to_si(value: object, unit: str) -> float:
    """Convert a quantity as written in a file to an SI float.

    Parameters
    ----------
    value : object
        A string such as ``"0.1 mm"``; a bare number only where `unit` is ``"1"``.
    unit : str
        SI unit that the value must be convertible to.

    Returns
    -------
    float
        Value in `unit`.

    Raises
    ------
    pydantic_core.PydanticCustomError
        For a missing, unknown or wrong unit, or a value that is not finite.
    """
    import pint

    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        raise _fault(f"{value!r} is not a quantity", unit)
    if isinstance(value, (int, float)):
        if unit != "1":
            raise _fault(f"{value!r} has no unit", unit)
        if not abs(value) <= sys.float_info.max:  # also an integer too long for a float
            raise _fault(f"{value!r} is not a finite number", unit)
        return float(value)
    try:
        quantity = _parsed(value)
        si = math.nan if quantity is None else _convert(quantity, unit, value)
    except PydanticCustomError:
        raise
    except pint.DimensionalityError as error:
        raise _fault(f"{value!r} cannot be a value in {unit}", unit) from error
    except pint.UndefinedUnitError as error:
        raise _fault(f"{value!r} has an unknown unit", unit) from error
    except (pint.PintError, *_NOT_PARSED) as error:
        raise _fault(f"{value!r} is not a number with a unit", unit) from error
    if quantity is None:
        comma = ", with a decimal point" if "," in value else ""
        raise _fault(f"{value!r} is not a number with a unit{comma}", unit)
    if not math.isfinite(si):
        raise _fault(f"{value!r} is not a finite number", unit)
    return si


def _convert(quantity: Any, unit: str, value: str) -> float:
    if unit == "1":
        if not (quantity.unitless or str(quantity.units) == "percent"):
            raise _fault(f"{value!r} has a unit where a pure number is expected", unit)
        return float(quantity.to("").magnitude)
    if quantity.unitless:
        raise _fault(f"{value!r} has no unit", unit)
    if unit == "rad/s":
        return _speed(quantity, value)
    return float(quantity.to(unit).magnitude)


def _speed(quantity: Any, value: str) -> float:
    """Angular velocity, rad/s: 1/min and min^-1 count revolutions, as on drawings; Hz is refused."""
    dimensions = {name: registry().get_dimensionality(name) for name, _ in quantity.unit_items()}
    for name, dimension in dimensions.items():
        if dimension == {"[time]": -1} and not name.startswith("revolutions_per"):
            raise _fault(f"{value!r} is ambiguous (1 Hz may mean 1 rad/s or 2 pi rad/s)", "rad/s")
    per_revolution = all(dimension == {"[time]": 1} for dimension in dimensions.values())
    return float(quantity.to("rad/s").magnitude) * (2.0 * math.pi if per_revolution else 1.0)


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
        ``"0.08 mm"``, or a number where `like` has no unit.
    """
    number, name = value, ""
    if isinstance(like, str) and (found := _QUANTITY.fullmatch(like)) is not None:
        name = found["unit"]
        number = value / to_si(f"1 {name}" if name else 1.0, unit)
    number = float(f"{number:.{digits}g}")
    return f"{number!r} {name}" if name else number


@dataclass(frozen=True)
class Quantity:
    """Annotation that makes a pydantic ``float`` field read a unit string.

    ``Annotated[float, Quantity("m")]`` accepts ``"0.1 mm"`` and holds ``1e-4``. SI floats are written back
    as ``"0.0001 m"`` by ``model_dump(mode="json")``, so that a dump can be read again. With the validation context
    ``{"si": True}`` values are SI floats already.
    """

    unit: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return the schema: parse on validation, write value and unit on JSON dump."""

        def read(value: object, info: core_schema.ValidationInfo) -> float:
            si = isinstance(value, float) and bool(info.context and info.context.get("si"))
            return to_si(value, "1" if si else self.unit)

        return core_schema.with_info_plain_validator_function(
            read,
            serialization=core_schema.plain_serializer_function_ser_schema(self.written, when_used="json"),
        )

    def written(self, value: float) -> str | float:
        """Return an SI value as a file writes it: ``"0.0001 m"``."""
        return value if self.unit == "1" else f"{value!r} {self.unit}"

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the JSON schema of the quantity as a file writes it."""
        return json_schema.quantity(self.unit, EXAMPLES[self.unit])


def _sign(must: str, remedy: str) -> PydanticCustomError:
    # `strict` replaces {input} by the value as written
    return PydanticCustomError("sign", "{found}", {"found": f"{{input}} {must}", "remedy": remedy})


def positive(value: float) -> float:
    """Validate a quantity that must be greater than zero."""
    if not value > 0:
        raise _sign("must be positive", "give a value above zero")
    return value


def not_negative(value: float) -> float:
    """Validate a quantity that must not be less than zero."""
    if value < 0:
        raise _sign("must not be negative", "give zero or a value above it")
    return value


def not_zero(value: float) -> float:
    """Validate a quantity of either sign."""
    if value == 0:
        raise _sign("must not be zero", "give a value other than zero")
    return value


SIGNS = {positive: "exclusiveMinimum", not_negative: "minimum"}
"""Keyword of JSON schema for each validator of a sign."""

Length = Annotated[float, Quantity("m")]
Area = Annotated[float, Quantity("m^2")]
AreaMoment = Annotated[float, Quantity("m^4")]
Angle = Annotated[float, Quantity("rad")]
Speed = Annotated[float, Quantity("rad/s")]
Torque = Annotated[float, Quantity("N*m")]
Stress = Annotated[float, Quantity("Pa")]
Mass = Annotated[float, Quantity("kg")]
Inertia = Annotated[float, Quantity("kg*m^2")]
Density = Annotated[float, Quantity("kg/m^3")]
Stiffness = Annotated[float, Quantity("N/m")]
RotaryStiffness = Annotated[float, Quantity("N*m/rad")]
QuadraticStiffness = Annotated[float, Quantity("N/m^2")]
Damping = Annotated[float, Quantity("N*s/m")]
Number = Annotated[float, Quantity("1")]
