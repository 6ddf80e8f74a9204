"""Gauss-Newton on a window: how far it steps, and when it stops."""

import numpy as np
import pytest
from rules import rules as ruled

from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.stereo.descent import descend
from flysim.stereo.views import prepare

LENS = Camera(width=80, height=48, fx=50.0, fy=50.0, cx=39.5, cy=23.5)
GAIN = 50.0 * 0.2
EVERY_ROW = np.int64(1)


def rules(**given):
    return ruled(**{"half": 3, "q_near": 2.5, "q_far": 0.1, **given})[0]


def waves(disparity_px, slope=0.0):
    """Grey waves some 40 px long, the right image so much further left, and by `slope` a column more to the right."""
    u, v = np.meshgrid(np.arange(80), np.arange(48))

    def grey(x):
        return 128 + 50 * np.sin(0.16 * x + 0.05 * v) + 40 * np.sin(0.11 * x - 0.12 * v + 1.0)

    right = (u + disparity_px - slope * 40.0) / (1.0 - slope)  # the left column that is seen there
    images = [np.repeat(grey(x)[..., None], 3, axis=2).round().astype(np.uint8) for x in (u, right)]
    return prepare(ImagePair(left=images[0], right=images[1], rig=StereoRig.parallel(LENS, 0.2)))


def step(views, px, steps=1, **given):
    """Disparity [px] after some steps from one on."""
    found = descend(views.record[0], rules(**given), 40, 24, px / GAIN, 0.0, 0.0, np.int64(steps), EVERY_ROW)
    return found[0] * GAIN, found[1] * GAIN, found[2] * GAIN


def test_it_comes_to_rest_where_the_images_match():
    for start in (7.0, 8.5, 10.0):
        assert step(waves(8.0), start, steps=8)[0] == pytest.approx(8.0, abs=0.03)


@pytest.mark.parametrize("off", [-4.0, 4.0])
def test_one_step_moves_the_window_by_a_pixel_and_a_half_at_most(off):
    found = step(waves(8.0), 8.0 + off)[0]
    assert abs(found - (8.0 + off)) == pytest.approx(1.5, abs=1e-6)
    near = step(waves(8.0), 8.0 + off / 4.0)[0]  # no step is cut short that is not too long
    assert near == pytest.approx(8.0, abs=0.15)


def test_a_step_of_less_than_a_fiftieth_of_a_pixel_is_the_last():
    last = going_on = 0
    for disparity in np.arange(7.6, 9.0, 0.11):
        views = waves(disparity)
        rest = step(views, disparity, steps=20)[0]
        for off in (0.018, 0.019, 0.0195, 0.02, 0.0205, 0.021, 0.022, -0.019, -0.02, -0.021):
            once, twice = step(views, rest + off)[0], step(views, rest + off, steps=2)[0]
            moved = abs(once - rest - off)
            if step(views, once)[0] == once:
                continue  # it is where nothing moves it
            assert (twice == once) == (moved < 0.02)
            last += 0.0185 < moved < 0.02
            going_on += 0.02 < moved < 0.0215
    assert last > 2 and going_on > 2


def test_slopes_move_where_flies_may_lean_alone():
    views = waves(8.0, slope=0.2)
    assert step(views, 8.0, steps=8)[1:] == (0.0, 0.0)
    leaning = step(views, 8.0, steps=8, steepest=1.0)
    assert leaning[1] == pytest.approx(0.2, abs=0.05)


@pytest.mark.parametrize(("limits", "moves"), [((7.0, 9.0), True), ((7.9, 9.0), False), ((7.0, 7.0), False)])
def test_no_step_leaves_the_depths_that_are_searched(limits, moves):
    far, near = limits
    # From 7 px of disparity to some 7.6 and on.
    start = 8.7 if far > 7.0 else 7.0
    found = step(waves(7.5), start, q_far=far / GAIN, q_near=near / GAIN)[0]
    assert (found != start) == moves


def test_where_nothing_is_to_be_seen_nothing_moves():
    grey = np.full((48, 80, 3), 90, np.uint8)
    views = prepare(ImagePair(left=grey, right=grey, rig=StereoRig.parallel(LENS, 0.2)))
    for steepest in (0.0, 1.0):
        assert step(views, 8.0, steps=3, steepest=steepest) == (8.0, 0.0, 0.0)
