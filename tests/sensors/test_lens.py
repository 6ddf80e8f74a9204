"""What a lens does to light, by hand: falloff, blur, smear, distortion, rows that come late."""

import math

import cv2
import numpy as np
import pytest

from flysim.errors import FlysimError
from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair
from flysim.sensors.cameras import Cameras
from flysim.sensors.distortion import distorted, margin, rays, turned
from flysim.sensors.optics import smear
from flysim.sensors.parameters import SensorParams

WIDE = Camera(width=640, height=480, fx=502.3, fy=502.3, cx=319.5, cy=239.5)  # the rover's


def test_a_corner_loses_its_share_and_the_middle_none(taken):
    for image in taken(200, vignetting=0.3):
        assert (image[30, 40] == 200).all()
        assert all((image[v, u] == 140).all() for v in (0, 60) for u in (0, 80))
        # Half way to the corner a quarter of the loss: 1 - 0.3 / 4.
        assert (image[15, 20] == 185).all()


def test_the_right_eye_alone_falls_off_from_left_to_right(taken):
    left, right = taken(200, uneven_right=0.5)
    assert (left == 200).all()
    assert (right[:, 0] == 200).all() and (right[:, 80] == 100).all()
    assert (right[:, 40] == 150).all()


@pytest.mark.parametrize("sigma", [1.0, 2.5])
def test_the_blur_of_an_edge_has_the_sigma_that_was_asked_for(taken, sigma):
    edge = np.full((61, 81, 3), 20, np.uint8)
    edge[:, 40:] = 220
    left, right = taken(edge, defocus_right=sigma)
    np.testing.assert_array_equal(left, edge)
    spread = np.diff(right[30, :, 0].astype(float))  # an edge's derivative is the blur itself
    places = np.arange(80) + 0.5
    middle = (spread * places).sum() / spread.sum()
    assert middle == pytest.approx(39.5, abs=0.05)
    assert math.sqrt((spread * (places - middle) ** 2).sum() / spread.sum()) == pytest.approx(sigma, rel=0.05)


def test_motion_smears_a_point_along_its_row(taken):
    point = np.zeros((61, 81, 3), np.uint8)
    point[30, 40] = 250
    for image in taken(point, motion_px=5.0):
        np.testing.assert_array_equal(np.flatnonzero(image[30, :, 0]), range(38, 43))
        assert (image[30, 38:43] == 50).all()
        assert image.sum() == 5 * 3 * 50


def test_a_smear_may_end_within_a_pixel():
    assert smear(1.0) is None
    np.testing.assert_allclose(smear(2.0), [[0.25, 0.5, 0.25]])
    np.testing.assert_allclose(smear(3.0), [[1 / 3, 1 / 3, 1 / 3]], rtol=1e-6)
    assert smear(7.3).sum() == pytest.approx(1.0)


@pytest.mark.parametrize("lens", [{"k1": -0.18}, {"k1": 0.2, "k2": -0.05}, {"k1": -0.1, "p1": 0.01, "p2": -0.02}])
def test_a_lens_puts_a_ray_where_opencv_puts_it(lens):
    params = SensorParams(**lens)
    x, y = rays(WIDE, params)
    some = np.stack([x[::60, ::80], y[::60, ::80], np.ones((8, 8))], axis=-1).reshape(-1, 3)
    coefficients = np.array([params.k1, params.k2, params.p1, params.p2])
    uv, _ = cv2.projectPoints(some, np.zeros(3), np.zeros(3), WIDE.K, coefficients)
    v, u = np.mgrid[0:480:60, 0:640:80]
    np.testing.assert_allclose(uv[:, 0], np.stack([u.ravel(), v.ravel()], axis=1), atol=0.01)
    np.testing.assert_allclose(distorted(x, y, params)[0], (np.arange(640) - 319.5)[None] / 502.3 + 0 * x, atol=1e-4)


