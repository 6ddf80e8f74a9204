"""One camera does to a picture what the left one of two does."""

import numpy as np
import pytest

from flysim.errors import FlysimError
from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.cameras import Cameras
from flysim.sensors.one_camera import OneCamera
from flysim.sensors.parameters import SensorParams

CAMERA = Camera(width=64, height=48, fx=60.0, fy=60.0, cx=31.5, cy=23.5)
RIG = StereoRig.parallel(CAMERA, 0.1)
PARAMS = [
    SensorParams(),
    SensorParams(noise=3.0, vignetting=0.3),
    SensorParams(k1=-0.2, auto_exposure=120.0),
    SensorParams(motion_px=3.0, jpeg_quality=50),
]


def pictures(camera):
    rng = np.random.default_rng(0)
    return [rng.integers(0, 256, (camera.height, camera.width, 3), np.uint8) for _ in range(3)]


@pytest.mark.parametrize("params", PARAMS)
def test_as_the_left_one_of_two(params):
    two, one = Cameras(RIG, params, seed=4), OneCamera(CAMERA, params, seed=4)
    assert one.drawn == two.drawn.left
    for index, image in enumerate(pictures(one.drawn)):
        left = two.take(ImagePair(left=image, right=image, rig=two.drawn), index).left
        np.testing.assert_array_equal(one.take(image, index), left)


def test_nothing_set_is_nothing_done():
    one, image = OneCamera(CAMERA), pictures(CAMERA)[0]
    assert one.take(image, 0) is image
    assert (one.believed, one.drawn, one.disturbed) == (CAMERA, CAMERA, {})


def test_it_is_taken_for_another():
    params = CalibrationParams(focal_error=0.02, cx_error_px=1.0)
    one = OneCamera(CAMERA, calibration=params)
    assert (one.believed.fx, one.believed.cx, one.true.fx) == (61.2, 32.5, 60.0)
    assert one.disturbed == {"calibration": {"focal_error": 0.02, "cx_error_px": 1.0}}


@pytest.mark.parametrize("name", ["right_roll_deg", "right_yaw_px", "row_shift_px", "baseline_error"])
def test_what_is_of_a_second_camera_is_refused(name):
    with pytest.raises(FlysimError, match=rf"^calibration\.{name} is of a second camera"):
        OneCamera(CAMERA, calibration=CalibrationParams(**{name: 0.1}))
