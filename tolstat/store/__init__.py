"""The result file of a campaign: stores tables, contains no physics."""

from tolstat.store.counts import Counts
from tolstat.store.reader import Reader
from tolstat.store.result_store import ResultStore
from tolstat.store.sources import viewed

__all__ = ["Counts", "Reader", "ResultStore", "viewed"]
