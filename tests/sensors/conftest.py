"""Small pairs, grey or of noise, and the cameras that take them."""

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.sensors.calibration import CalibrationParams
from flysim.sensors.cameras import Cameras
from flysim.sensors.parameters import SensorParams

CAMERA = Camera(width=81, height=61, fx=70.0, fy=70.0, cx=40.0, cy=30.0)


@pytest.fixture
def rig():
    return StereoRig.parallel(CAMERA, 0.12)


@pytest.fixture
def taken(rig):
    """Takes a pair of one image, or of a level: `taken(100, gain_right=0.8)` is the left and the right image."""

    def take(image, *, index=0, seed=0, turn_rate=0.0, **sensors):
        cameras = Cameras(rig, SensorParams(**sensors), CalibrationParams(), seed=seed)
        camera = cameras.drawn.left
        if np.ndim(image) == 0:
            image = np.full((camera.height, camera.width, 3), image, np.uint8)
        pair = cameras.take(ImagePair(left=image, right=image, rig=cameras.drawn), index, turn_rate)
        assert pair.rig is rig
        return pair.left, pair.right

    return take


@pytest.fixture
def texture():
    """`[61, 81, 3]` random colours, smooth over a few pixels."""
    import cv2

    rough = np.random.default_rng(5).integers(0, 256, (61, 81, 3)).astype(np.float32)
    smooth = cv2.GaussianBlur(rough, (0, 0), 1.5)
    return np.clip((smooth - 128) * 3 + 128, 0, 255).astype(np.uint8)
