"""Results of functions that are kept as long as their first argument, such as the shares above a view's limits."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import Any, Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

P = ParamSpec("P")
OwnerT = TypeVar("OwnerT")
T = TypeVar("T")


def once(function: Callable[Concatenate[OwnerT, P], T]) -> Callable[Concatenate[OwnerT, P], T]:
    """Decorate a function whose result is kept as long as its first argument; nobody may change it."""
    kept: WeakKeyDictionary[Any, dict[Any, T]] = WeakKeyDictionary()
    parameters = signature(function)

    @wraps(function)
    def found(owner: OwnerT, /, *args: P.args, **kwargs: P.kwargs) -> T:
        asked = parameters.bind(owner, *args, **kwargs)
        asked.apply_defaults()
        own, key = kept.setdefault(owner, {}), tuple(asked.arguments.items())[1:]
        if key not in own:
            own[key] = function(owner, *args, **kwargs)
        return own[key]

    return found
