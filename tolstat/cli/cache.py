"""``tolstat cache``: where compiled kernels are kept, and how to remove them."""

from __future__ import annotations

import typer

from tolstat.cli._talk import say
from tolstat.kernel.simd import cache_folder


def cache(*, clear: bool = False) -> None:
    """Show where compiled kernels are kept, or remove them.

    Prints the folders with compiled kernels, one for each version of tolstat and Numba that was used, and their sizes.
    Kernels are compiled at the first use, about half a minute; a file that is damaged is compiled anew by itself. The
    environment variable NUMBA_CACHE_DIR names another folder for them.

    Example: tolstat cache

    Parameters
    ----------
    clear : bool
        Remove the compiled kernels of all versions.
    """
    if clear:
        say(f"removed {cache_folder.clear() / 1e6:.1f} MB of compiled kernels")
        return
    for folder in cache_folder.folders():
        files, size = cache_folder.size(folder)
        typer.echo(f"{folder}: {files} kernels, {size / 1e6:.1f} MB")
    say(f"in use: {cache_folder.CACHE_DIRECTORY}")
