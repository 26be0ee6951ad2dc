"""Compiled code on disk, with a checksum inside each file: what does not match its checksum is compiled anew.

Numba maps what it finds in its cache into the process, so that one wrong bit crashes it. Here a file is read as a whole
and compared with its checksum before it is unpickled. There is a file for each version of a kernel, named by what it
was compiled from and for: processes that compile at the same time write the same files, each as a whole, and none
overwrites another one's. Checksums are against accidents; against others, `cache_folder.is_trusted` asks who may write.

This module depends on Numba's internals, as `unit` does; where they have other names, its import fails and `jit` uses
Numba's own cache, which has no checksums.
"""

import hashlib
import os
import pickle
import sys
import uuid
from pathlib import Path

import llvmlite
import numba
from numba.core.caching import Cache, FunctionCache
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

from tolstat.kernel.simd.cache_folder import SUFFIX, tell

NEEDED = ("_index_key", "_load_overload", "_save_overload")
if not all(hasattr(Cache, name) for name in NEEDED):
    raise ImportError("Numba's cache is not the one that checked files are written for")

VERSIONS = (sys.version, numba.__version__, llvmlite.__version__)
DIGEST = hashlib.sha256


def sealed(key, content):
    """Bytes of a file: a checksum, then the key and what was compiled for it."""
    body = dumps((repr(key), content))
    return DIGEST(body).digest() + body


def opened(key, data):
    """Content of a file, from its bytes; None if they do not match their checksum, or the file is of another key."""
    size = DIGEST().digest_size
    body = data[size:]
    if DIGEST(body).digest() != data[:size]:
        return None
    of, content = pickle.loads(body)
    return content if of == repr(key) else None


class CheckedFiles:
    """Files of one kernel; takes the place of Numba's index and data files."""

    def __init__(self, folder, name, stamp):
        self.folder = Path(folder)
        self.name = name
        self.stamp = stamp

    def path(self, key):
        """File of one version of the kernel."""
        of = DIGEST(repr((VERSIONS, self.stamp, key)).encode()).hexdigest()[:16]
        return self.folder / f"{self.name}.{of}{SUFFIX}"

    def load(self, key):
        """What was saved under `key`; None if there is nothing, or nothing that can be believed."""
        try:
            data = self.path(key).read_bytes()
        except OSError:
            return None
        content = opened(key, data)
        if content is None:
            tell(f"compiled code in {self.folder} is damaged: it is compiled anew, which takes about half a minute")
        return content

    def save(self, key, content):
        """Save a version of the kernel; where the folder cannot be written, it is compiled at each start."""
        path = self.path(key)
        part = path.with_name(f"{path.name}.{uuid.uuid4().hex[:8]}.part")
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            part.write_bytes(sealed(key, content))
            os.replace(part, path)
        except OSError as error:
            part.unlink(missing_ok=True)
            tell(f"compiled code cannot be kept in {self.folder}: {error.strerror}")

    def flush(self):
        """Remove all versions of the kernel."""
        for path in self.folder.glob(f"{self.name}.*{SUFFIX}"):
            path.unlink(missing_ok=True)


class CheckedCache(FunctionCache):
    """Cache of a kernel's compiled code."""

    def __init__(self, py_func):
        super().__init__(py_func)
        locator = self._impl.locator
        self._cache_file = CheckedFiles(locator.get_cache_path(), self._impl.filename_base, locator.get_source_stamp())

    def load_overload(self, sig, target_context):
        """Load a version of the kernel; None if there is none.

        Numba first registers all functions that it can compile, which takes as long as loading all kernels. Code that
        is compiled needs its runtime only, and what is to be compiled registers them then.
        """
        rtsys.initialize(target_context)
        return self._load_overload(sig, target_context)
