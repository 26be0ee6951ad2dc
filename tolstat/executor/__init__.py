"""Blocks of work through a function: in this process, in supervised ones, or on a cluster. It knows no physics."""

from tolstat.executor.common import Lost, Work, WorkerDied, available_workers
from tolstat.executor.processes import map_in_processes
from tolstat.executor.serial import map_here

__all__ = ["Lost", "Work", "WorkerDied", "available_workers", "map_here", "map_in_processes"]
