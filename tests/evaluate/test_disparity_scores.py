"""Shares, D1, coverage and hidden pixels by hand arithmetic."""

import numpy as np
import pytest

from flysim.evaluate.disparity_scores import (
    DisparityTruth,
    coverage,
    not_hidden,
    score_map,
    score_points,
    textured_cells,
)

TRUE = np.full((32, 48), 20.0, np.float32)


def test_shares_are_of_those_whose_truth_is_known():
    disparity = TRUE.copy()
    disparity[0, 0] = np.nan
    truth = DisparityTruth.of(disparity, np.ones(TRUE.shape, bool))
    uv = np.array([[0, 0], [10, 5], [11, 5], [12, 5], [13, 5]])
    seen, everywhere = score_points(uv, np.array([20.0, 20.4, 20.9, 21.8, 24.0]), truth, 100.0, 0.0)
    assert seen == everywhere
    assert (seen.count, seen.within_0_5px, seen.within_1px, seen.within_2px, seen.within_3px) == (
        4,
        0.25,
        0.5,
        0.75,
        0.75,
    )
    assert seen.d1 == 0.25  # 4 px of 20: more than 3 px and 5 %
    assert seen.median_px == pytest.approx((0.9 + 1.8) / 2.0)
    assert seen.median_m == pytest.approx((5.0 - 100.0 / 20.9 + 5.0 - 100.0 / 21.8) / 2.0)


def test_an_error_of_three_pixels_is_none_to_d1_where_it_is_less_than_five_percent():
    truth = DisparityTruth.of(np.full((32, 48), 100.0, np.float32), np.ones((32, 48), bool))
    seen, _ = score_points(np.array([[5, 5]]), np.array([104.0]), truth, 0.0, 0.0)
    assert seen.d1 == 0.0 and seen.within_3px == 0.0 and seen.median_m is None


def test_hidden_pixels_are_not_among_the_seen_ones():
    disparity = np.full((8, 100), 10.0, np.float32)
    disparity[:, 40:60] = 25.0  # stands before it: hides 15 px to its left in the right picture
    seen = not_hidden(disparity)
    assert not seen[:, :10].any()  # beyond the right picture's edge
    assert not seen[:, 26:39].any()
    assert seen[:, 40:].all() and seen[:, 11:24].all()
    truth = DisparityTruth.of(disparity)
    both, everywhere = score_points(np.array([[30, 4], [50, 4]]), np.array([25.0, 25.0]), truth, 0.0, 0.0)
    assert (both.count, both.within_1px) == (1, 1.0)
    assert (everywhere.count, everywhere.within_1px) == (2, 0.5)


def test_a_dense_map_is_judged_where_it_gives_something():
    truth = DisparityTruth.of(TRUE, np.ones(TRUE.shape, bool))
    found = TRUE + 0.3
    found[:16] = np.nan
    seen, _, density = score_map(found, truth, 0.0, 0.0)
    assert (seen.within_0_5px, density) == (1.0, 0.5)


def test_coverage_is_the_share_of_textured_cells():
    left = np.full((32, 48, 3), 100, np.uint8)
    left[:16, :32] = np.random.default_rng(0).integers(0, 255, (16, 32, 1))
    cells = textured_cells(left)
    assert cells.tolist() == [[True, True, False], [False, False, False]]
    assert coverage(cells, np.array([[3, 3], [5, 5], [40, 20]])) == 0.5
    assert coverage(np.zeros((2, 3), bool), np.array([[3, 3]])) is None
