"""Strict input models: every fault of a file at once, each with its place and a remedy."""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import inf
from operator import itemgetter
from pathlib import Path
from types import NoneType
from typing import Any, TypeVar, get_args, get_origin

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError

from tolstat.common import json_schema, toml_lines, units, words
from tolstat.common.errors import Fault, InputError, input_error
from tolstat.common.files import about_encoding, read_input


class Strict(BaseModel):
    """Base of all input models: unknown keys are faults, values are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=False, defer_build=True)

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the JSON schema with bounds of quantities."""
        schema = handler(core)
        json_schema.complete(handler.resolve_ref_schema(schema), cls)
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
    """Add the line to the place of each fault of a file, and sort them by it.

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
        around it that the file has; a fault without key path has no line. Faults of other files come first, missing
        tables last.
    """
    if isinstance(text, str):
        text = {dotted(path): line for path, line in toml_lines.of_keys(text).items()}
    lined = [_with_line(fault, place, text) for fault in faults]
    return [fault for _, fault in sorted(lined, key=itemgetter(0))]


def _with_line(fault: Fault, place: str, lines: Mapping[str, int]) -> tuple[float, Fault]:
    path = fault.place.removeprefix(f"{place}: ")
    if path == fault.place:
        return 0, fault
    above = path
    while above and above not in lines:
        above = above[: max(above.rfind("."), above.rfind("["), 0)]
    if not above:
        return inf, fault
    return lines[above], replace(fault, place=f"{place}:{lines[above]}: {path}")


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
        faults = [_fault(e, model, data, place, prefix, examples or {}) for e in each]
        raise InputError(list(dict.fromkeys(faults))) from error


_REMEDIES = {
    "greater_than": "give a value above {gt}",
    "greater_than_equal": "give a value of at least {ge}",
    "less_than": "give a value below {lt}",
    "less_than_equal": "give a value of at most {le}",
    "too_short": "give at least {min_length} entries",
    "too_long": "give {max_length}",
    "int_type": "write a whole number, without quotes",
    "int_from_float": "write a whole number",
    "bool_type": "write true or false, without quotes",
    "string_type": "write a text in quotes",
    "list_type": "write a list in [ ]",
    "tuple_type": "write a list in [ ]",
    "dict_type": "write a table",
    "model_type": "write a table",
}
"""Remedy for a kind of pydantic error, filled from the error's context."""
_FOUND = {
    "too_long": "has {actual_length} entries",
    "list_type": "is not a list",
    "tuple_type": "is not a list",
    "dict_type": "is not a table",
    "model_type": "is not a table",
}
"""What is said of the value in place of pydantic's text; the remedy ends with an example."""


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
    if e["type"] == "missing" and isinstance(e["loc"][-1], int):
        example = _example(model, e["loc"][:-1], known)
        return Fault(where.rpartition("[")[0], f"{e['input']!r} has too few entries", f"give all{example}")
    if e["type"] == "missing":
        return Fault(where, "missing key", f"add {path}" + _example(model, e["loc"], known))
    if e["type"] in ("literal_error", "enum"):
        return Fault(where, f"{e['input']!r} is not allowed", f"write one of {context['expected']}")
    remedy = _REMEDIES.get(e["type"], "give a value of the expected type").format(**context)
    if e["type"] not in _FOUND:
        return Fault(where, f"{e['input']!r}: {e['msg'].removeprefix('Input ')}", remedy)
    remedy = _as_word(model, e["loc"], e["input"]) or remedy + _example(model, e["loc"], known)
    return Fault(where, f"{e['input']!r} {_FOUND[e['type']].format(**context)}", remedy)


def _as_word(model: type[BaseModel], location: Sequence[int | str], word: object) -> str:
    """Remedy for a word that a key of the tables around a place takes: ``write shaft.axial = "free"``; else empty."""
    for depth in range(len(location), 0, -1):
        for name, field in _fields_around(model, location[:depth]).items():
            if any(word in kind.words for kind in field.metadata if isinstance(kind, units.Quantity)):
                return f"write {dotted((*location[: depth - 1], name))} = {json.dumps(word)}"
    return ""


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


def did_you_mean(word: str, allowed: Sequence[str], before: str = "", behind: str = "") -> str:
    """Remedy for an unknown word: what a word of the trade means, else the closest of the allowed ones, else all.

    Of a part of a name, `before` and `behind` are what else the name has.
    """
    if remedy := words.remedy(word):
        return remedy
    spelt = {name.lower(): name for name in allowed}
    close = difflib.get_close_matches(word.lower(), spelt, n=1)
    return (
        f"did you mean {before + spelt[close[0]] + behind!r}?"
        if close
        else f"allowed here: {', '.join(allowed) or 'nothing'}"
    )


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
    example = _example_at(model, location, known) if location else None
    return "" if example is None else f", for example {location[-1]} = {_inline(example)}"


def _example_at(model: type[BaseModel], location: Sequence[int | str], known: Mapping[str, Any]) -> Any:
    """Example of the value at a path; of a table the keys that it must have, or its first one."""
    fields = _fields_around(model, location).items()
    if examples := next((field.examples for name, field in fields if location[-1] in (name, field.alias)), None):
        return examples[0]
    inside = {field.alias or name: field for name, field in _fields_around(model, (*location, "")).items()}
    each = {key: value for key in inside if (value := _example_at(model, (*location, key), known)) is not None}
    needed = {key: value for key, value in each.items() if inside[key].is_required()}
    return needed or dict(list(each.items())[:1]) or known.get(dotted(location))


def _inline(value: Any) -> str:
    """Value as TOML writes it on one line."""
    if isinstance(value, Mapping):
        return f"{{ {', '.join(f'{key} = {_inline(inner)}' for key, inner in value.items())} }}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_inline, value))}]"
    return json.dumps(value, ensure_ascii=False)


def refuse(found: str, remedy: str, *keys: str) -> PydanticCustomError:
    """Error for a validator to raise, which becomes a `Fault` with this text.

    Each of `keys`, such as ``"D_H"`` or ``"cross.R"``, is replaced where it stands in braces by the value as the file
    has it: faults show the numbers and units of the user.
    """
    return PydanticCustomError("refused", "{found}", {"found": found, "remedy": remedy, "keys": keys})
