"""Coverage, cost and bias of campaigns with a stop rule, computed: ``python -m tests.measure.stop_rule``."""

from __future__ import annotations

import numpy as np

from tolstat.analysis import sequential

PLANS = ((0.1, 2000), (0.05, 5000), (0.02, 20_000), (0.01, 50_000), (0.002, 1_000_000))
SHARES = 80


def main() -> None:
    """Print the worst values over all shares up to one half that the campaign suffices for."""
    head = (
        "width, joints, a look, coverage, too high, too low, cost with 20 above, cost with 10 above, bias of count / n"
    )
    columns = head.split(", ")
    print("| " + " | ".join(columns) + " |\n" + "|---" * len(columns) + "|")
    for width, n in PLANS:
        scheme = sequential.scheme(width, sequential.looks(width, n))
        of_ends = [scheme.performance(float(p)) for p in scheme.critical_shares()]
        costs: dict[int, list[float]] = {10: [], 20: []}
        bias = []
        for p in np.geomspace(10.0 / n, 0.5, SHARES):
            fixed, found = sequential.fixed(float(p), width), scheme.performance(float(p))
            bias.append(found.plain)
            for least, ratios in costs.items():
                if p * fixed >= least and fixed < n:
                    ratios.append(found.joints / fixed)
        ends = [min(one.coverage for one in of_ends), *(max(getattr(one, k) for one in of_ends) for k in MISSES)]
        print(
            f"| {width:g} | {n} | {100 * scheme.confidence:.2f} % | "
            + " | ".join(f"{100 * value:.1f} %" for value in ends)
            + f" | {max(costs[20]):.2f} | {max(costs[10]):.2f} | {100 * min(bias):+.1f} .. {100 * max(bias):+.1f} % |"
        )


MISSES = ("too_high", "too_low")

if __name__ == "__main__":
    main()
