import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flysim.flies.regions import equal_quotas, rectangles, split, steered_quotas


@given(st.integers(4, 3000), st.integers(4, 3000), st.sampled_from([1, 2, 4, (1, 3), (3, 2), (4, 4)]))
def test_regions_tile_the_image(width, height, regions):
    count = np.zeros((2, 2), int)
    rects = rectangles(width, height, regions)
    assert len(rects) == (regions if isinstance(regions, int) else regions[0] * regions[1])
    for u0, u1, v0, v1 in rects:
        assert u0 < u1 and v0 < v1
        count += np.array([[u0 <= u < u1 and v0 <= v < v1 for u in (0, width - 1)] for v in (0, height - 1)])
    assert (count == 1).all()  # each corner of the image is in one region
    assert sum((u1 - u0) * (v1 - v0) for u0, u1, v0, v1 in rects) == width * height


def test_two_regions_lie_side_by_side_and_four_are_quadrants():
    assert rectangles(640, 480, 2).tolist() == [[0, 320, 0, 480], [320, 640, 0, 480]]
    assert rectangles(640, 480, 4).tolist() == [
        [0, 320, 0, 240],
        [320, 640, 0, 240],
        [0, 320, 240, 480],
        [320, 640, 240, 480],
    ]


@given(st.integers(0, 10**6), st.lists(st.floats(0.0, 1e3), min_size=1, max_size=12).filter(lambda w: sum(w) > 1e-3))
def test_a_split_sums_exactly_and_errs_by_less_than_one(total, weights):
    counts = split(total, np.array(weights))
    assert counts.sum() == total
    exact = total * np.array(weights) / np.sum(weights)
    assert (np.abs(counts - exact) < 1.0 + 1e-6).all()


def test_a_split_by_hand():
    assert split(10, np.array([0.4, 0.1, 0.4, 0.1])).tolist() == [4, 1, 4, 1]
    assert split(11, np.array([0.5, 0.25, 0.25])).tolist() == [5, 3, 3]  # 5.5, 2.75, 2.75


@given(st.integers(10, 10**5), st.sampled_from([1, 2, 4]))
def test_the_population_starts_equally_divided(population, regions):
    quotas = equal_quotas(population, regions)
    assert quotas.sum() == population
    assert quotas.max() - quotas.min() <= 1


def image(*levels):
    """Four quadrants, each half black and half as bright as asked: its standard deviation is half that."""
    out = np.zeros((40, 60, 3), np.uint8)
    for (u0, u1, v0, v1), level in zip(rectangles(60, 40, 4), levels, strict=True):
        out[v0 : (v0 + v1) // 2, u0:u1] = level
    return out


def test_a_region_gets_half_an_equal_share_and_the_rest_by_its_standard_deviation():
    # 1000 flies: 125 each; the other 500 as 100 : 0 : 60 : 40.
    quotas = steered_quotas(1000, image(200, 0, 120, 80)[..., 0], rectangles(60, 40, 4))
    assert quotas.tolist() == [125 + 250, 125, 125 + 150, 125 + 100]


@given(st.lists(st.integers(0, 255), min_size=4, max_size=4), st.integers(100, 10_000))
def test_more_contrast_never_means_fewer_flies(levels, population):
    quotas = steered_quotas(population, image(*levels)[..., 0], rectangles(60, 40, 4))
    assert quotas.sum() == population
    assert (quotas >= population / 8 - 1).all()
    order = np.argsort(levels, kind="stable")
    assert (np.diff(quotas[order]) >= -1).all()


def test_an_image_without_contrast_is_shared_equally():
    assert steered_quotas(1000, np.full((40, 60), 90, np.uint8), rectangles(60, 40, 4)).tolist() == [250] * 4


def test_flies_follow_the_contrast_after_the_first_generation(stage):
    pair = stage.photograph(stage.RIG, [stage.Plane((0.0, 0.0, 1.0), 1.5)])
    dull = pair.left.copy()
    dull[75:] = 128 + (dull[75:].astype(int) - 128) // 8
    pair = type(pair)(left=dull, right=pair.right, rig=pair.rig)
    history = stage.run(pair, population=1000, max_iterations=4, stop=1.0, prefilter="none").history
    assert history[0].regions == (250, 250, 250, 250)
    expected = tuple(steered_quotas(1000, cv2.cvtColor(dull, cv2.COLOR_RGB2GRAY), rectangles(200, 150, 4)).tolist())
    assert [generation.regions for generation in history[1:]] == [expected] * 3
    assert min(expected[:2]) > 1.5 * max(expected[2:])
    # Of derivatives as well, which have no brightness.
    derived = stage.run(pair, population=1000, max_iterations=4, stop=1.0).history[-1].regions
    assert min(derived[:2]) > 1.5 * max(derived[2:])


@pytest.mark.parametrize("regions", [1, 2, 4, (2, 3)])
def test_every_generation_holds_the_whole_population(stage, facing, regions):
    swarm = stage.run(facing.pair, population=1003, regions=regions, max_iterations=6, stop=1.0)
    assert len(swarm.history) == swarm.iterations == 6
    for generation in swarm.history:
        assert len(generation.regions) == (6 if regions == (2, 3) else regions)
        assert sum(generation.regions) == 1003
