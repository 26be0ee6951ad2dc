"""Small results of a view, such as the shares above its limits, that several parts of a report ask for."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from inspect import signature
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

if TYPE_CHECKING:
    from tolstat.store.view import View

P = ParamSpec("P")
T = TypeVar("T")


def once(function: Callable[Concatenate[View, P], T]) -> Callable[Concatenate[View, P], T]:
    """Decorate a function of a view whose result is kept as long as the view; nobody may change it."""
    kept: WeakKeyDictionary[View, dict[Any, T]] = WeakKeyDictionary()
    parameters = signature(function)

    @wraps(function)
    def found(view: View, /, *args: P.args, **kwargs: P.kwargs) -> T:
        asked = parameters.bind(view, *args, **kwargs)
        asked.apply_defaults()
        own, key = kept.setdefault(view, {}), tuple(asked.arguments.items())[1:]
        if key not in own:
            own[key] = function(view, *args, **kwargs)
        return own[key]

    return found