def test_a_distorted_image_shows_a_line_where_the_lens_puts_it_and_has_no_border(rig):
    params = SensorParams(k1=-0.2)
    cameras = Cameras(rig, params)
    drawn = cameras.drawn.left
    assert (drawn.width, drawn.height) > (81, 61) and drawn.fx == 70.0
    assert cameras.true is rig and cameras.believed is rig
    # A vertical line at x / z = 0.4 in a world of one level, drawn by the pinhole with its margin.
    image = np.full((drawn.height, drawn.width, 3), 100, np.uint8)
    column = 0.4 * 70.0 + drawn.cx
    image[:, round(column)] = 255
    taken = cameras.take(ImagePair(left=image, right=image, rig=cameras.drawn), 0).left
    assert taken.min() > 80  # a cubic's undershoot beside the line, and no black
    for row in (0, 30, 60):
        y = rays(rig.left, params)[1][row]
        x = rays(rig.left, params)[0][row]
        at = np.argmin(np.abs(x - 0.4))
        expected = distorted(np.array(0.4), y[at], params)[0] * 70.0 + 40.0
        bright = taken[row, :, 0].astype(float) - 100
        bright[bright < 20] = 0
        assert (bright * np.arange(81)).sum() / bright.sum() == pytest.approx(expected, abs=0.15)


def test_both_eyes_are_drawn_with_one_margin(rig):
    more = margin(rig.left, SensorParams(k1=-0.2, p1=0.02))
    assert min(more.left, more.right, more.top, more.bottom) > 0 and more.top != more.bottom
    assert margin(rig.left, SensorParams(noise=5.0)) == margin(rig.left, SensorParams())
    params = SensorParams(k1=-0.2, p1=0.02)
    drawn = Cameras(rig, params).drawn
    assert (drawn.left.width, drawn.left.height) == (drawn.right.width, drawn.right.height)
    x, y = rays(rig.left, params)  # all that the lens sees is drawn, and a pixel more for the cubic
    uv = drawn.left.project(np.stack([x, y, np.ones_like(x)], axis=-1).reshape(-1, 3))
    assert drawn.left.contains(uv, 1.0).all()


def test_a_lens_that_folds_the_image_is_refused_in_one_line():
    # r (1 - 0.28 r^2) is 0.727 at most; the corner is at 0.795.
    with pytest.raises(
        FlysimError, match=r"^sensors: a lens of k1 = -0\.28, .* folds the image of 640x480 px: take less"
    ):
        margin(WIDE, SensorParams(k1=-0.28))


def test_rows_come_late_by_the_turn_and_not_without_one(taken, texture, rig):
    still = taken(texture, row_time_us=500.0)[0]
    np.testing.assert_array_equal(still, texture)
    # 1 rad/s to the left, 30 rows of 1 ms: at the last row the camera looks 0.03 rad further left than in the middle,
    # so the same thing is 70 px * tan 0.03 = 2.1 px further right.
    line = np.zeros((61, 81, 3), np.uint8)
    line[:, 40] = 240
    for image in taken(line, row_time_us=1000.0, turn_rate=1.0):
        centre = (image[..., 0] * np.arange(81.0)).sum(axis=1) / image[..., 0].sum(axis=1)
        np.testing.assert_allclose(centre, 40.0 + 70.0 * np.tan((np.arange(61) - 30) * 1e-3), atol=0.05)


def test_a_turn_of_the_camera_is_a_rotation_of_its_rays():
    x, y = rays(WIDE, SensorParams())
    seen, height = turned(x, y, WIDE, 1e-3, 2.0)
    angle = 2.0 * 1e-3 * 239.5  # of the last row
    c, s = math.cos(angle), math.sin(angle)
    ray = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) @ np.array([x[-1, 100], y[-1, 100], 1.0])
    assert (seen[-1, 100], height[-1, 100]) == pytest.approx((ray[0] / ray[2], ray[1] / ray[2]))
