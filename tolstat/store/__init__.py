"""The result file of a campaign: stores tables, contains no physics."""

from tolstat.store.counts import Counts
from tolstat.store.reader import Reader, viewed
from tolstat.store.result_store import ResultStore

__all__ = ["Counts", "Reader", "ResultStore", "viewed"]
