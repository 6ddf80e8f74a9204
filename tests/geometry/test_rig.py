import math

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6, rotation_rpy, se3
from flysim.geometry.rig import ImagePair, StereoRig

CAMERA = Camera(width=64, height=48, fx=500.0, fy=500.0, cx=31.5, cy=23.5)


def camera(**change):
    return Camera(**{"width": 64, "height": 48, "fx": 500.0, "fy": 500.0, "cx": 31.5, "cy": 23.5, **change})


def test_disparity_by_hand():
    # 500 px * 0.12 m / 2 m = 30 px, to the left in the right image.
    left, right = StereoRig.parallel(CAMERA, 0.12).project(np.array([[0.0, 0.0, 2.0]]))
    np.testing.assert_allclose(left, [[31.5, 23.5]])
    np.testing.assert_allclose(right, [[1.5, 23.5]])


def test_the_right_camera_sees_through_its_own_lens_and_pose():
    # Turned a quarter to the right round its y axis, 1 m ahead of the left one: left's right is its forward.
    T = se3(rotation_rpy(0.0, -math.pi / 2, 0.0), (1.0, 0.0, 0.0))
    rig = StereoRig(left=CAMERA, right=camera(fx=100.0, cx=10.0), T_right_left=T)
    p_right = np.array([-2.0 + 1.0, 0.5, 3.0])  # of (3, 0.5, 2): x' = 1 - z, y' = y, z' = x
    _, uv = rig.project(np.array([[3.0, 0.5, 2.0]]))
    np.testing.assert_allclose(uv, [[100 * p_right[0] / 3 + 10, 500 * 0.5 / 3 + 23.5]])


def test_the_baseline_is_the_distance_between_the_centres():
    rig = StereoRig(left=CAMERA, right=CAMERA, T_right_left=pose6(0.3, 0.0, -0.4, 0.1, 0.2, 0.3))
    assert rig.baseline == pytest.approx(0.5)


def test_a_smaller_pair_sees_what_the_larger_one_sees():
    rig = StereoRig(left=camera(cx=30.0), right=camera(fx=480.0), T_right_left=se3(np.eye(3), (-0.12, 0.01, 0.0)))
    points = np.array([[0.1, -0.2, 2.0], [-0.3, 0.1, 1.0]])
    small = rig.resized(16, 12)
    assert small.baseline == rig.baseline
    for uv, large in zip(small.project(points), rig.project(points), strict=True):
        # A pixel's centre is at an integer, so images are scaled about half a pixel beyond their first one.
        np.testing.assert_allclose(uv + 0.5, (large + 0.5) / 4.0, atol=1e-9)
    stretched = rig.resized(16, 24, stretched=True)
    for uv, large in zip(stretched.project(points), rig.project(points), strict=True):
        np.testing.assert_allclose(uv + 0.5, (large + 0.5) / (4.0, 2.0), atol=1e-9)


@pytest.mark.parametrize(
    ("right", "T", "rectified"),
    [
        (CAMERA, se3(np.eye(3), (-0.12, 0, 0)), True),
        (camera(cx=40.0), se3(np.eye(3), (-0.12, 0, 0)), True),  # another cx shifts along the rows only
        (camera(cy=24.0), se3(np.eye(3), (-0.12, 0, 0)), False),
        (camera(fx=501.0), se3(np.eye(3), (-0.12, 0, 0)), False),
        (camera(fy=501.0), se3(np.eye(3), (-0.12, 0, 0)), False),
        (CAMERA, se3(np.eye(3), (-0.12, 0.001, 0)), False),
        (CAMERA, se3(np.eye(3), (-0.12, 0, 0.001)), False),
        (CAMERA, pose6(-0.12, 0, 0, 0, 0, 1e-4), False),
        (CAMERA, pose6(-0.12, 0, 0, 1e-4, 0, 0), False),
    ],
)
def test_rectified_means_that_rows_meet_rows(right, T, rectified):
    assert StereoRig(left=CAMERA, right=right, T_right_left=T).rectified is rectified


@pytest.mark.parametrize(
    ("T", "says"),
    [
        (np.eye(4), "baseline must be > 0 m, got 0"),
        (se3(np.eye(3), (math.nan, 0, 0)), "finite 4x4"),
        (np.eye(3), "finite 4x4"),
        (se3(2.0 * np.eye(3), (-0.12, 0, 0)), "must hold a rotation"),
        (se3([[1, 0.01, 0], [0, 1, 0], [0, 0, 1]], (-0.12, 0, 0)), "must hold a rotation"),
        (se3(np.diag([1.0, 1.0, -1.0]), (-0.12, 0, 0)), "must hold a rotation"),  # a mirror
        (np.vstack([se3(np.eye(3), (-0.12, 0, 0))[:3], [0, 0, 0, 2]]), "last row"),
    ],
)
def test_a_rig_that_cannot_be_is_refused(T, says):
    with pytest.raises(ValueError, match=says):
        StereoRig(left=CAMERA, right=CAMERA, T_right_left=T)


def test_a_parallel_rig_needs_a_baseline():
    with pytest.raises(ValueError, match="baseline must be > 0 m"):
        StereoRig.parallel(CAMERA, 0.0)


GOOD = np.zeros((48, 64, 3), np.uint8)


@pytest.mark.parametrize(
    ("image", "says"),
    [
        (GOOD.astype(np.uint16), r"must be \[H, W, 3\] uint8 RGB, got \(48, 64, 3\) uint16"),
        (GOOD.astype(np.float32), "float32"),
        (GOOD[..., 0], r"got \(48, 64\) uint8"),
        (np.zeros((48, 64, 4), np.uint8), r"got \(48, 64, 4\)"),
        (GOOD[:, :-1], "63x48 px, its camera 64x48"),
        (np.zeros((64, 48, 3), np.uint8), "48x64 px, its camera 64x48"),
    ],
)
@pytest.mark.parametrize("side", ["left", "right"])
def test_an_image_that_is_not_its_cameras_is_refused(side, image, says):
    images = {"left": GOOD, "right": GOOD, side: image}
    with pytest.raises(ValueError, match=f"the {side} image .*{says}"):
        ImagePair(**images, rig=StereoRig.parallel(CAMERA, 0.12))


def test_a_pair_keeps_its_own_read_only_images():
    mine = GOOD.copy()
    pair = ImagePair(left=mine, right=GOOD, rig=StereoRig.parallel(CAMERA, 0.12))
    mine[:] = 9
    assert pair.left.max() == 0
    with pytest.raises(ValueError, match="read-only"):
        pair.right[0, 0] = 1
