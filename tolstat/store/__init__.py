"""The result file of a campaign: stores tables, contains no physics."""

from tolstat.store.reader import Reader
from tolstat.store.result_file import ResultFile, viewed
from tolstat.store.view import View
from tolstat.store.writer import Writer

__all__ = ["Reader", "ResultFile", "View", "Writer", "open", "viewed"]

open = ResultFile.open
