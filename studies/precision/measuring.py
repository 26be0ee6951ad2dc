"""What measurements share: joints of a study, CPU times taken in turn, machine and versions, tables in pages."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tolstat import sampling
from tolstat.common.errors import Fault, InputError
from tolstat.common.files import write_text
from tolstat.store.recorded import perturbed
from tolstat.study import Study

PACKAGES = ("tolstat", "numba", "numpy", "scipy", "scikit-sundae", "exudyn")


def parameters(study: Study, rows: NDArray[np.intp]) -> NDArray[np.void]:
    """Draw the joints of some rows of a study, in any order; (m,) PARAM."""
    first = int(rows.min())
    errors = sampling.draw(study, range(first, int(rows.max()) + 1))[rows - first]
    return perturbed(study, rows, errors)


def choose(study: Study, n: int, seed: int, block: int) -> tuple[NDArray[np.void], int]:
    """Choose the joints on which integrators are compared, then further ones for a block.

    Parameters
    ----------
    study : Study
        The study.
    n : int
        Number of random joints to compare, beside the nominal one if the study has it.
    seed : int
        Seed of the choice.
    block : int
        Number of joints to return, if the study has as many and not more are compared.

    Returns
    -------
    params : ndarray of PARAM
        The joints, those that are compared first.
    count : int
        Number of joints that are compared.
    """
    first = study.first_sample
    drawn = first + np.random.default_rng(seed).permutation(study.rows - first)
    rows = np.concatenate([np.arange(first), drawn])
    count = min(first + n, len(rows))
    return parameters(study, rows[: max(block, count)]), count


class Times(NamedTuple):
    """CPU times by name, taken in turn: other load on the machine affects all alike, so that ratios stay valid.

    Attributes
    ----------
    seconds : dict of str to ndarray, shape (rounds,)
        CPU time of each task, s.
    returned : dict of str to object
        What each task returned in the last round.
    """

    seconds: dict[str, NDArray[np.float64]]
    returned: dict[str, Any]

    def typical(self, name: str) -> float:
        """Median over the rounds, s."""
        return float(np.median(self.seconds[name]))

    def least(self, name: str) -> float:
        """Minimum over the rounds, s: other load on the machine only adds to a time."""
        return float(self.seconds[name].min())

    def ratio(self, name: str, to: str) -> float:
        """Median over the rounds of the ratio of two times."""
        return float(np.median(self.seconds[name] / self.seconds[to]))


def in_turn(
    tasks: Mapping[str, Callable[[], object]], rounds: int, clock: Callable[[], float] = time.process_time
) -> Times:
    """Time all tasks one after the other, round by round, after a warm-up round that is not counted.

    Parameters
    ----------
    tasks : dict of str to callable
        What to time, by name.
    rounds : int
        Number of rounds.
    clock : callable, optional
        Clock in seconds; by default the CPU time of this process.

    Returns
    -------
    Times
    """
    times = Times({name: np.empty(rounds) for name in tasks}, {})
    for count in range(-1, rounds):
        for name, task in tasks.items():
            begin = clock()
            times.returned[name] = task()
            if count >= 0:
                times.seconds[name][count] = clock() - begin
    return times


def versions() -> str:
    """Versions of Python and of the packages that compute, as far as they are installed, in one line."""
    found = [f"python {platform.python_version()}"]
    for package in PACKAGES:
        try:
            found.append(f"{package} {version(package)}")
        except PackageNotFoundError:
            continue
    return ", ".join(found)


def machine() -> str:
    """Processor, operating system and `versions`, in one line."""
    from llvmlite.binding import get_host_cpu_name

    return f"processor {get_host_cpu_name()}, system {platform.system()} {platform.machine()}, {versions()}"


def markdown(rows: Sequence[Sequence[str]]) -> str:
    """Table in Markdown of rows of text, the first its headings."""
    return "\n".join(f"| {' | '.join(row)} |" for row in (rows[0], ["---"] * len(rows[0]), *rows[1:]))


def split_page(path: Path, name: str) -> tuple[str, str]:
    """Split a Markdown file at its comments ``<!-- name -->`` and ``<!-- end of name -->``, which enclose a part.

    Raises
    ------
    InputError
        When the file cannot be read or lacks the two comments.
    """
    begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    try:
        content = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError([Fault(str(path), f"cannot be read: {error}", "name a Markdown file")]) from error
    head, opened, rest = content.partition(begin)
    _, closed, tail = rest.partition(end)
    if not (opened and closed):
        raise InputError([Fault(str(path), "has no place for the table", f"add the lines {begin} and {end}")])
    return head + begin, end + tail


def insert(path: Path, name: str, part: str) -> None:
    """Replace part `name` of a file by the text `part`; raises as `split_page` does."""
    head, tail = split_page(path, name)
    write_text(path, f"{head}\n\n{part}\n\n{tail}")
