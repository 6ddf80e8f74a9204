import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flysim.geometry.camera import Camera

CAMERA = Camera(width=640, height=480, fx=500.0, fy=400.0, cx=320.0, cy=240.0)
cameras = st.builds(
    Camera,
    width=st.integers(16, 4000),
    height=st.integers(16, 4000),
    fx=st.floats(50, 5000),
    fy=st.floats(50, 5000),
    cx=st.floats(-100, 3000),
    cy=st.floats(-100, 3000),
)


def test_projection_by_hand():
    # 0.2 m right and 0.1 m down at 2 m: 500 * 0.1 = 50 px right, 400 * 0.05 = 20 px down.
    np.testing.assert_allclose(CAMERA.project([[0.2, 0.1, 2.0], [0.0, 0.0, 7.0]]), [[370, 260], [320, 240]])


def test_what_is_not_in_front_of_the_camera_has_no_pixel():
    assert np.isnan(CAMERA.project([[0.0, 0.0, 0.0], [0.1, 0.1, -1.0], [0.0, 0.0, math.nan]])).all()


def test_from_fov_by_hand():
    # 90 degrees over 640 px: half the width is as far away as the focal length.
    camera = Camera.from_fov(640, 480, math.pi / 2)
    assert camera.fx == camera.fy == pytest.approx(320.0)
    assert (camera.cx, camera.cy) == (319.5, 239.5)
    # Half the field lies between the centre and the outer border of the last pixel, at 639.5.
    u_px = camera.project([[1.0, 0.0, 1.0]])[0, 0]
    assert u_px == pytest.approx(639.5)


def test_K_projects_like_project():
    p = np.array([0.3, -0.2, 1.7])
    uvw = CAMERA.K @ p
    np.testing.assert_allclose(uvw[:2] / uvw[2], CAMERA.project(p))


@given(cameras, st.lists(st.tuples(st.floats(0, 4000), st.floats(0, 4000), st.floats(0.1, 100)), min_size=1))
def test_unproject_undoes_project(camera, rays):
    uv, depth = np.array(rays)[:, :2], np.array(rays)[:, 2]
    points = camera.unproject(uv, depth)
    np.testing.assert_array_equal(points[:, 2], depth)
    np.testing.assert_allclose(camera.project(points), uv, atol=1e-6)


def test_the_image_ends_at_the_centres_of_its_border_pixels():
    inside = CAMERA.contains([[0, 0], [639, 479], [-0.01, 0], [639.01, 0], [0, 479.01], [math.nan, 5]])
    assert inside.tolist() == [True, True, False, False, False, False]
    assert CAMERA.contains([[3, 3], [2.9, 3], [636, 476], [636.1, 476]], margin=3).tolist() == [
        True,
        False,
        True,
        False,
    ]


def test_an_image_of_another_size_keeps_the_shape_of_its_pixels():
    camera = Camera(width=640, height=480, fx=500.0, fy=520.0, cx=330.5, cy=237.5)
    # The principal point is 11 px right of the middle of 640 columns and 2 px above that of 480 rows.
    half, wide = camera.resized(320, 240), camera.resized(1920, 1080)
    assert half == Camera(width=320, height=240, fx=250.0, fy=260.0, cx=159.5 + 5.5, cy=119.5 - 1.0)
    assert wide == Camera(width=1920, height=1080, fx=1500.0, fy=1560.0, cx=959.5 + 33.0, cy=539.5 - 6.0)
    assert camera.resized(640, 480) == camera


def test_a_stretched_image_shows_what_the_other_shows():
    camera = Camera(width=640, height=480, fx=500.0, fy=520.0, cx=330.5, cy=237.5)
    wide = camera.resized(1280, 120, stretched=True)
    assert wide == Camera(width=1280, height=120, fx=1000.0, fy=130.0, cx=661.5, cy=59.0)
    assert camera.resized(320, 240, stretched=True) == camera.resized(320, 240)
    # The corners of both images, half a pixel beyond the outermost centres, lie in the same directions.
    corners = camera.unproject([[-0.5, -0.5], [639.5, 479.5]], [1.0, 1.0])
    np.testing.assert_allclose(wide.project(corners), [[-0.5, -0.5], [1279.5, 119.5]])


GOOD = {"width": 64, "height": 48, "fx": 50.0, "fy": 50.0, "cx": 31.5, "cy": 23.5}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"fx": math.nan}, "fx must be finite, got nan"),
        ({"fy": math.inf}, "fy must be finite, got inf"),
        ({"cx": math.nan}, "cx must be finite"),
        ({"cy": -math.inf}, "cy must be finite"),
        ({"fx": 0.0}, r"focal lengths must be > 0 px, got fx=0\.0"),
        ({"fy": -50.0}, r"got fx=50\.0, fy=-50\.0"),
        ({"width": 0}, "at least 1x1 px, got 0x48"),
        ({"height": -1}, "got 64x-1"),
    ],
)
def test_a_camera_that_cannot_be_is_refused_by_its_figure(change, says):
    with pytest.raises(ValueError, match=says):
        Camera(**{**GOOD, **change})


@pytest.mark.parametrize("fov", [0.0, -1.0, math.pi, math.nan])
def test_a_field_of_view_that_cannot_be_is_refused(fov):
    with pytest.raises(ValueError, match=r"horizontal_fov must be in \(0, pi\) rad, got"):
        Camera.from_fov(640, 480, fov)
