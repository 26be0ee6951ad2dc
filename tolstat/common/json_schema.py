"""What pydantic leaves out of the JSON schema of an input model."""

from __future__ import annotations

import ast
import inspect
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from itertools import pairwise
from typing import Any, get_args

import annotated_types
from pydantic import AfterValidator, BaseModel
from pydantic.fields import FieldInfo

from tolstat.common import units
from tolstat.common.notation import schema_of_sign


def complete(schema: dict[str, Any], model: type[BaseModel]) -> None:
    """Add to the JSON schema of a model what pydantic leaves out of it.

    Parameters
    ----------
    schema : dict
        Schema of the model, changed in place: meanings that are docstrings, bounds of quantities, defaults that are
        made by a function; titles and null, which TOML does not have, are removed.
    model : type
        The model.
    """
    schema.pop("title", None)
    meanings = _meanings(model)
    for name, field in model.model_fields.items():
        property_schema = schema["properties"][field.alias or name]
        if name in meanings:
            property_schema.setdefault("description", meanings[name])
        property_schema.pop("title", None)
        rest = [inner for inner in property_schema.get("anyOf", []) if inner != {"type": "null"}]
        if len(rest) == 1:
            del property_schema["anyOf"]
            property_schema |= rest[0] | property_schema
        elif rest:
            property_schema["anyOf"] = rest
        property_schema |= _bounds(field, property_schema)
        if field.default_factory and (made := field.get_default(call_default_factory=True)):
            property_schema["default"] = made
        if property_schema.get("default", 0) is None or isinstance(field.default, BaseModel):
            property_schema.pop("default", None)


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


def _bounds(field: FieldInfo, property_schema: Mapping[str, Any]) -> dict[str, Any]:
    """Bounds of a quantity, or of a quantity that may be left out."""
    bounds: dict[str, Any] = {}
    for item in _metadata(field.annotation, field.metadata):
        match item:
            case annotated_types.Gt(gt=bound):
                bounds["exclusiveMinimum"] = bound
            case annotated_types.Ge(ge=bound):
                bounds["minimum"] = bound
            case annotated_types.Lt(lt=bound):
                bounds["exclusiveMaximum"] = bound
            case annotated_types.Le(le=bound):
                bounds["maximum"] = bound
            case AfterValidator(func=func) if func in units.SIGNS:
                bounds[units.SIGNS[func]] = 0
    return bounds | schema_of_sign({**property_schema, **bounds})


def _metadata(annotation: Any, metadata: list[Any]) -> Iterator[Any]:
    """Metadata of an annotation, and of those inside it that it is a union of."""
    yield from metadata
    for inner in get_args(annotation):
        if hasattr(inner, "__metadata__"):
            yield from inner.__metadata__
