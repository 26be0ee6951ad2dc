"""Operations of the kernel's parts, counted by running its Python source with a number class that counts.

``python -m tests.measure.operations`` counts in a process of its own without compilation: additions, subtractions,
multiplications, divisions and square roots count as one each, as written in the source; sines, cosines, comparisons
and signs do not count. A lane does the same operations, and more where another lane takes a branch that it does not.
"""

from __future__ import annotations

import io
import json
import math
import subprocess
import sys
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from tests.support.environment import environment
from tests.support.kernel_states import Snapshot


class Counting:
    """A number that counts the operations on it, in `Counting.done`."""

    done = 0
    __array_ufunc__ = None  # NumPy's numbers leave the operation to this class
    __slots__ = ("value",)

    def __init__(self, value: float) -> None:
        self.value = float(value)

    def __float__(self) -> float:
        return self.value

    def __int__(self) -> int:
        return int(self.value)

    def __bool__(self) -> bool:
        return bool(self.value)

    def __neg__(self) -> Counting:
        return Counting(-self.value)

    def __abs__(self) -> Counting:
        return Counting(abs(self.value))

    def sqrt(self) -> Counting:
        """Square root."""
        return _count(math.sqrt(self.value))


def _count(value: float) -> Counting:
    Counting.done += 1
    return Counting(value)


def _define(name: str, counted: bool) -> None:
    of_float = getattr(float, f"__{name}__")

    def method(self: Counting, other: Any) -> Any:
        value = of_float(self.value, float(other))
        return _count(value) if counted else value

    setattr(Counting, f"__{name}__", method)


for _name in ("add", "radd", "sub", "rsub", "mul", "rmul", "truediv", "rtruediv"):
    _define(_name, True)
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    _define(_name, False)


def _counting_math() -> SimpleNamespace:
    """``math`` whose trigonometric functions and square root return `Counting`."""
    functions: dict[str, Any] = {name: getattr(math, name) for name in dir(math) if not name.startswith("_")}
    for name in ("sin", "cos", "tan", "atan2"):
        functions[name] = lambda *x, of=functions[name]: Counting(of(*map(float, x)))
    functions["sqrt"] = lambda x: Counting(float(x)).sqrt()
    return SimpleNamespace(**functions)


def _counting(values: Any) -> Any:
    """Convert an array or number to `Counting`."""
    array = np.asarray(values)
    if array.ndim == 0:
        return Counting(float(array))
    out = np.empty(array.shape, object)
    for place, value in np.ndenumerate(array):
        out[place] = Counting(float(value))
    return out


def count(snapshot: Snapshot) -> dict[str, int]:
    """Count the operations of each part; call it with compilation disabled only.

    Returns
    -------
    dict of str to int
        ``contact``, ``residual`` (with contacts), ``assembly``, ``elimination``, ``substitution``.
    """
    from tolstat.common.cardan import CARDAN
    from tolstat.common.tables import Options
    from tolstat.kernel.mechanics import cardan as of_joint
    from tolstat.kernel.mechanics import contact as contacts
    from tolstat.kernel.mechanics import dynamics, linsolve, rotation, tangent
    from tolstat.kernel.mechanics import motion as motions
    from tolstat.kernel.mechanics.work import work_fields

    for module in (of_joint, contacts, dynamics, motions, rotation):
        vars(module)["math"] = _counting_math()
    row = snapshot.params[0]
    par = SimpleNamespace(
        **{name: _counting(row[name]) if row.dtype[name].base.kind == "f" else row[name] for name in row.dtype.names}
    )
    work = SimpleNamespace(**{name: _counting(np.zeros(shape)) for name, shape in work_fields(CARDAN).items()})
    t, cv, ca = Counting(snapshot.t), Counting(snapshot.cv), Counting(snapshot.ca)
    q, v, a, out = (_counting(x) for x in (snapshot.q, snapshot.v, snapshot.a, np.zeros(snapshot.q.size)))
    parts: dict[str, Callable[[], Any]] = {
        "residual": lambda: dynamics.residual(t, q, v, a, par, Options(), work, out),
        "contact": lambda: [contacts.contact_load(pin, par, work) for pin in range(par.pin.size)],
        "assembly": lambda: tangent.assemble(cv, ca, cv, par, work),
        "elimination": lambda: linsolve.factorise(par, work),
        "substitution": lambda: linsolve.solve(q, par, work),
    }
    counts = {}
    for name, part in parts.items():
        Counting.done = 0
        work.solution[:] = -out if name == "substitution" else work.solution
        part()
        counts[name] = Counting.done
    return counts


def count_apart(snapshots: Sequence[Snapshot]) -> list[dict[str, int]]:
    """Call `count` for each snapshot, in a process without compilation."""
    command = [sys.executable, "-m", "tests.measure.operations"]
    told = io.BytesIO()
    np.savez(told, *(np.array(column) for column in zip(*snapshots, strict=True)))
    done = subprocess.run(
        command,
        input=told.getvalue(),
        stdout=subprocess.PIPE,
        env=environment() | {"NUMBA_DISABLE_JIT": "1"},
        check=True,
    )
    counts: list[dict[str, int]] = json.loads(done.stdout)
    return counts


def _main() -> None:
    told = np.load(io.BytesIO(sys.stdin.buffer.read()))
    columns = [told[name] for name in told.files]
    json.dump([count(Snapshot(*values)) for values in zip(*columns, strict=True)], sys.stdout)


if __name__ == "__main__":
    _main()
