"""The benchmark's scene: the same view in every size, and a truth that the images bear out."""

import math

import cv2
import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.rig import StereoRig
from flysim.studies.bench.scene import scenes, true_disparity


@pytest.fixture(scope="module")
def drawn():
    return scenes([(160, 120), (320, 180)])[0]


def test_true_disparity_by_hand():
    rig = StereoRig.parallel(Camera(width=10, height=1, fx=100.0, fy=100.0, cx=4.5, cy=0.0), 0.12)
    depth = np.array([[2, 2, 2, 2, 2, 2, 2, 4, math.inf, 0]], np.float32)
    nan = math.nan
    # 12 px m over 2 m are 6 px: from column 6 on the match lies in the right image.
    np.testing.assert_array_equal(true_disparity(rig, depth), [[nan, nan, nan, nan, nan, nan, 6, 3, nan, nan]])


def test_the_obstacle_is_as_wide_and_as_far_as_the_issue_asks(drawn):
    for scene in drawn:
        (box,) = scene.bodies
        assert box.name == "box"
        assert box.distance == pytest.approx(2.5, abs=0.01)
        assert box.width == pytest.approx(0.4, abs=0.03)
        assert (scene.link == box.link).sum() > 100


def test_the_sizes_show_the_same(drawn):
    small, wide = drawn
    assert (small.size, wide.size) == ((160, 120), (320, 180))
    # The middle row of the wide one is twice as fine; its depths are those of the other.
    fine, coarse = wide.depth[90], small.depth[60]
    both = (fine[::2] < 4.5) & (coarse < 4.5)
    assert np.median(np.abs(fine[::2] - coarse)[both]) < 0.05


def test_the_true_disparity_leads_from_one_image_to_the_other(drawn):
    scene = drawn[1]
    u, v = np.meshgrid(np.arange(320, dtype=np.float32), np.arange(180, dtype=np.float32))
    disparity = np.where(scene.seen, scene.disparity, 0).astype(np.float32)
    right = cv2.remap(scene.pair.right, u - disparity, v, cv2.INTER_LINEAR).astype(float)
    off = np.abs(scene.pair.left - right).mean(axis=2)[scene.seen]
    assert np.isfinite(scene.disparity[scene.seen]).all()
    assert np.median(off) < 3.0
    unmoved = np.abs(scene.pair.left.astype(float) - scene.pair.right).mean(axis=2)[scene.seen]
    assert np.median(unmoved) > 3 * np.median(off)
