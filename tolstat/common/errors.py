"""Errors that a user can cause, with where, what was found, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

MAX_SHOWN = 4000
"""Most characters of a place, a finding or a remedy that a message shows; a file may have made them very long."""


@dataclass(frozen=True)
class Fault:
    """One fault of an input.

    Attributes
    ----------
    place : str
        Where: the file, its line, and the key path in it (``"study.toml:12: tolerances.pin1.offset_t"``).
    found : str
        What is wrong, with the value found.
    remedy : str
        What to write or to do instead.
    """

    place: str
    found: str
    remedy: str

    def __str__(self) -> str:
        texts = self.place, self.found, self.remedy
        place, found, remedy = (text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]} ..." for text in texts)
        return f"{place}: {found}\n  hint: {remedy}"


class TolstatError(Exception):
    """Base of the errors that a user can correct; the command line ends with exit code 2."""


class InputError(TolstatError):
    """An input file or an option with one or more faults, all of them listed at once.

    Parameters
    ----------
    faults : sequence of Fault
        Every fault found, in the order of the file.
    """

    def __init__(self, faults: list[Fault] | tuple[Fault, ...]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(str(fault) for fault in self.faults))


def input_error(place: object, found: str, remedy: str) -> InputError:
    """Error with one fault, see `Fault`."""
    return InputError([Fault(str(place), found, remedy)])


@contextmanager
def collected() -> Iterator[list[Fault]]:
    """List for the faults found inside, which are raised at the end.

    Raises
    ------
    InputError
        When there are any.
    """
    faults: list[Fault] = []
    yield faults
    raise_all(faults)


def raise_all(faults: Iterable[Fault]) -> None:
    """Raise an `InputError` with all faults, each once, if there are any."""
    if every := tuple(dict.fromkeys(faults)):
        raise InputError(every)


@contextmanager
def gather(faults: list[Fault]) -> Iterator[None]:
    """Add the faults of an `InputError` raised inside to `faults` and continue, so that all are reported at once."""
    try:
        yield
    except InputError as error:
        faults.extend(error.faults)


class StoreError(TolstatError):
    """A result file that cannot be used as requested: not a tolstat file, too new, of another study, or locked."""


class NotApplicable(StoreError):
    """A question that does not apply to a result file: its command says why, and the page does not show it."""
