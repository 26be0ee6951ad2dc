"""Strict input models: every fault of a file at once, each with its place and a remedy."""

from __future__ import annotations

import ast
import difflib
import inspect
import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar, get_args, get_origin

import annotated_types
from pydantic import AfterValidator, BaseModel, ConfigDict, GetJsonSchemaHandler, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError

from tolstat.common import toml_lines, units
from tolstat.common.errors import Fault, InputError, input_error
from tolstat.common.files import about_encoding, read_input
from tolstat.common.notation import schema_of_sign


class Strict(BaseModel):
    """Base of all input models: unknown keys are faults, values are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=False, defer_build=True)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the JSON schema with bounds of quantities."""
        schema = handler(core)
        _complete(handler.resolve_ref_schema(schema), cls)
        return schema


ModelT = TypeVar("ModelT", bound=BaseModel)


def read_toml(path: Path, text: str | None = None) -> dict[str, Any]:
    """Read a TOML file, or `text` in its place.

    Raises
    ------
    InputError
        When the file cannot be read or is not TOML.
    """
    text = read_text(path) if text is None else text
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line, cause, remedy = toml_lines.of_syntax(error, text)
        raise input_error(f"{path}:{line}", f"is not TOML: {cause}", remedy) from error
    except RecursionError as error:
        remedy = "no key needs more than a few: remove brackets"
        raise input_error(path, "has too many tables and lists inside each other", remedy) from error


def read_text(path: Path, utf_16: bool = False) -> str:
    """Read the text of an input file, see `read_input`.

    Raises
    ------
    InputError
        When the file cannot be read or is not UTF-8.
    """
    try:
        return read_input(path, utf_16)
    except OSError as error:
        reason = error.strerror or str(error)
        raise input_error(path, f"cannot be read: {reason}", "check the path and its permissions") from error
    except UnicodeDecodeError as error:
        raise input_error(path, *about_encoding(error)) from error


def read_section(place: Path, text: str, name: str) -> dict[str, Any]:
    """Read a section of the TOML text of a study that a file holds; empty if there is none.

    Raises
    ------
    InputError
        When the text is not TOML, or the section is no table.
    """
    section = read_toml(place, text).get(name, {})
    if not isinstance(section, dict):
        remedy = "the file is damaged: run its study again into another one"
        raise input_error(place, f"holds a study whose {name} is no table", remedy)
    return section


def with_lines(faults: Sequence[Fault], place: str, text: str | Mapping[str, int]) -> list[Fault]:
    """Add the line to the place of each fault of a file.

    Parameters
    ----------
    faults : sequence of Fault
        Faults of this file and of others, which stay as they are.
    place : str
        What stands before the key path in the places of this file's faults.
    text : str or mapping of str to int
        The file's text, which is TOML, or the line of each key path.

    Returns
    -------
    list of Fault
        ``study.toml:12: sampling.n`` for ``study.toml: sampling.n``. A missing key has the line of the innermost table
        around it that the file has; a fault without key path has no line.
    """
    if isinstance(text, str):
        text = {dotted(path): line for path, line in toml_lines.of_keys(text).items()}
    return [_with_line(fault, place, text) for fault in faults]


def _with_line(fault: Fault, place: str, lines: Mapping[str, int]) -> Fault:
    path = fault.place.removeprefix(f"{place}: ")
    if path == fault.place:
        return fault
    above = path
    while above and above not in lines:
        above = above[: max(above.rfind("."), above.rfind("["), 0)]
    return replace(fault, place=f"{place}:{lines[above]}: {path}") if above else fault


@contextmanager
def lines_of(path: Path) -> Iterator[None]:
    """Add lines to the faults of a TOML file that are raised inside, see `with_lines`."""
    try:
        yield
    except InputError as error:
        text = read_input(path)
        raise InputError(with_lines(error.faults, str(path), text)) from error


def dotted(location: Sequence[int | str]) -> str:
    """Key path as a user writes it: ``tolerances.pin1.offset_t``, ``correlation[0].rho``."""
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def validate(
    model: type[ModelT],
    data: object,
    place: str,
    *,
    prefix: tuple[int | str, ...] = (),
    context: Mapping[str, Any] | None = None,
    examples: Mapping[str, Any] | None = None,
) -> ModelT:
    """Validate `data` against `model`.

    Parameters
    ----------
    model : type
        A `Strict` model.
    data : object
        Parsed TOML; anything but a mapping is a fault.
    place : str
        What to put before each key path, usually the file's name.
    prefix : tuple
        Key path of `data` in its file, shown in the faults.
    context : mapping, optional
        Passed to the model's validators.
    examples : mapping, optional
        Value by dotted key, as a file writes it, for faults about missing keys whose field has no example.

    Returns
    -------
    BaseModel
        The validated model.

    Raises
    ------
    InputError
        With one `Fault` for every fault in `data`.
    """
    try:
        return model.model_validate(data, context=context)
    except ValidationError as error:
        each = error.errors(include_url=False)
        raise InputError([_fault(e, model, data, place, prefix, examples or {}) for e in each]) from error


