"""Rare loads and causes: OpenTURNS' subset simulation and rank-based Sobol' indices."""

import numpy as np
import pytest
from scipy import stats

from tolstat.analysis import sensitivity
from tolstat.analysis.subset import Walk

ot = pytest.importorskip("openturns", reason="pip install .[oracles]")
ot.Log.Show(ot.Log.NONE)


def noise_of(seed, d):
    streams = [np.random.default_rng([seed, level]) for level in range(12)]
    return lambda level, first, m: streams[level].standard_normal((m, d))


@pytest.mark.slow
def test_subset_simulation_of_a_plane():
    """Ten normal errors, a plane at four standard deviations, P = 3.2e-5, 1000 joints a level, 200 seeds.

    Both estimates are unbiased, with the same coefficient of variation. OpenTURNS' interval, symmetric about the
    probability, misses in 9 % on one side, too low, and never on the other; ours, on the logarithm, in 3 % on either.
    """
    d, n, beta, seeds = 10, 1000, 4.0, 200
    truth, weight = stats.norm.sf(beta), float(1 / np.sqrt(d))
    names = [f"x{i}" for i in range(d)]
    plane = ot.SymbolicFunction(names, [f"{weight!r} * ({' + '.join(names)})"])
    load = ot.CompositeRandomVector(plane, ot.RandomVector(ot.Normal(d)))
    found, theirs = np.empty((2, 3, seeds))
    for seed in range(seeds):
        ot.RandomGenerator.SetSeed(seed)
        simulation = ot.SubsetSampling(ot.ThresholdEvent(load, ot.Greater(), beta))
        simulation.setConditionalProbability(0.1)
        simulation.setBlockSize(100)
        simulation.setMaximumOuterSampling(n // 100)
        simulation.run()
        result = simulation.getResult()
        p, length = result.getProbabilityEstimate(), result.getConfidenceLength(0.95)
        theirs[:, seed] = p, p - 0.5 * length, p + 0.5 * length
        walk = Walk(n, 0.1, beta, noise_of(seed, d))
        while not walk.done:
            walk.take(weight * walk.next.scores.sum(axis=1))
        found[:, seed] = walk.estimate()[:3]
    error = 0.36 / np.sqrt(seeds)
    for p, _, _ in (found, theirs):
        assert p.mean() / truth == pytest.approx(1.0, abs=3 * error)
        assert p.std() / truth == pytest.approx(0.34, abs=0.06)
    side = 0.025 + 3 * np.sqrt(0.025 * 0.975 / seeds)
    assert max(np.mean(found[1] > truth), np.mean(found[2] < truth)) < side
    assert np.mean(theirs[2] < truth) > side
    assert not (theirs[1] > truth).any()


@pytest.mark.slow
def test_rank_based_indices():
    """First-order indices of a linear load of 200 joints, 100 samples: OpenTURNS' ranks cover 53 to 98 %, ours 99 %.

    The estimate joins the first to the last of the sorted joints, a bias of -0.06 for the largest index, and its
    intervals are those of subsamples of 80 %, not scaled to the whole: two thirds as wide as it should be there.
    """
    rng, seeds, slopes = np.random.default_rng(2), 100, np.array([0.7, 0.5, -0.3, 0.0])
    truth, estimates, covered, widths = slopes**2 / (slopes**2).sum(), [], [], []
    for seed in range(seeds):
        x = rng.standard_normal((200, 4))
        ot.RandomGenerator.SetSeed(seed)
        ranks = ot.RankSobolSensitivityAlgorithm(ot.Sample(x), ot.Sample((x @ slopes)[:, None]))
        ranks.setBootstrapSize(100)
        interval = ranks.getFirstOrderIndicesInterval()
        lower, upper = np.array(interval.getLowerBound()), np.array(interval.getUpperBound())
        found = sensitivity.first_order(x, x @ slopes)
        covered.append([(found.lower <= truth) & (truth <= found.upper), (lower <= truth) & (truth <= upper)])
        estimates.append([found.estimate, ranks.getFirstOrderIndices()])
        widths.append(upper - lower)
    ours_covered, theirs_covered = np.mean(covered, axis=0)
    bias, scatter = np.mean(estimates, axis=0) - truth, np.std(estimates, axis=0)
    assert ours_covered.min() > 0.93
    assert theirs_covered[:2].max() < 0.9
    assert theirs_covered[0] < 0.7
    assert np.abs(bias[0]).max() < 0.015
    assert bias[1, 0] < -0.04
    assert 0.55 < np.mean(widths, axis=0)[0] / (2 * 1.96 * scatter[1, 0]) < 0.75
