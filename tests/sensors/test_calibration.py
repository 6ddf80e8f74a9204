"""How a rig truly stands, and what it is taken for: each figure by its geometry."""

import math

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.rig import StereoRig
from flysim.sensors.calibration import CalibrationParams, believed_rig, true_rig
from flysim.sensors.cameras import Cameras

CAMERA = Camera.from_fov(640, 480, math.radians(65.0))
RIG = StereoRig.parallel(CAMERA, 0.12)


def right_pixels(uv, **params):
    """Where the right camera truly sees what an ideal one sees at pixels `uv`, far away."""
    far = CAMERA.unproject(np.asarray(uv, float), np.full(len(uv), 1e9))
    return true_rig(RIG, CalibrationParams(**params)).project(far)[1]


def test_an_ideal_rig_is_the_one_that_was_given():
    assert true_rig(RIG, CalibrationParams(focal_error=0.1)) is RIG
    assert believed_rig(RIG, CalibrationParams(right_roll_deg=1.0, row_shift_px=2.0)) is RIG
    cameras = Cameras(RIG)
    assert cameras.true is cameras.believed is cameras.drawn is RIG
    assert cameras.disturbed == {}


def test_roll_moves_a_corner_by_its_radius_times_the_angle():
    corners = [(0.0, 0.0), (639.0, 0.0), (639.0, 479.0), (0.0, 479.0)]
    moved = right_pixels(corners, right_roll_deg=0.3) - corners
    radius = math.hypot(319.5, 239.5)
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), radius * math.radians(0.3), rtol=1e-4)
    # The camera turns clockwise, so what it sees turns the other way: the right border rises.
    assert moved[1, 1] < 0 < moved[0, 1]
    np.testing.assert_allclose(right_pixels([(319.5, 239.5)], right_roll_deg=5.0), [(319.5, 239.5)], atol=1e-6)


def test_a_camera_that_looks_up_sees_all_lower():
    ((u, v),) = right_pixels([(319.5, 239.5)], right_pitch_deg=1.0)
    assert (u, v) == pytest.approx((319.5, 239.5 + CAMERA.fy * math.tan(math.radians(1.0))))


def test_yaw_shifts_the_middle_by_the_pixels_that_were_asked_for():
    ((u, v),) = right_pixels([(319.5, 239.5)], right_yaw_px=2.0)
    assert (u, v) == pytest.approx((321.5, 239.5))
    # At the border the same turn is a larger shift: a rotation, no translation of the image.
    assert right_pixels([(0.0, 239.5)], right_yaw_px=2.0)[0, 0] > 2.5


def test_rows_are_shifted_alike_all_over():
    pixels = [(0.0, 0.0), (319.5, 239.5), (639.0, 479.0)]
    np.testing.assert_allclose(right_pixels(pixels, row_shift_px=1.5) - pixels, [(0.0, 1.5)] * 3, atol=1e-6)


def test_the_right_camera_turns_about_itself():
    for params in ({"right_roll_deg": 3.0}, {"right_pitch_deg": 3.0}, {"right_yaw_px": 30.0}):
        rig = true_rig(RIG, CalibrationParams(**params))
        R, t = rig.T_right_left[:3, :3], rig.T_right_left[:3, 3]
        np.testing.assert_allclose(-R.T @ t, (0.12, 0.0, 0.0), atol=1e-12)
        assert not rig.rectified and rig.left is CAMERA


def test_what_is_believed_is_off_by_its_shares_and_pixels():
    params = CalibrationParams(focal_error=0.02, baseline_error=-0.01, cx_error_px=2.0, cy_error_px=-1.0)
    believed = believed_rig(RIG, params)
    assert believed.left == believed.right and believed.rectified
    assert believed.left.fx == pytest.approx(1.02 * CAMERA.fx) and believed.left.fy == pytest.approx(1.02 * CAMERA.fy)
    assert (believed.left.cx, believed.left.cy) == pytest.approx((321.5, 238.5))
    assert believed.baseline == pytest.approx(0.1188)


def test_the_cameras_say_what_is_disturbed():
    cameras = Cameras(RIG, calibration=CalibrationParams(right_roll_deg=0.3, focal_error=0.01))
    assert cameras.disturbed == {"calibration": {"right_roll_deg": 0.3, "focal_error": 0.01}}
    assert cameras.drawn is cameras.true is not cameras.believed
