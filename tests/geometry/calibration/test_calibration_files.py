"""Each format by what its own documentation, or OpenCV itself, says its figures mean."""

import cv2
import numpy as np
import pytest

from flysim.errors import FlysimError
from flysim.geometry.calibration.calibration import check_size
from flysim.geometry.calibration.choose import read_calibration
from flysim.geometry.camera_info import CameraInfo, camera_info_yaml

K0 = np.array([[520.0, 0.0, 310.0], [0.0, 515.0, 250.0], [0.0, 0.0, 1.0]])
K1 = np.array([[530.0, 0.0, 330.0], [0.0, 525.0, 240.0], [0.0, 0.0, 1.0]])
D0, D1 = np.array([-0.28, 0.07, 0.001, -0.002, 0.01]), np.array([-0.3, 0.1, 0.0, 0.001, 0.0])
R = cv2.Rodrigues(np.array([0.01, -0.02, 0.005]))[0]
T = np.array([-0.12, 0.001, 0.002])
SIZE = (640, 480)

MIDDLEBURY = """cam0=[1733.74 0 792.27; 0 1733.74 541.89; 0 0 1]
cam1=[1733.74 0 792.27; 0 1733.74 541.89; 0 0 1]
doffs=0
baseline=536.62
width=1920
height=1080
ndisp=170
vmin=55
vmax=142
"""
ODOMETRY = """P0: 7.188560000000e+02 0 6.071928e+02 0 0 7.188560e+02 1.852157e+02 0 0 0 1 0
P1: 7.188560000000e+02 0 6.071928e+02 -3.861448e+02 0 7.188560e+02 1.852157e+02 0 0 0 1 0
P2: 7.188560000000e+02 0 6.071928e+02 4.538225e+01 0 7.188560e+02 1.852157e+02 -1.130887e-01 0 0 1 3.779761e-03
P3: 7.188560000000e+02 0 6.071928e+02 -3.372877e+02 0 7.188560e+02 1.852157e+02 2.369057e+00 0 0 1 4.915215e-03
Tr: 1 0 0 0 0 1 0 0 0 0 1 0
"""
EYE = """# General sensor definitions.
sensor_type: camera
comment: VI-Sensor cam0 (MT9M034)
T_BS:
  cols: 4
  rows: 4
  data: [1.0, 0.0, 0.0, {x},
         0.0, 1.0, 0.0, 0.0,
         0.0, 0.0, 1.0, 0.0,
         0.0, 0.0, 0.0, 1.0]
rate_hz: 20
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.654, 457.296, 367.215, 248.375] #fu, fv, cu, cv
distortion_model: radial-tangential
distortion_coefficients: [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]
"""


def raw_kitti():
    level = (f"P_rect_0{k}: 721.5 0 609.5 {x} 0 721.5 172.8 0.2 0 0 1 0.003" for k, x in ((2, 44.8), (3, -339.5)))
    lenses = (
        f"S_0{k}: 1392 512\nK_0{k}: 959 0 694 0 955 224 0 0 1\nD_0{k}: -0.37 0.2 0.001 0.002 -0.07\n"
        f"R_0{k}: 1 0 0 0 1 0 0 0 1\nT_0{k}: {x} 0 0\nS_rect_0{k}: 1242 375\nR_rect_0{k}: 1 0 0 0 1 0 0 0 1"
        for k, x in ((2, 0.06), (3, -0.47))
    )
    return "calib_time: 09-Jan-2012 13:57:47\ncorner_dist: 9.95e-02\n" + "\n".join((*lenses, *level)) + "\n"


def write(folder, **texts):
    paths = []
    for name, text in texts.items():
        paths.append(folder / name)
        paths[-1].write_text(text, encoding="utf-8")
    return paths


def stored(path, **matrices):
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in matrices.items():
        storage.write(name, value)
    storage.release()
    return path


def test_middleburys_own_range_of_disparities_is_kept(tmp_path):
    found = read_calibration(write(tmp_path, calib=MIDDLEBURY))
    assert found.level is not None
    assert found.disparities == (55.0, 142.0)
    rig = found.level.rig(1920, 1080)
    assert (rig.left.fx, rig.left.cx, rig.baseline) == (1733.74, 792.27, pytest.approx(0.53662))
    without = MIDDLEBURY.replace("vmin=55\n", "").replace("vmax=142\n", "")
    assert read_calibration(write(tmp_path, other=without)).disparities == (0.0, 169.0)


