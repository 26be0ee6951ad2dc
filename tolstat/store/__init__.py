"""The result file of a campaign; it knows tables, not physics."""

from tolstat.store.result_store import Counts, ResultStore

__all__ = ["Counts", "ResultStore"]
