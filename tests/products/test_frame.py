"""A frame says where its camera is believed to be, in the order in which transforms are named."""

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.frames import R_BODY_OPTICAL, Pose2, se3, transform
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.frame import Frame

CAMERA = Camera(width=64, height=48, fx=50.0, fy=50.0, cx=31.5, cy=23.5)


@pytest.fixture
def pair():
    image = np.zeros((48, 64, 3), np.uint8)
    return ImagePair(left=image, right=image, rig=StereoRig.parallel(CAMERA, 0.1))


def test_what_is_ahead_of_a_camera_is_ahead_of_its_robot(pair):
    frame = Frame(
        index=2,
        time=1.5,
        pair=pair,
        T_world_base=Pose2(1.0, 2.0, np.pi / 2.0).matrix,  # it faces along the world's y axis
        T_base_left=se3(R_BODY_OPTICAL, (0.1, 0.05, 0.4)),
    )
    ahead, right, below = transform(frame.T_world_left, np.array([[0.0, 0.0, 3.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]))
    np.testing.assert_allclose(ahead, [0.95, 5.1, 0.4], atol=1e-12)
    np.testing.assert_allclose(right, [1.95, 2.1, 0.4], atol=1e-12)
    np.testing.assert_allclose(below, [0.95, 2.1, -0.6], atol=1e-12)


def test_a_photograph_looks_along_x_from_its_height(pair):
    frame = Frame.alone(pair, height=1.2)
    np.testing.assert_allclose(
        transform(frame.T_world_left, np.array([[0.0, 1.2, 4.0]])), [[4.0, 0.0, 0.0]], atol=1e-12
    )
    assert (frame.index, frame.time) == (0, 0.0)


def test_nobody_moves_a_frame_afterwards(pair):
    T = np.eye(4)
    frame = Frame(index=0, time=0.0, pair=pair, T_world_base=T, T_base_left=np.eye(4))
    T[0, 3] = 7.0
    assert frame.T_world_base[0, 3] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        frame.T_world_base[0, 3] = 1.0
