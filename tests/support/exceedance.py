"""Shares and quantiles of arrays of loads, whose joints are drawn independently or listed."""

from tolstat.analysis.design import Listed
from tolstat.analysis.sample import Sample


def exceedance(values, status, level, confidence=0.95, iid=True):
    return Sample.of(values, status, None if iid else Listed()).above(level, confidence)


def quantile(values, status, share, confidence=0.95, iid=True):
    return Sample.of(values, status, None if iid else Listed()).quantile(share, confidence)
