import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from flysim.common.statistics import front, mean_ci95, pooled_share_ci95, rank_correlation, share_ci95


def test_mean_and_interval_by_hand():
    # 1, 2, 3: mean 2, standard deviation 1, t(0.975, 2 degrees of freedom) = 4.3027 from any printed table.
    mean, half = mean_ci95([1, 2, 3])
    assert mean == 2.0
    assert half == pytest.approx(4.3027 / math.sqrt(3), rel=1e-4)
    # 20 values: 19 degrees of freedom, t = 2.0930; ten of 0 and ten of 2 deviate by sqrt(20 / 19).
    mean, half = mean_ci95([0, 2] * 10)
    assert mean == 1.0
    assert half == pytest.approx(2.0930 * math.sqrt(20 / 19) / math.sqrt(20), rel=1e-4)


def test_one_value_has_no_interval_and_equal_ones_an_empty_one():
    assert mean_ci95([7.5]) == (7.5, None)
    assert mean_ci95([3, 3, 3]) == (3.0, 0.0)


@given(st.integers(1, 200), st.data())
def test_the_interval_of_a_share_is_wilson_s(n, data):
    hits = data.draw(st.integers(0, n))
    book = stats.binomtest(hits, n).proportion_ci(0.95, method="wilson")
    assert share_ci95(hits / n, n) == pytest.approx((book.low, book.high), abs=1e-9)


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
def test_the_interval_of_values_between_0_and_1_stays_there_and_holds_their_mean(values):
    mean = float(np.mean(values))
    low, high = share_ci95(mean, len(values))
    assert 0.0 <= low <= mean <= high <= 1.0
    assert low < high


def test_the_interval_of_scores_with_rare_failures_holds_the_true_mean():
    rng, n = np.random.default_rng(0), 10
    # As SPL: 0 where an episode fails, 0.95 in the mean where it does not.
    values = (rng.random((2000, n)) < 0.94) * rng.beta(38.0, 2.0, (2000, n))
    means, true = values.mean(axis=1), 0.94 * 0.95
    held = np.mean([low <= true <= high for low, high in (share_ci95(float(mean), n) for mean in means)])
    assert held > 0.95
    half = stats.t.ppf(0.975, n - 1) * values.std(axis=1, ddof=1) / math.sqrt(n)
    assert np.mean(np.abs(means - true) <= half) < 0.6  # what Student's t holds


def test_rank_correlation_by_hand():
    assert rank_correlation([1, 2, 3], [10, 200, 3000]) == pytest.approx(1.0)
    assert rank_correlation([1, 2, 100], [3, 5, 6]) == pytest.approx(1.0)  # a rank counts, not how far it leads
    assert rank_correlation([1, 2, 3], [9, 4, 1]) == pytest.approx(-1.0)
    # Ranks 1 2 3 4 and 2 1 4 3: 1 - 6 * 4 / (4 * 15) = 0.6.
    assert rank_correlation([1, 2, 3, 4], [20, 10, 40, 30]) == pytest.approx(0.6)
    # A tie takes the mean rank: 1.5 1.5 3 with 1 2 3 is sqrt(3) / 2.
    assert rank_correlation([5, 5, 6], [1, 2, 3]) == pytest.approx(math.sqrt(3) / 2)


@pytest.mark.parametrize(("a", "b"), [([1], [2]), ([4, 4, 4], [1, 2, 3]), ([1, 2, 3], [4, 4, 4])])
def test_without_an_order_there_is_no_correlation(a, b):
    assert rank_correlation(a, b) is None


def test_a_front_by_hand():
    #       free and useless, dear and good, dearer and worse, cheap and middling, the same again
    assert front([1, 5, 6, 2, 2], [0, 9, 8, 4, 4]) == (0, 3, 4, 1)
    assert front([], []) == ()


@given(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), max_size=30))
def test_nothing_on_the_front_is_beaten_and_all_else_is(points):
    def beats(a, b):
        return a[0] <= b[0] and a[1] >= b[1] and a != b

    found = front([cost for cost, _ in points], [quality for _, quality in points])
    assert len(set(found)) == len(found)
    for i, point in enumerate(points):
        assert (i in found) == (not any(beats(other, point) for other in points))
        assert i in found or any(beats(points[k], point) for k in found)
    assert [points[i][0] for i in found] == sorted(points[i][0] for i in found)


def test_a_pooled_share_of_runs_that_are_alike_is_wilson_s_of_all_parts():
    assert pooled_share_ci95([8.0] * 5, [10.0] * 5) == pytest.approx(share_ci95(0.8, 50))
    assert pooled_share_ci95([10.0] * 5, [10.0] * 5) == pytest.approx(share_ci95(1.0, 50))
    assert pooled_share_ci95([], []) is None and pooled_share_ci95([0.0], [0.0]) is None


def test_a_pooled_share_of_runs_whose_parts_hang_together_is_that_of_the_runs():
    # Eight runs all right, two all wrong: the parts say no more than ten tosses do, 9 by Bessel; and that from ten runs
    # alone, t(0.975, 9 degrees of freedom) = 2.2622 for 1.95996.
    runs = [10.0] * 8 + [0.0] * 2
    few = share_ci95(0.8, 9.0 * (1.95996 / 2.2622) ** 2)
    assert pooled_share_ci95(runs, [10.0] * 10) == pytest.approx(few, rel=1e-4)


def test_a_pooled_interval_holds_its_share_in_nine_of_ten_samples_of_bad_runs():
    rng, held = np.random.default_rng(0), 0
    for _ in range(400):
        chance = np.where(rng.random(24) < 0.9, 1.0, 0.5)  # a run in ten is a bad one
        hits = rng.binomial(8, chance).astype(float)
        low, high = pooled_share_ci95(hits, [8.0] * 24)
        held += low <= 0.95 <= high
    assert held / 400 >= 0.9  # whole runs drawn again: 0.85
