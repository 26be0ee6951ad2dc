"""Functions of blocks for worker processes; apart from the tests, so that a worker need not import what these do."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path
from typing import Any

from tolstat.common.cores import THREAD_VARIABLES


def square(x: int) -> int:
    return x * x


def slow_square(x: int) -> int:
    time.sleep(0.05)
    return x * x


def very_slow_first(x: int) -> int:
    time.sleep(60 if x == 0 else 0)
    return x


def squares(xs: list[int]) -> list[int]:
    """Squares; 11 kills the process, 13 is a bug."""
    for x in xs:
        if x == 11:
            os.kill(os.getpid(), signal.SIGKILL)
        if x == 13:
            raise ZeroDivisionError("a bug")
    return [x * x for x in xs]


def halves(xs: list[int]) -> list[list[int]]:
    return [part for part in (xs[: (len(xs) + 1) // 2], xs[(len(xs) + 1) // 2 :]) if part]


def die(x: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return x


def bad_luck(job: tuple[str, int]) -> int:
    """Square; the first process that comes to a multiple of three dies of it, the next does not."""
    folder, x = job
    if x % 3 == 0 and not Path(folder, str(x)).exists():
        Path(folder, str(x)).touch()
        die(x)
    return x * x


def die_in_the_end(job: tuple[str, int]) -> int:
    """Every process dies after five blocks, whatever it works at, as when another program takes all memory."""
    folder, x = job
    if len(list(Path(folder).iterdir())) >= 5:
        die(x)
    Path(folder, str(x)).touch()
    return x


def surroundings(x: int) -> tuple[int, dict[str, str | None], set[Any]]:
    names = ("SIGINT", "SIGTERM", "SIGHUP")  # the last one is not on Windows
    handlers = {signal.getsignal(getattr(signal, name)) for name in names if hasattr(signal, name)}
    return os.getpid(), {name: os.environ.get(name) for name in THREAD_VARIABLES}, handlers


def mark() -> None:
    """Leave a mark in this process."""
    os.environ["MARKED"] = "yes"


def marked(x: int) -> bool:
    return "MARKED" in os.environ


def large(x: int) -> bytes:
    """More than a pipe holds: who is killed meanwhile is killed while it sends."""
    return bytes([x % 256]) * 10_000_000


def raise_often(xs: list[int]) -> list[int]:
    """Squares; one in seventeen is a bug."""
    if any(x % 17 == 5 for x in xs):
        raise ZeroDivisionError("a bug")
    return [x * x for x in xs]
