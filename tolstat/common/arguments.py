"""Arguments of public functions: numbers, texts and paths of a wrong type are refused before anything is done."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, wraps
from inspect import signature
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from sys import modules
from types import UnionType
from typing import Annotated, Any, get_args, get_origin

from tolstat.common.errors import Fault, InputError

KINDS: dict[Any, tuple[tuple[type, ...], str]] = {
    int: ((Integral,), "a whole number"),
    float: ((Real,), "a number"),
    str: ((str,), "a text"),
    list: ((list, tuple), "a list"),
    Path: ((str, PathLike), "a path"),
    type(None): ((type(None),), "None"),
}
"""Types of annotations: what their values are instances of, and words for them."""
NAMED = {kind.__name__: kind for kind in KINDS} | {"None": type(None)}


@cache
def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """Let a function refuse arguments of the wrong type, all in one error.

    Parameters are checked whose annotations name nothing but types of `KINDS`.
    """
    its = signature(function)
    annotations = {name: list(_types(its.parameters[name].annotation, function)) for name in its.parameters}
    wanted = {name: found for name, found in annotations.items() if KINDS.keys() >= set(found)}

    @wraps(function)
    def called(*values: Any, **options: Any) -> Any:
        faults = []
        for name, value in its.bind(*values, **options).arguments.items():
            kinds = [KINDS[kind] for kind in wanted.get(name, ())]
            if kinds and not any(isinstance(value, classes) for classes, _ in kinds):
                remedy = f"give {' or '.join(words for _, words in kinds)}"
                faults.append(Fault(name, f"{value!r} is of type {type(value).__name__}", remedy))
        if faults:
            raise InputError(faults)
        return function(*values, **options)

    return called


def _types(annotation: Any, function: Callable[..., Any]) -> Iterator[type]:
    """Types that an annotation, a text or its value, is a union of; `object` for what is no plain type."""
    if isinstance(annotation, str):
        for part in annotation.split(" | "):
            yield from _types(NAMED.get(part) or vars(modules[function.__module__]).get(part, object), function)
    elif get_origin(annotation) is Annotated:
        yield from _types(get_args(annotation)[0], function)
    elif isinstance(annotation, UnionType):
        yield from (kind for part in get_args(annotation) for kind in _types(part, function))
    else:
        plain = get_origin(annotation) or annotation
        yield plain if isinstance(plain, type) else object