_REMEDIES = {
    "greater_than": "give a value above {gt}",
    "greater_than_equal": "give a value of at least {ge}",
    "less_than": "give a value below {lt}",
    "less_than_equal": "give a value of at most {le}",
    "too_short": "give at least {min_length} entries",
    "int_type": "write a whole number, without quotes",
    "int_from_float": "write a whole number",
    "bool_type": "write true or false, without quotes",
    "string_type": "write a text in quotes",
    "list_type": "write a list in [ ]",
    "dict_type": "write a table",
    "model_type": "write a table",
}
"""Remedy for a kind of pydantic error, filled from the error's context."""


def _fault(
    e: Any, model: type[BaseModel], data: object, place: str, prefix: tuple[int | str, ...], known: Mapping[str, Any]
) -> Fault:
    path = dotted((*prefix, *e["loc"]))
    where = f"{place}: {path}" if path else place
    context = e.get("ctx", {})
    if "remedy" in context:
        found, remedy = context["found"].replace("{input}", repr(e["input"])), context["remedy"]
        for key in context.get("keys", ()):
            written = _written(data, e["loc"], key.split("."))
            found, remedy = (text.replace(f"{{{key}}}", written) for text in (found, remedy))
        return Fault(where, found, remedy)
    if e["type"] == "extra_forbidden":
        keys = [field.alias or name for name, field in _fields_around(model, e["loc"]).items()]
        return Fault(where, "unknown key", did_you_mean(str(e["loc"][-1]), keys))
    if e["type"] == "missing":
        return Fault(where, "missing key", f"add {path}" + _example(model, e["loc"], known))
    if e["type"] in ("literal_error", "enum"):
        return Fault(where, f"{e['input']!r} is not allowed", f"write one of {context['expected']}")
    remedy = _REMEDIES.get(e["type"], "give a value of the expected type").format(**context)
    return Fault(where, f"{e['input']!r}: {e['msg'].removeprefix('Input ')}", remedy)


def _written(data: object, location: Sequence[int | str], key: Sequence[str]) -> str:
    """Value of a key as it is written, from the innermost table around a place that has the key."""
    tables: list[Any] = [data]
    for part in location:
        try:
            tables.append(tables[-1][part])
        except (LookupError, TypeError):
            break
    for table in reversed(tables):
        value = table
        for part in key:
            value = value.get(part) if isinstance(value, Mapping) else None
        if value is not None:
            return ", ".join(map(str, value)) if isinstance(value, (list, tuple)) else str(value)
    return ".".join(key)


def did_you_mean(word: str, allowed: Sequence[str]) -> str:
    """Remedy for an unknown word: the closest of the allowed ones, else all of them."""
    spelt = {name.lower(): name for name in allowed}
    close = difflib.get_close_matches(word.lower(), spelt, n=1)
    return f"did you mean {spelt[close[0]]!r}?" if close else f"allowed here: {', '.join(allowed) or 'nothing'}"


def _fields_around(model: type[BaseModel], location: Sequence[int | str]) -> dict[str, FieldInfo]:
    """Fields of the model around the key at a path of `model`, by name; empty where they are not known."""
    current: Any = model
    for part in location[:-1]:
        if isinstance(part, int):
            current = next(iter(get_args(current)), None)
        elif get_origin(current) is dict:
            current = get_args(current)[1]
        elif part not in (fields := getattr(current, "model_fields", {})):
            return {}
        else:
            current = fields[part].annotation
            if NoneType in get_args(current):  # a key that may be left out
                current = get_args(current)[0]
    return getattr(current, "model_fields", {})


def _example(model: type[BaseModel], location: Sequence[int | str], known: Mapping[str, Any]) -> str:
    """How a file writes the key at a path, as its field has it: `` = "22 mm"``; empty where no example is known."""
    fields = _fields_around(model, location).items()
    examples = next((field.examples for name, field in fields if location[-1] in (name, field.alias)), None)
    example = examples[0] if examples else known.get(dotted(location))
    if example is None or isinstance(example, (Mapping, list)):
        return ""
    return f", for example {location[-1]} = {json.dumps(example, ensure_ascii=False)}"


def refuse(found: str, remedy: str, *keys: str) -> PydanticCustomError:
    """Error for a validator to raise, which becomes a `Fault` with this text.

    Each of `keys`, such as ``"D_H"`` or ``"cross.R"``, is replaced where it stands in braces by the value as the file
    has it: faults show the numbers and units of the user.
    """
    return PydanticCustomError("refused", "{found}", {"found": found, "remedy": remedy, "keys": keys})


def _complete(schema: dict[str, Any], model: type[BaseModel]) -> None:
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