def test_a_picture_of_2006_knows_its_focal_length_and_its_cut(tmp_path):
    found = read_calibration(write(tmp_path, dmin="216\n"), width=443)  # third size
    assert found.level is not None
    assert found.level.left[0, 0] == pytest.approx(3740.0 / 3.0)
    assert found.level.right[0, 2] - found.level.left[0, 2] == pytest.approx(72.0)


@pytest.mark.parametrize(("folder", "baseline"), [("image_0", 386.1448 / 718.856), ("image_2", 382.66995 / 718.856)])
def test_kittis_folder_tells_which_cameras_took_a_picture(tmp_path, folder, baseline):
    (path,) = write(tmp_path, calib=ODOMETRY)
    found = read_calibration([path], picture=tmp_path / folder / "000000.png")
    assert found.level is not None
    assert found.level.baseline == pytest.approx(baseline, abs=1e-6)
    assert found.lenses is None


def test_a_raw_recording_of_kitti_knows_both_kinds_of_pictures(tmp_path):
    found = read_calibration(write(tmp_path, calib=raw_kitti()))
    assert found.level is not None and found.lenses is not None and found.T_right_left is not None
    assert found.level.size == (1242, 375)
    assert found.lenses[0].size == (1392, 512)
    assert found.level.baseline == pytest.approx((44.8 + 339.5) / 721.5)
    assert found.T_right_left[:3, 3] == pytest.approx((-0.53, 0.0, 0.0))


@pytest.mark.parametrize("ending", ["yml", "xml", "json"])
def test_what_opencv_writes_is_what_is_read(tmp_path, ending):
    path = stored(tmp_path / f"stereo.{ending}", M1=K0, D1=D0, M2=K1, D2=D1, R=R, T=T)
    found = read_calibration([path])
    assert found.lenses is not None and found.T_right_left is not None
    assert np.array_equal(found.lenses[0].K, K0)
    assert np.array_equal(found.lenses[1].distortion, D1)
    assert found.T_right_left[:3, :3] == pytest.approx(R)
    assert found.T_right_left[:3, 3] == pytest.approx(T)


def rectified():
    return cv2.stereoRectify(K0, D0, K1, D1, SIZE, R, T[:, None], alpha=0)


def test_a_matrix_q_gives_the_depths_that_opencv_gives(tmp_path):
    *_, Q, _, _ = rectified()
    Q[3, 3] = 4.0 * Q[3, 2]  # principal points that differ
    found = read_calibration([stored(tmp_path / "q.yml", Q=Q)])
    assert found.level is not None
    rig, (u, v, d) = found.level.rig(*SIZE), (100.0, 200.0, 31.5)
    x, y, z, w = Q @ (u, v, d, 1.0)
    left, right = rig.project(np.array([[x, y, z]]) / w)
    assert left[0] == pytest.approx((u, v))
    assert left[0, 0] - right[0, 0] == pytest.approx(d)


def test_projections_and_turns_alone_give_the_pose_between_the_lenses(tmp_path):
    R1, R2, P1, P2, *_ = rectified()
    one = stored(
        tmp_path / "intrinsics.yml", cameraMatrixLeft=K0, cameraMatrixRight=K1, distCoeffsLeft=D0, distCoeffsRight=D1
    )
    two = stored(tmp_path / "extrinsics.yml", R1=R1, R2=R2, P1=P1, P2=P2)
    found = read_calibration([one, two])
    assert found.T_right_left is not None and found.level is not None and found.level.turns is not None
    assert found.T_right_left[:3, 3] == pytest.approx(T, abs=1e-9)
    assert found.T_right_left[:3, :3] == pytest.approx(R, abs=1e-9)


def test_maps_are_read_whole_or_in_opencvs_fixed_point(tmp_path):
    *_, Q, _, _ = rectified()
    whole = cv2.initUndistortRectifyMap(K0, D0, R, K0, (64, 48), cv2.CV_32FC1)
    fixed = cv2.convertMaps(*whole, cv2.CV_16SC2)
    one = stored(
        tmp_path / "a.xml",
        Q=Q,
        **{f"stereoMap{side}_{a}": m for side in "LR" for a, m in zip("xy", whole, strict=True)},
    )
    two = stored(tmp_path / "b.yml", Q=Q, **{f"map{k}{a}": m for k in "12" for a, m in zip("12", fixed, strict=True)})
    exact, rounded = read_calibration([one]).maps, read_calibration([two]).maps
    assert exact is not None and rounded is not None
    assert np.array_equal(exact[0], np.stack(whole, axis=2))
    assert np.abs(rounded[1] - exact[1]).max() <= 1 / 64 + 1e-4


