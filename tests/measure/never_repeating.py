"""``python -m tests.measure.never_repeating``: joints that never repeat, watched longer.

Stationary joints at 15 deg, 3000 rpm and 100 N m go on for a thousand revolutions: how many of the largest loads of
each hundred lie in the intervals that 48 revolutions gave. Ten chaotic ones are integrated by scipy's RK45 (rtol 1e-6)
beside a neighbour: exponent, and largest loads of one revolution after the other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.integrate
import scipy.stats
from numpy.typing import NDArray

from tests.support.environment import ROOT
from tolstat import joint, sampling, study
from tolstat.common import tables
from tolstat.common.load_kinds import SPAN
from tolstat.common.tables import RESULT, Options, Status
from tolstat.solver import refinement
from tolstat.solver.reference import first_order
from tolstat.solver.simulation import explicit_steps, simulate_rows, simulate_together

STUDY = ROOT / "studies" / "rigid_shafts.toml"
STARTED, LONG, DURATION = 100, 1100, 100
"""Revolutions left out, made, and in a group of which the largest load is asked for."""
REVOLUTIONS, APART = 120, 1e-8
"""Of scipy's integrator, the first quarter of which is left out; distance of the neighbour, m."""


class Exponent(NamedTuple):
    """Largest Lyapunov exponent per revolution, and largest |F| and |T| of one revolution after the other."""

    exponent: float
    largest: NDArray[np.float64]


def rattling(n: int) -> NDArray[np.void]:
    """Joints of the first study where the torque reverses, (n,) PARAM."""
    plan = study.load(STUDY, n=n)
    params = joint.perturb(plan.joint, plan.operation, sampling.draw(plan)[1:])
    params["alpha"][:, 0], params["omega"], params["torque"] = np.radians(15), 3000 * np.pi / 30, 100.0
    return params


def watch(params: NDArray[np.void], revolutions: int) -> tuple[NDArray[np.void], NDArray[np.void]]:
    """Results and statistics of all revolutions, with explicit steps."""
    options = refinement.settings(Options())._replace(max_revs=revolutions)
    results = np.zeros(len(params), RESULT).view(np.recarray)
    blocks = np.zeros((len(params), revolutions), RESULT).view(np.recarray)
    left = np.full(len(params), 2**62)
    list(simulate_together(params, options, left, False, results, blocks, explicit_steps(params, Options())))
    return results.view(np.ndarray), blocks.view(np.ndarray)


def repeated(result: np.void, blocks: NDArray[np.void]) -> NDArray[np.void]:
    """Statistics of all revolutions, those after a motion has begun to repeat from its last period."""
    made, period = int(result["revolutions"]), int(result["period"])
    if period:
        later = np.arange(made, len(blocks))
        blocks[made:] = blocks[made - period + (later - made) % period]
    return blocks[: len(blocks) if period else made]


def cover(params: NDArray[np.void], told: NDArray[np.void]) -> None:
    """Print which share of largest loads lies in the intervals told."""
    results, blocks = watch(params, LONG)
    hits, all_hits = [], []
    for i, own in enumerate(told):
        groups = repeated(results[i], blocks[i])[STARTED:].reshape(-1, DURATION)
        inside = []
        for load in ("F", "T"):
            ratio = groups[f"{load}_max"].max(axis=1) / own[f"{load}_max"]
            inside.append((own[f"{load}_lower"] <= ratio) & (ratio <= own[f"{load}_upper"]))
            worst = groups[f"{load}_max"].max(axis=(1, 2)) / own[f"{load}_max"].max()
            hits.append((own[f"{load}_lower"] <= worst) & (worst <= own[f"{load}_upper"]))
        all_hits.append(np.concatenate(inside, axis=1).mean())
        period = f", repeats from {results['revolutions'][i]:.0f}" if results["period"][i] else ""
        print(f"joint {i}: largest {np.mean(hits[-2:]):.2f}, each load {all_hits[-1]:.2f}{period}", flush=True)
    width = np.median(told["F_upper"] - told["F_lower"])
    print(f"{len(told)} joints, {LONG - STARTED} revolutions: {np.mean(hits):.3f} of the largest |F| and |T|, ", end="")
    print(f"{np.mean(all_hits):.3f} of the largest of each bushing; median width of F {width:.3f}")


def exponent(params: NDArray[np.void]) -> Exponent:
    """Integrate a joint and its neighbour as one system, so that both take the same steps."""
    system = first_order(params, Options(max_refinements=0), from_start=True)
    n = len(system.y0)
    turn = system.period / 180 * np.ones(n)
    turn[: n // 2] = 1.0
    y = np.concatenate([system.y0, system.y0 + APART / np.sqrt(n) / turn])
    t, growth, largest = system.t0, [], []

    def rate(t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.concatenate([system.rate(t, y[:n]), system.rate(t, y[n:])])

    for r in range(REVOLUTIONS):
        end = system.t0 + (r + 1) * system.period
        atol = 1e-6 * np.tile(system.scale, 2)
        found = scipy.integrate.solve_ivp(rate, (t, end), y, "RK45", rtol=1e-6, atol=atol)
        t, y = end, found.y[:, -1]
        peak = system.largest(found.t, found.y[:n].T)
        largest.append((peak[SPAN["F"]].max(), peak[SPAN["T"]].max()))
        apart = float(np.linalg.norm(turn * (y[n:] - y[:n])))
        growth.append(np.log(apart / APART))
        y[n:] = y[:n] + APART / apart * (y[n:] - y[:n])
    kept = slice(REVOLUTIONS // 4, None)
    return Exponent(float(np.mean(growth[kept])), np.array(largest[kept]))


def compare(params: NDArray[np.void]) -> None:
    """Print exponents and distributions beside those of scipy's integrator."""
    _, blocks = watch(params, REVOLUTIONS)
    print("exponent; largest |F| of a revolution, mean, spread and 90 % of ours over RK45's; p of")
    print("the test of Kolmogorov and Smirnov")
    for i in range(len(params)):
        true = exponent(params[i : i + 1])
        own = blocks[i, REVOLUTIONS // 4 :]["F_max"].max(axis=1)
        p = scipy.stats.ks_2samp(own, true.largest[:, 0]).pvalue
        ratios = [f(own) / f(true.largest[:, 0]) for f in (np.mean, np.std, lambda x: np.quantile(x, 0.9))]
        print(
            f"{true.exponent:.2f}; {ratios[0]:.3f} {ratios[1]:.2f} {ratios[2]:.3f}; {p:.2f}",
            flush=True,
        )


if __name__ == "__main__":
    tables.MOST_ITERATIONS = 10**9
    params = rattling(512)
    told = simulate_rows(params, Options()).results
    never = np.flatnonzero((told["status"] == Status.STATIONARY) & (told["period"] <= 1))
    print({s.label: int((told["status"] == s).sum()) for s in Status if (told["status"] == s).any()}, flush=True)
    compare(params[never[:10]])
    cover(params[never[:50]], told[never[:50]])
