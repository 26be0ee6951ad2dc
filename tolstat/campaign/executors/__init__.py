"""Apply a function to blocks of work: in this process, in supervised processes, or on a cluster; no physics."""

from tolstat.campaign.executors.common import Lost, Work, WorkerDied
from tolstat.campaign.executors.processes import kept_workers, map_in_processes
from tolstat.campaign.executors.serial import map_serially

__all__ = ["Lost", "Work", "WorkerDied", "kept_workers", "map_in_processes", "map_serially"]
