"""JSON schema of the input models: what an editor needs to complete and check the keys of a file.

`study.schema` assembles the schemas of whole files from these parts. Keywords of this package: ``x-unit``, the SI unit
of a quantity, ``"error"`` for that of the error that an entry is for; ``x-table``, the name of a definition of
`study.schema` that stands in place of the property.
"""

from __future__ import annotations

import ast
import inspect
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from importlib import import_module
from itertools import pairwise
from typing import Any, get_args

import annotated_types
from pydantic import AfterValidator, BaseModel
from pydantic.fields import FieldInfo

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
PURE = rf"^\s*{NUMBER}\s*%?\s*$"
"""Pattern of a text that is a number, for quantities without unit."""
_SIGN = r"(?:±|\+/?[-−]|[⌀ØøΦφ∅]|[Dd]ia(?:meter|\.)?)?"
WITH_UNIT = rf"^\s*{_SIGN}\s*{NUMBER}\s*(?:1\s*/|[eE][^\d+-]|[A-DF-Za-df-zµμ°′'%/(])"
"""Pattern of the beginning of a quantity with a unit. It accepts more than is read: the unit is checked by `units`.
Without look-around, which some editors' regular expressions lack."""


def quantity(unit: str, example: str, words: tuple[str, ...] = ()) -> dict[str, Any]:
    """JSON schema of a quantity as a file writes it.

    Parameters
    ----------
    unit : str
        SI unit; of unit ``"1"`` are bare numbers, of all others texts with a number and a unit.
    example : str
        How such a value is written.
    words : tuple of str
        Words that may stand in place of a quantity.
    """
    if unit == "1":
        return {"type": ["number", "string"], "pattern": PURE, "x-unit": unit}
    if words:
        written = {"type": "string", "pattern": WITH_UNIT}
        return {"anyOf": [{"enum": list(words)}, written], "x-unit": unit, "examples": [example]}
    return {"type": "string", "pattern": WITH_UNIT, "x-unit": unit, "examples": [example]}


def positive(own: dict[str, Any]) -> dict[str, Any]:
    """JSON schema of a quantity that must be above zero."""
    bounded = own | {"exclusiveMinimum": 0}
    return bounded | sign(bounded)


def sign(own: Mapping[str, Any]) -> dict[str, Any]:
    """Keyword that refuses a minus sign in the text of a quantity that must not be negative."""
    if "string" not in str(own.get("type", own)) or 0 not in (own.get("minimum"), own.get("exclusiveMinimum")):
        return {}
    return {"not": {"type": "string", "pattern": r"^\s*-"}}


def complete(schema: dict[str, Any], model: type[BaseModel], signs: Mapping[Callable[..., Any], str]) -> None:
    """Add to the JSON schema of a model what pydantic leaves out of it.

    Parameters
    ----------
    schema : dict
        Schema of the model, changed in place: meanings that are docstrings, bounds of quantities, defaults that are
        made by a function; titles and null, which TOML does not have, are removed.
    model : type
        The model.
    signs : mapping
        Validators of the sign of a quantity, to the keyword for numbers that says the same.
    """
    schema.pop("title", None)
    meanings = _meanings(model)
    for name, field in model.model_fields.items():
        own = schema["properties"][field.alias or name]
        if name in meanings:
            own.setdefault("description", meanings[name])
        own.pop("title", None)
        _remove_null(own)
        own |= _bounds(field, signs, own)
        own |= _default(field)
        if own.get("default", 0) is None or isinstance(field.default, BaseModel):
            own.pop("default", None)


def _meanings(model: type[BaseModel]) -> dict[str, str]:
    """Docstring of each field, of the model itself and of those that it extends.

    Pydantic's ``use_attribute_docstrings`` reads them while a model is defined, which all commands would wait for.
    """
    bases = [base for base in reversed(model.__mro__) if issubclass(base, BaseModel) and base is not BaseModel]
    return {name: text for base in bases for name, text in _docstrings(base.__module__).get(base.__name__, {}).items()}


@cache
def _docstrings(module: str) -> dict[str, dict[str, str]]:
    """Docstrings below the attributes of each class of a module."""
    return {
        node.name: {
            field.target.id: " ".join(str(below.value.value).split())
            for field, below in pairwise(node.body)
            if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
            if isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant)
        }
        for node in ast.parse(inspect.getsource(import_module(module))).body
        if isinstance(node, ast.ClassDef)
    }


def _remove_null(own: dict[str, Any]) -> None:
    rest = [inner for inner in own.get("anyOf", []) if inner != {"type": "null"}]
    if len(rest) == 1:
        del own["anyOf"]
        own |= rest[0] | own
    elif rest:
        own["anyOf"] = rest


def _default(field: FieldInfo) -> dict[str, Any]:
    made = field.get_default(call_default_factory=True) if field.default_factory else None
    return {"default": made} if made else {}


def _bounds(field: FieldInfo, signs: Mapping[Callable[..., Any], str], own: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds of a quantity, or of a quantity that may be left out."""
    found: dict[str, Any] = {}
    for item in _metadata(field.annotation, field.metadata):
        match item:
            case annotated_types.Gt(gt=bound):
                found["exclusiveMinimum"] = bound
            case annotated_types.Ge(ge=bound):
                found["minimum"] = bound
            case annotated_types.Lt(lt=bound):
                found["exclusiveMaximum"] = bound
            case annotated_types.Le(le=bound):
                found["maximum"] = bound
            case AfterValidator(func=func) if func in signs:
                found[signs[func]] = 0
    return found | sign({**own, **found})


def _metadata(annotation: Any, metadata: list[Any]) -> Iterator[Any]:
    """Metadata of an annotation, and of those inside it that it is a union of."""
    yield from metadata
    for inner in get_args(annotation):
        if hasattr(inner, "__metadata__"):
            yield from inner.__metadata__
