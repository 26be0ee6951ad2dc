"""The result file of a campaign; it knows tables, not physics."""

from tolstat.store.counts import Counts
from tolstat.store.result_store import ResultStore

__all__ = ["Counts", "ResultStore"]