def test_millimetres_are_told_from_metres_by_what_no_camera_has(tmp_path):
    found = read_calibration([stored(tmp_path / "mm.yml", M1=K0, D1=D0, M2=K1, D2=D1, R=R, T=T * 1000.0)])
    assert found.T_right_left is not None
    assert found.T_right_left[:3, 3] == pytest.approx(T)
    assert found.notes == ("the calibration's baseline of 120.021 was taken for millimetres",)


def test_two_sensors_of_euroc_give_the_pose_between_them(tmp_path):
    found = read_calibration(write(tmp_path, left=EYE.format(x=0.02), right=EYE.format(x=0.13)))
    assert found.lenses is not None and found.T_right_left is not None
    assert found.lenses[0].K[0].tolist() == [458.654, 0.0, 367.215]
    assert found.lenses[0].distortion[3] == pytest.approx(1.76187114e-05)  # a text to YAML 1.1 without its dot
    assert found.lenses[0].size == (752, 480)
    assert found.T_right_left[:3, 3] == pytest.approx((-0.11, 0.0, 0.0))


def test_two_camera_infos_give_the_same_as_opencvs_file(tmp_path):
    R1, R2, P1, P2, *_ = rectified()
    eyes = zip(("left", "right"), (K0, K1), (D0, D1), (R1, R2), (P1, P2), strict=True)
    infos = {n: CameraInfo(name=n, width=640, height=480, K=k, D=d, R=r, P=p) for n, k, d, r, p in eyes}
    found = read_calibration(write(tmp_path, **{name: camera_info_yaml(info) for name, info in infos.items()}))
    assert found.T_right_left is not None and found.lenses is not None
    assert found.T_right_left[:3, 3] == pytest.approx(T, abs=1e-9)
    assert np.array_equal(found.lenses[1].distortion, D1)
    with pytest.raises(FlysimError, match="no right eye of a pair"):
        read_calibration([tmp_path / "right", tmp_path / "left"])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "no calibration of a known format"),
        (ODOMETRY.replace("P1", "P8").replace("P3", "P9"), "no line 'P0' or of its right eye 1"),
        (ODOMETRY.replace("-3.372877e+02", "nan"), "P3 must be finite numbers up to 1e[+]06, got 'nan'"),
        (ODOMETRY.replace("-3.372877e+02", "9"), None),
        (ODOMETRY.replace("-3.372877e+02", "900"), "P3 is not to the right of P2"),
        (EYE.format(x=0), "EuRoC has one file an eye: give --calib twice"),
        ("%YAML:1.0\n---\nK: 3\n", "needs K, D, R, T of both eyes, or P1 and P2, or Q; it has 'k'"),
        (
            "%YAML:1.0\n---\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1., 2. ]\n",
            "'M1' holds 2 numbers, not 3 x 3",
        ),
        (
            "%YAML:1.0\n---\nQ: !!opencv-matrix\n   rows: 1\n   cols: 2\n   dt: d\n   data: [ .Nan, 2. ]\n",
            "'Q' holds what is no finite number",
        ),
        ('<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "b">]><opencv_storage><Q>&a;</Q></opencv_storage>', "no XML"),
        ('{"fx": "many", "baseline": 1}', "fx must be a finite number, got 'many'"),
        ('{"fx": 5, "baseline": -1}', "fx and the baseline must be > 0"),
    ],
)
def test_a_calibration_that_is_none_is_told_in_one_line(tmp_path, text, says):
    paths = write(tmp_path, calib=text)
    if says is None:
        assert read_calibration(paths).level is not None
        return
    with pytest.raises(FlysimError, match=says) as caught:
        read_calibration(paths)
    assert str(tmp_path / "calib") in str(caught.value)
    assert "\n" not in str(caught.value)


def test_anchors_of_yaml_are_refused(tmp_path):
    laughs = "a: &a [1, 1]\nb: &b [*a, *a]\nT_BS: *b\nintrinsics: *b\n"
    with pytest.raises(FlysimError, match="anchors and aliases"):
        read_calibration(write(tmp_path, one=laughs, two=laughs))


def test_two_files_must_go_together(tmp_path):
    with pytest.raises(FlysimError, match=r"is of Middlebury, .* of KITTI"):
        read_calibration(write(tmp_path, a=MIDDLEBURY, b=ODOMETRY))
    with pytest.raises(FlysimError, match="one file of KITTI is for both eyes"):
        read_calibration(write(tmp_path, a=ODOMETRY, b=ODOMETRY))


def test_the_calibration_of_another_size_is_refused():
    check_size((640, None), (640, 480), "calib", "left.png")
    with pytest.raises(FlysimError, match=r"calib: is for 640x[?] px, left\.png has 320x240 px"):
        check_size((640, None), (320, 240), "calib", "left.png")
