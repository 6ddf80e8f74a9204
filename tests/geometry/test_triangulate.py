import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.geometry.camera import Camera
from flysim.geometry.frames import pose6, se3, transform
from flysim.geometry.rig import StereoRig
from flysim.geometry.triangulate import triangulate

cameras = st.builds(
    Camera,
    width=st.integers(100, 2000),
    height=st.integers(100, 2000),
    fx=st.floats(100, 2000),
    fy=st.floats(100, 2000),
    cx=st.floats(0, 1000),
    cy=st.floats(0, 1000),
)
turns = st.floats(-0.5, 0.5)
poses = st.builds(
    pose6, st.floats(0.05, 0.5), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), roll=turns, pitch=turns, yaw=turns
)
points = st.lists(
    st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), st.floats(1.5, 20)).map(
        lambda p: (p[0] * p[2], p[1] * p[2], p[2])
    ),
    min_size=1,
    max_size=10,
)


@settings(deadline=None)
@given(cameras, cameras, poses, points)
def test_project_then_triangulate_is_the_identity_on_any_rig(left, right, T_right_left, p):
    rig = StereoRig(left=left, right=right, T_right_left=T_right_left)
    p = np.array(p)
    ahead = transform(T_right_left, p)[:, 2] > 0.1
    # A point on the line through both centres is seen at any depth alike: none of these is near it.
    centre = -T_right_left[:3, :3].T @ T_right_left[:3, 3]
    sine = np.linalg.norm(np.cross(p, centre), axis=1) / np.linalg.norm(p, axis=1) / np.linalg.norm(centre)
    p = p[ahead & (sine > 0.05)]
    np.testing.assert_allclose(triangulate(rig, *rig.project(p)), p, rtol=1e-6, atol=1e-6)


def test_a_rectified_pair_by_hand():
    # Disparity 30 px at f = 500 px and 0.12 m: 2 m; 50 px right of the axis: 0.2 m.
    rig = StereoRig.parallel(Camera(width=640, height=480, fx=500, fy=500, cx=320, cy=240), 0.12)
    p = triangulate(rig, [[370.0, 240.0]], [[340.0, 240.0]])
    np.testing.assert_allclose(p, [[0.2, 0.0, 2.0]], atol=1e-9)


def test_a_pixel_of_noise_in_disparity_costs_z_squared_over_f_b():
    rig = StereoRig.parallel(Camera(width=640, height=480, fx=500, fy=500, cx=320, cy=240), 0.12)
    for z in (1.0, 2.0, 4.0):
        left, right = rig.project(np.array([[0.1, 0.0, z]]))
        error = triangulate(rig, left, right - (0.01, 0.0))[0, 2] - z
        assert error == pytest.approx(-0.01 * z**2 / (500 * 0.12), rel=0.02)


def test_no_pixels_no_points():
    rig = StereoRig(
        left=Camera(width=64, height=48, fx=50, fy=50, cx=32, cy=24),
        right=Camera(width=64, height=48, fx=50, fy=50, cx=32, cy=24),
        T_right_left=se3(np.eye(3), (-0.1, 0, 0)),
    )
    assert triangulate(rig, np.empty((0, 2)), np.empty((0, 2))).shape == (0, 3)
