"""Compiled code on disk, with a checksum inside each file: what does not match its checksum is compiled anew.

Numba maps what it finds in its cache into the process, so that one wrong bit crashes it. Here a file is read as a whole
and compared with its checksum before it is unpickled. There is a file for each version of a kernel, named by what it
was compiled from and for: processes that compile at the same time write the same files, each as a whole, and none
overwrites another one's. Checksums are against accidents; against others, `cache_folder.is_trusted` asks who may write.

This module depends on Numba's internals, as `unit` does; ``tests/kernel/test_cache.py`` fails where they change.
"""

import hashlib
import os
import pickle
import uuid
from pathlib import Path

from numba.core import config
from numba.core.caching import FunctionCache, UserProvidedCacheLocator
from numba.core.runtime import rtsys
from numba.core.serialize import dumps

from tolstat.kernel.simd.cache_folder import KERNEL, SUFFIX, tell

DIGEST = hashlib.sha256
SIZE = DIGEST().digest_size


class Locator(UserProvidedCacheLocator):
    """Cache locator that ignores the folder of the sources: one compilation serves every environment."""

    @classmethod
    def get_suitable_cache_subpath(cls, py_file):
        """Subfolder of the cache directory; the hash in the directory's name already identifies the sources."""
        of_kernel = Path(py_file).is_relative_to(KERNEL)
        return KERNEL.name if of_kernel else str(super().get_suitable_cache_subpath(py_file))

    def ensure_cache_path(self):
        """Require nothing: a folder that can only be read will do."""


class CheckedFiles:
    """Files of one kernel, each a checksum and what it is of; takes the place of Numba's index and data files."""

    def __init__(self, folder, name, stamp):
        self.folder = Path(folder)
        self.name = name
        self.stamp = stamp

    def path(self, key):
        """File of one version of the kernel."""
        version = DIGEST(repr((self.stamp, key)).encode()).hexdigest()[:16]
        return self.folder / f"{self.name}.{version}{SUFFIX}"

    def load(self, key):
        """What was saved under `key`; None if there is no file, or a damaged one, or that of another version."""
        try:
            data = self.path(key).read_bytes()
        except OSError:
            return None
        if DIGEST(data[SIZE:]).digest() != data[:SIZE]:
            tell(f"compiled code in {self.folder} is damaged: it is compiled anew, which takes about half a minute")
            return None
        saved, content = pickle.loads(data[SIZE:])
        return content if saved == repr(key) else None

    def save(self, key, content):
        """Save a version of the kernel; where the folder cannot be written, it is compiled at each start."""
        path = self.path(key)
        part = path.with_name(f"{path.name}.{uuid.uuid4().hex[:8]}.part")
        body = dumps((repr(key), content))
        try:
            self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            part.write_bytes(DIGEST(body).digest() + body)
            os.replace(part, path)
        except OSError as error:
            part.unlink(missing_ok=True)
            tell(f"compiled code cannot be kept in {self.folder}: {error.strerror}")


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


def keep(kernel):
    """Keep the code of a kernel that Python calls in the directory that Numba is configured for."""
    before = config.CACHE_LOCATOR_CLASSES
    config.CACHE_LOCATOR_CLASSES = f"{__name__}.{Locator.__name__}"  # Numba reads it when a cache is made
    try:
        kernel._cache = CheckedCache(kernel.py_func)
    finally:
        config.CACHE_LOCATOR_CLASSES = before
