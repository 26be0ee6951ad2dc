"""Memory of a process whose change shows that it makes progress: kernels count in it.

A process that another one supervises has it in memory that both see (`attach`). The supervisor only asks whether it has
changed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

SIZE = 16_384
"""Size of the memory, bytes."""
_ALIGNMENT = 64

_memory = np.zeros(SIZE, np.uint8)
_used = 0


def attach(memory: Any) -> None:
    """Use `memory`, a writable buffer of `SIZE` bytes, from now on; nothing may have been allocated before."""
    global _memory
    assert _used == 0
    _memory = np.frombuffer(memory, np.uint8)


def zeros(n: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Allocate an array, shape (n,), in the memory; it is never freed."""
    global _used
    first = -(-_used // _ALIGNMENT) * _ALIGNMENT
    _used = first + n * dtype.itemsize
    return _memory[first:_used].view(dtype)
