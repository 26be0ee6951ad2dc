"""Takes away from Python what it does not have on Windows: a process imports this first if the folder is on its path.

Libraries have code of their own for Windows: they keep what they use here; tolstat and its tests alone do without.
"""

import builtins
import enum
import glob
import io
import multiprocessing.context
import os
import signal
import sys
from contextlib import suppress

import filelock

MODULES = {"fcntl", "grp", "pty", "pwd", "resource", "syslog", "termios", "tty"}
NAMES = """
    chown chroot confstr fchmod fchown fork forkpty fpathconf fstatvfs getegid geteuid getgid getgroups getloadavg
    getpgid getpgrp getpriority getresgid getresuid getsid getuid initgroups killpg lchown lockf major makedev minor
    mkfifo mknod nice openpty pathconf pipe2 posix_fadvise posix_fallocate posix_spawn posix_spawnp pread preadv
    pwrite pwritev readv register_at_fork sched_getaffinity sched_setaffinity sched_yield sendfile setegid seteuid
    setgid setgroups setpgid setpriority setresgid setresuid setsid setuid statvfs sync sysconf tcgetpgrp tcsetpgrp
    ttyname uname wait wait3 wait4 waitid writev O_ACCMODE O_ASYNC O_CLOEXEC O_DIRECTORY O_DSYNC O_NDELAY O_NOCTTY
    O_NOFOLLOW O_NONBLOCK O_PATH O_RSYNC O_SYNC O_TMPFILE
"""
"""Names of `os` that Windows lacks."""
SIGNALS = ("SIGABRT", "SIGFPE", "SIGILL", "SIGINT", "SIGSEGV", "SIGTERM")
"""Signals that it has."""


def by_own(names):
    """Whether code with such global names is not that of a library, which knows the system that it is on."""
    return names.get("__name__", "").startswith(("tolstat", "tests"))


def hide(module, names):
    """Take names from a module."""
    kept = {name: vars(module).pop(name) for name in names if hasattr(module, name)}

    def find(name):
        if name not in kept or by_own(sys._getframe(1).f_globals):
            raise AttributeError(f"module {module.__name__!r} has no attribute {name!r}", name=name, obj=module)
        return kept[name]

    module.__getattr__ = find


def take_away():
    """Remove modules, names of `os` and signals."""
    real = builtins.__import__

    def imported(name, names=None, *rest, **options):
        if name in MODULES and by_own(names or {}):
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return real(name, names, *rest, **options)

    builtins.__import__ = imported
    hide(os, NAMES.split())
    numbers = {name: int(getattr(signal, name)) for name in SIGNALS}
    others = [name for name in vars(signal) if name.startswith(("SIG", "pthread_")) and name not in SIGNALS]
    hide(signal, {*others} - {"SIG_DFL", "SIG_IGN"})
    signal.Signals = enum.IntEnum("Signals", numbers)


def spawn_only():
    """Let processes be spawned only."""
    spawn = multiprocessing.get_context("spawn")
    multiprocessing.context._concrete_contexts = {"spawn": spawn}
    multiprocessing.context._default_context._default_context = spawn
    multiprocessing.get_all_start_methods = lambda: ["spawn"]


def text_as_on_windows():
    """Read and write text as cp1252 with line ends of Windows where a file is opened without saying."""
    real = io.open

    def opened(file, mode="r", buffering=-1, encoding=None, errors=None, newline=None, closefd=True, opener=None):
        if "b" not in mode:
            encoding = "cp1252" if encoding in (None, "locale") else encoding
            newline = "\r\n" if newline is None and "r" not in mode else newline
        return real(file, mode, buffering, encoding, errors, newline, closefd, opener)

    builtins.open = io.open = opened


def is_open(path):
    """Whether any process has a file open."""
    with suppress(OSError):
        own = os.stat(path)
        for handle in glob.glob("/proc/[0-9]*/fd/*"):
            with suppress(OSError):
                if os.path.samestat(os.stat(handle), own):
                    return True
    return False


def files_in_use_stay():
    """Refuse to remove, rename or replace a file that is open, and to open a folder; locks are removed at the end."""
    for name in ("remove", "rename", "replace", "unlink"):
        real = getattr(os, name)

        def checked(*paths, _real=real, **options):
            if any(is_open(path) for path in paths):
                raise PermissionError(13, "The process cannot access the file: it is used by another process", paths[0])
            return _real(*paths, **options)

        setattr(os, name, checked)
    open_handle, release = os.open, filelock.FileLock._release

    def opened(path, *arguments, **options):
        if os.path.isdir(path) and by_own(sys._getframe(1).f_globals):
            raise PermissionError(13, "Permission denied", path)
        return open_handle(path, *arguments, **options)

    def released(self):
        release(self)
        with suppress(OSError):
            os.unlink(self.lock_file)

    os.open, filelock.FileLock._release = opened, released


take_away()
spawn_only()
text_as_on_windows()
files_in_use_stay()
os.environ["HDF5_USE_FILE_LOCKING"] = "FALSE"
