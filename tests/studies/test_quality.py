"""Coverage and accuracy by hand arithmetic."""

import math

import numpy as np

from flysim.studies.bench import quality

DEPTHS = {"min_depth": 0.5, "max_depth": 4.0}


def test_a_cell_is_textured_by_what_varies_along_its_rows(made):
    left = np.concatenate(
        [
            made.stripes(16, 16, 4),  # deviates by 4
            made.stripes(16, 16, 3),  # by 3: not more than the limit
            made.stripes(16, 16, 40).swapaxes(0, 1),  # by nothing along its rows
            made.stripes(16, 16, 9),
        ],
        axis=1,
    )
    assert quality.textured_cells(made.scene(left, 2.0), **DEPTHS).tolist() == [[True, False, False, True]]


def test_a_cell_counts_where_most_of_it_is_seen_and_searched(made):
    seen = np.ones((16, 64), bool)
    seen[:, :8] = False  # half of the first cell is left
    seen[:, 16:25] = False  # less than half of the second
    depth = np.full((16, 64), 2.0)
    depth[:, 32:48] = 4.1
    depth[:, 48:] = 0.4
    textured = quality.textured_cells(made.scene(made.stripes(64, 16, 9), depth, seen), **DEPTHS)
    assert textured.tolist() == [[True, False, False, False]]


def test_coverage_is_the_share_of_textured_cells_with_a_fly(made):
    textured = np.array([[True, True, False], [True, True, False]])
    swarm = made.flies((0, 0, 6), (15.4, 15.4, 6), (16, 16, 6), (40, 0, 6), (20, 32, 6), (48, 3, 6))
    # Two in one cell, one in the cell below and beside it, one on plain ground, two in cells cut by the border.
    assert quality.coverage(textured, swarm) == 2 / 4
    # To the nearest pixel, each of these is in the last textured cell.
    every = np.array([[False, False, False], [False, True, False]])
    assert quality.coverage(every, made.flies((15.6, 15.6, 6))) == 1.0
    assert quality.coverage(every, made.flies((31.4, 30.6, 6))) == 1.0
    assert quality.coverage(textured, made.flies()) == 0.0
    assert math.isnan(quality.coverage(np.zeros((2, 3), bool), swarm))


def test_cells_cut_by_the_border_are_left_out(made):
    assert quality.textured_cells(made.scene(made.stripes(60, 40, 9), 2.0), **DEPTHS).shape == (2, 3)


def test_flies_within_counts_all_flies(made):
    depth = np.full((32, 64), 2.0)  # a disparity of 6 px
    depth[:, 60:] = math.inf
    scene = made.scene(made.stripes(64, 32, 9), depth)
    swarm = made.flies((20, 5, 6.4), (20, 6, 5.5), (21, 7, 6.9), (22, 8, 7.2), (62, 9, 6.0), (3, 9, 6.0))
    # The fifth is in the sky; what the sixth shows lies beside the right image.
    assert quality.flies_within(scene, swarm) == (2 / 6, 3 / 6)
    assert all(math.isnan(share) for share in quality.flies_within(scene, made.flies()))


def test_a_dense_matcher_is_asked_of_what_both_see(made):
    seen = np.ones((2, 20), bool)
    seen[:, :10] = False
    found = np.full((2, 20), 6.0, np.float32)
    found[:, :10] = 11.0  # wrong, where it is not asked
    found[0, 10:] = np.nan
    found[1, 10:15] = (6.4, 6.6, 5.1, 7.2, 6.0)
    scene = made.scene(made.stripes(20, 2, 9), 2.0, seen)
    assert quality.dense_within(scene, found) == (7 / 10, 9 / 10)
    assert quality.dense_density(scene, found) == 10 / 20
    assert all(math.isnan(share) for share in quality.dense_within(scene, np.full_like(found, np.nan)))


def test_flies_on_a_body_are_those_on_its_pixels_at_its_depth(made):
    link = np.zeros((32, 64), np.int32)
    link[:, 30:40] = 1
    scene = made.scene(made.stripes(64, 32, 9), 2.0, link=link)
    swarm = made.flies((30, 3, 6.0), (39, 4, 6.9), (35, 5, 7.2), (29, 6, 6.0), (40, 7, 6.0))
    assert quality.flies_on(scene, scene.bodies[0], swarm) == 2
