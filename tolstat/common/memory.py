"""Memory that this process has taken, and may take: what systems tell in different ways."""

from __future__ import annotations

from pathlib import Path

from tolstat.common.late import psutil


def peak_bytes() -> int:
    """Peak memory of this process so far, bytes; what it takes now where the system does not tell the peak (macOS)."""
    status, now = Path("/proc/self/status"), psutil.Process().memory_info()
    if status.exists():  # Linux; `getrusage` would count the memory of the process that started this one
        return 1024 * int(status.read_text(encoding="utf-8").partition("VmHWM:")[2].split()[0])
    return int(getattr(now, "peak_wset", now.rss))  # Windows


def limit_bytes() -> int:
    """Address space that this process may use, bytes; 0 if it is not limited, or the system knows no such limit."""
    process = psutil.Process()
    soft: int = process.rlimit(psutil.RLIMIT_AS)[0] if hasattr(process, "rlimit") else -1
    return max(0, soft)  # infinity is -1
