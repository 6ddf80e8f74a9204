"""What ROS tools write is read; what flysim writes they read; whatever else is one line."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flysim.errors import FlysimError
from flysim.geometry.camera_info import (
    CameraInfo,
    camera_info_yaml,
    parse_camera_info,
    read_camera_info,
    stereo_rig,
    write_camera_info,
)

# As camera_calibration of ROS writes one.
ROS = """image_width: 640
image_height: 480
camera_name: narrow_stereo/right
camera_matrix:
  rows: 3
  cols: 3
  data: [436.02222, 0, 328.5, 0, 4.3667e+02, 236.75, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.25, 0.0625, 1e-05, -.5e-3, 0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [400, 0, 320.5, -40, 0, 400, 240.5, 0, 0, 0, 1, 0]
"""
K = np.array([[400.0, 0.0, 319.5], [0.0, 401.0, 239.5], [0.0, 0.0, 1.0]])


def test_a_file_of_ros_is_read(tmp_path):
    (tmp_path / "right.yaml").write_text(ROS, encoding="utf-8")
    info = read_camera_info(tmp_path / "right.yaml")
    assert (info.name, info.width, info.height) == ("narrow_stereo/right", 640, 480)
    assert (info.camera.fx, info.camera.fy, info.camera.cx, info.camera.cy) == (436.02222, 436.67, 328.5, 236.75)
    assert info.D.tolist() == [-0.25, 0.0625, 1e-5, -5e-4, 0.0]
    assert info.rectified.cx == 320.5 and info.P[0, 3] == -40.0


def test_a_camera_alone_needs_no_rectification():
    text = ROS[: ROS.index("rectification_matrix")]
    info = parse_camera_info(text)
    assert np.array_equal(info.R, np.eye(3)) and np.array_equal(info.P[:, :3], info.K)


def test_the_two_files_of_a_pair_say_where_the_eyes_stand():
    # By hand: both eyes turn 0.1 rad about y, so that the right one stands 0.2 m along the x axis of the turned frame.
    c, s = np.cos(0.1), np.sin(0.1)
    R = np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])
    P = np.hstack([K, [[-0.2 * 400.0], [0.0], [0.0]]])
    left = CameraInfo(width=640, height=480, K=K, R=R)
    right = CameraInfo(width=640, height=480, K=K, R=R, P=P)
    rig = stereo_rig(left, right)
    assert rig.baseline == pytest.approx(0.2)
    # The centre of the right eye in the left frame is R^T (0.2, 0, 0).
    assert np.allclose(-rig.T_right_left[:3, :3].T @ rig.T_right_left[:3, 3], [0.2 * c, 0.0, -0.2 * s])
    with pytest.raises(ValueError, match=r"B = -0\.2 m"):
        stereo_rig(right, left)


finite = st.floats(-1e6, 1e6)


@given(
    focal=st.floats(0.01, 1e6), at=st.lists(finite, min_size=2, max_size=2), D=st.lists(finite, min_size=5, max_size=5)
)
def test_what_is_written_is_read_to_the_last_digit(focal, at, D):
    info = CameraInfo(width=7, height=5, K=[[focal, 0, at[0]], [0, focal, at[1]], [0, 0, 1]], D=D, name="my cam: #1")
    again = parse_camera_info(camera_info_yaml(info))
    assert again.name == "my cam: #1"
    for name in ("K", "D", "R", "P"):
        assert np.array_equal(getattr(again, name), getattr(info, name))


def test_other_readers_of_yaml_find_numbers_in_it():
    yaml = pytest.importorskip("yaml")
    text = camera_info_yaml(CameraInfo(width=640, height=480, K=K, D=[1e-5, 1e-17, 0.0, 3.0, 1e5]))
    assert yaml.safe_load(text)["distortion_coefficients"]["data"] == [1e-5, 1e-17, 0.0, 3.0, 1e5]


def test_a_file_is_written_whole(tmp_path):
    write_camera_info(tmp_path / "left.yaml", CameraInfo(width=640, height=480, K=K))
    assert np.array_equal(read_camera_info(tmp_path / "left.yaml").K, K)
    assert [p.name for p in tmp_path.iterdir()] == ["left.yaml"]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("image_width: 640", "image_width: 0", "image_width must be a whole number"),
        ("image_width: 640", "image_width: 640.5", "image_width must be a whole number"),
        ("image_width: 640", "", "image_width must be a whole number"),
        ("rows: 3\n  cols: 3", "rows: 3\n  cols: 2", "camera_matrix says '3x2' numbers and has 9"),
        ("rows: 3\n  cols: 3", "rows: 99999999999\n  cols: 9", "camera_matrix says"),
        ("436.02222", "0", "was the camera calibrated"),
        ("436.02222", ".nan", "numbers up to"),
        ("436.02222", "1e400", "numbers up to"),
        ("436.02222", "'__import__'", "numbers up to"),
        ("0, 0, 1]\ndist", "0, 0, 2]\ndist", "must be fx 0 cx"),
        ("plumb_bob", "plumb_bop", "Did you mean 'plumb_bob'"),
        ("plumb_bob", "rational_polynomial", "has 8 finite coefficients, got 5"),
        ("[1, 0, 0, 0, 1", "[1, 0, 0, 0, 2", "must be a rotation"),
        ("camera_matrix", "camera_matricks", "no camera_info of ROS"),
        ("camera_name: ", "camera_name: !!python/object/apply:os.system ", None),
        ("camera_name: narrow", "camera_name: &a narrow", "anchors"),
        ("image_height: 480", "image_height: [", "not YAML"),
    ],
)
def test_a_damaged_file_is_one_line_that_names_it(tmp_path, old, new, said):
    path = tmp_path / "camera.yaml"
    assert old in ROS
    path.write_text(ROS.replace(old, new, 1), encoding="utf-8")
    if said is None:  # a tag is passed over, and nothing is run
        assert read_camera_info(path).name == "narrow_stereo/right"
        return
    with pytest.raises(FlysimError, match=re.escape(said)) as refused:
        read_camera_info(path)
    assert "camera.yaml: " in str(refused.value) and "\n" not in str(refused.value)


def test_a_large_file_and_a_bomb_are_refused(tmp_path):
    path = tmp_path / "camera.yaml"
    path.write_text("a: " + "x" * 70_000, encoding="utf-8")
    with pytest.raises(FlysimError, match="larger than 65536 bytes"):
        read_camera_info(path)
    path.write_text("a: &a [1]\nb: &b [*a, *a]\n", encoding="utf-8")
    with pytest.raises(FlysimError, match="anchors"):
        read_camera_info(path)
