"""Coverage, cost and bias of campaigns with a stop rule, computed: ``python -m tests.measure.stop_rule``."""

from __future__ import annotations

import numpy as np

from tests.support import stops
from tolstat.analysis import binomial
from tolstat.analysis.binomial import clopper_pearson

PLANS = ((0.4, 200), (0.2, 500), (0.1, 2000), (0.05, 5000), (0.02, 20_000), (0.01, 50_000), (0.005, 200_000))
RULES = ((binomial.GROWTH, binomial.LOOK_CONFIDENCE), (1.05, 0.95), (1.05, 0.96), (2.0, binomial.LOOK_CONFIDENCE))
"""Ratio of the joints of two looks, and confidence of a look: the rule itself, then others beside it."""
SHARES, ENDS = 60, 200
HEAD = (
    "width, joints, looks, a look, least coverage, too high, too low",
    "cost 20 above, cost 10 above, bias of share",
)


def fixed(p: float, width: float, confidence: float = 0.95) -> int:
    """Number of joints of a plan without looks: the interval is narrow enough with exactly a share p of them above."""

    def wide(n: int) -> bool:
        lower, upper = clopper_pearson(p * n, n, confidence)
        return bool(upper - lower >= width)

    low, high = 1, 2
    while wide(high):
        low, high = high, 2 * high
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if wide(middle) else (low, middle)
    return high


def row(width: float, n: int, growth: float, confidence: float) -> list[str]:
    """Line of the table: worst values over all shares up to one half that the campaign suffices for."""
    rule = stops.Rule(width, stops.grid(n, growth), confidence)
    misses = np.array([rule.misses(float(p)) for p in rule.ends(ENDS)])
    costs, bias = {20: [], 10: []}, []
    for p in np.geomspace(10.0 / n, 0.5, SHARES):
        joints, plain = rule.joints(float(p)), fixed(float(p), width)
        bias.append(rule.bias(float(p)))
        for least, ratios in costs.items():
            if p * plain >= least and plain < n:
                ratios.append(joints / plain)
    worst = 1.0 - misses.sum(axis=1).max(), *misses.max(axis=0)
    return [
        *(f"{width:g}", f"{n}", f"{growth:g}", f"{100 * confidence:g} %"),
        *(f"{100 * value:.1f} %" for value in worst),
        *(f"{min(ratios):.2f} .. {max(ratios):.2f}" if ratios else "" for ratios in costs.values()),
        f"{100 * min(bias):+.1f} .. {100 * max(bias):+.1f} %",
    ]


def main() -> None:
    """Print the table."""
    columns = ", ".join(HEAD).split(", ")
    print("| " + " | ".join(columns) + " |\n" + "|---" * len(columns) + "|")
    for growth, confidence in RULES:
        for width, n in PLANS:
            print("| " + " | ".join(row(width, n, growth, confidence)) + " |", flush=True)


if __name__ == "__main__":
    main()
