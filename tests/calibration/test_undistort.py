"""A lens put on by the sensors' room and taken out by a calibration is as if it had never been there."""

import cv2
import numpy as np
import pytest
from boards import RIG

from flysim.calibration.rectify import rectified_infos
from flysim.calibration.undistort import Straight, lens, straight_camera
from flysim.errors import FlysimError
from flysim.geometry.camera_info import CameraInfo, stereo_rig
from flysim.geometry.rig import ImagePair
from flysim.sensors.cameras import Cameras
from flysim.sensors.parameters import SensorParams


def infos(D, model="plumb_bob"):
    raw = [
        CameraInfo(width=320, height=240, K=camera.K, D=D, model=model, name=side)
        for side, camera in (("left", RIG.left), ("right", RIG.right))
    ]
    return rectified_infos(raw, RIG.T_right_left)


def smooth(camera):
    rough = np.random.default_rng(5).integers(0, 256, (camera.height, camera.width, 3)).astype(np.float32)
    return np.clip((cv2.GaussianBlur(rough, (0, 0), 3.0) - 128) * 5 + 128, 0, 255).astype(np.uint8)


def test_the_pair_stands_as_it_stood():
    left, right = infos(np.zeros(5))
    np.testing.assert_allclose(stereo_rig(left, right).T_right_left, RIG.T_right_left, atol=1e-9)
    straight = Straight(left, right)
    np.testing.assert_allclose(straight.rig.T_right_left, RIG.T_right_left, atol=1e-9)
    image = smooth(RIG.left)
    assert straight.pair(image, image).left is not None
    np.testing.assert_array_equal(straight.pair(image, image).left, image)  # nothing to take out


@pytest.mark.parametrize("k1", [-0.2, -0.05, 0.15])
def test_a_lens_is_taken_out_again(k1):
    params = SensorParams(k1=k1, p1=0.002)
    measured = infos(np.array([k1, 0.0, 0.002, 0.0, 0.0]))
    cameras = Cameras(RIG, params, measured=measured)
    drawn = cameras.drawn
    left, right = (smooth(camera) for camera in (drawn.left, drawn.right))
    seen = cameras.take(ImagePair(left=left, right=right, rig=drawn), 0)
    assert seen.rig is cameras.believed and seen.left.shape == (240, 320, 3)
    # What a pinhole of the straight image's own figures would have drawn of the same light.
    own, wide = seen.rig.left, drawn.left
    v, u = np.indices((240, 320)).astype(np.float32)
    x, y = ((u - own.cx) / own.fx * wide.fx + wide.cx), ((v - own.cy) / own.fy * wide.fy + wide.cy)
    expected = cv2.remap(left, x.astype(np.float32), y.astype(np.float32), cv2.INTER_CUBIC)
    difference = np.abs(expected.astype(int) - seen.left)[2:-2, 2:-2]
    assert np.percentile(difference, 99) <= 4 and difference.mean() < 1.0
    assert own.fx >= RIG.left.fx  # nothing but image is in the image


def test_a_lens_of_each_model_is_opencvs():
    rays = np.array([[0.0, 0.0], [0.3, -0.2], [-0.5, 0.4]])
    info = infos(np.array([-0.2, 0.05, 0.001, -0.002, 0.01]))[0]
    expected, _ = cv2.projectPoints(np.c_[rays, np.ones(3)], np.zeros(3), np.zeros(3), info.K, info.D)
    np.testing.assert_allclose(lens(info, rays), expected.reshape(-1, 2))
    # By hand: an equidistant lens without coefficients puts the angle, not its tangent, on the image.
    fish = CameraInfo(width=320, height=240, K=RIG.left.K, D=np.zeros(4), model="equidistant")
    at = lens(fish, np.array([[1.0, 0.0]]))[0]
    assert at[0] == pytest.approx(fish.K[0, 2] + fish.K[0, 0] * np.pi / 4)


def test_a_lens_that_bends_too_much_is_refused():
    with pytest.raises(FlysimError, match="bends too much"):
        straight_camera(CameraInfo(width=320, height=240, K=RIG.left.K, D=[60.0, 0.0, 0.0, 0.0, 0.0], name="wild"))
    left, right = infos(np.zeros(5))
    with pytest.raises(FlysimError, match="no left and right eye of a pair"):
        Straight(right, left)
