"""How well a pair tells depth at a pixel."""

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.stereo.told import COARSEST, SLOW, coarser, speeds, trust
from flysim.stereo.views import prepare
from flysim.stereo.windows import parallax, warp

CAMERA = Camera(width=200, height=150, fx=180.0, fy=180.0, cx=99.5, cy=74.5)
AHEAD = StereoRig(left=CAMERA, right=CAMERA, T_right_left=pose6(0.0, 0.0, 0.3, 0.0, 0.0, 0.0))
TURNED = StereoRig(left=CAMERA, right=CAMERA, T_right_left=pose6(-0.3, 0.0, 0.1, 0.0, -0.3, 0.0))
LEVEL = StereoRig.parallel(CAMERA, 0.3)


def views(rig, **how):
    image = np.zeros((150, 200, 3), np.uint8)
    return prepare(ImagePair(left=image, right=image, rig=rig), **how).record[0]


@pytest.mark.parametrize("rig", [AHEAD, TURNED, LEVEL])
def test_speeds_are_how_far_a_right_pixel_moves_for_a_step_in_inverse_depth(rig):
    pixels, q = np.array([[30.0, 20.0], [150.0, 70.0], [110.0, 130.0]]), np.array([0.4, 0.9, 1.5])
    step = 1e-5
    at = [rig.project(CAMERA.unproject(pixels, 1.0 / (q + way * step)))[1] for way in (-1, 1)]
    moved = np.linalg.norm(at[1] - at[0], axis=1) / (2.0 * step)
    np.testing.assert_allclose(speeds(rig, pixels, q), moved, rtol=1e-5)
    kernels = [parallax(views(rig), *pixel, depth)[2] for pixel, depth in zip(pixels, q, strict=True)]
    np.testing.assert_allclose(kernels, moved, rtol=1e-5)


def test_side_by_side_every_pixel_is_trusted_and_steps_are_the_same():
    for how in ({}, {"fast": False}):
        level = views(LEVEL, **how)
        for u, v, q in ((20, 20, 0.5), (150, 100, 1.5)):
            assert trust(level, warp(level, u, v, q, 0.0, 0.0)) == 1.0
            assert coarser(level, u, v, q) == pytest.approx(1.0)


def test_ahead_trust_grows_with_the_angle_to_the_epipole():
    ahead = views(AHEAD)
    # The right pixel r px from the epipole moves at r / fx of what it would side by side.
    for right, expected in ((0.0, 0.0), (0.5, 0.25), (1.0, 1.0), (3.0, 1.0)):
        q, off = 0.5, right * SLOW * CAMERA.fx * (1.0 + 0.3 * 0.5)
        w = warp(ahead, CAMERA.cx + off, CAMERA.cy, q, 0.0, 0.0)
        assert trust(ahead, w) == pytest.approx(expected, abs=1e-9)


def test_steps_are_coarser_where_things_move_less_but_not_without_end():
    ahead = views(AHEAD)
    assert coarser(ahead, CAMERA.cx, CAMERA.cy, 0.5) == COARSEST
    assert coarser(ahead, CAMERA.cx + 90.0, CAMERA.cy, 1e-9) == pytest.approx(2.0)
