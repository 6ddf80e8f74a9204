"""Cameras from corners that are known exactly, and from photographs that are drawn."""

import cv2
import numpy as np
import pytest
from boards import BOARD, CAMERA, RIG, poses

from flysim.calibration.board import Board
from flysim.calibration.detect import Corners
from flysim.calibration.images import image_sets, look_at
from flysim.calibration.result import calibrated
from flysim.calibration.solve import solve_camera, solve_pair
from flysim.errors import FlysimError
from flysim.geometry.camera_info import stereo_rig
from flysim.geometry.frames import transform

SIZE = (CAMERA.width, CAMERA.height)
LENS = np.array([-0.2, 0.05, 0.001, -0.002])


def shot(camera, T_camera_board, ids=None):
    corners = transform(T_camera_board, BOARD.corners)
    uv, _ = cv2.projectPoints(corners, np.zeros(3), np.zeros(3), camera.K, LENS)
    ids = np.arange(len(corners)) if ids is None else ids
    return Corners(ids=ids, uv=uv.reshape(-1, 2)[ids])


def pairs(count=10):
    return [(shot(RIG.left, T), shot(RIG.right, RIG.T_right_left @ T)) for T in poses(count)]


def test_one_camera_and_its_lens_come_back():
    found = solve_camera([left for left, _ in pairs()], BOARD, SIZE).eyes[0]
    np.testing.assert_allclose(found.info.K, CAMERA.K, atol=0.02)
    np.testing.assert_allclose(found.info.D[:4], LENS, atol=2e-3)
    assert found.rms < 1e-3


def test_two_cameras_come_back_with_how_they_stand():
    found = solve_pair(pairs(), BOARD, SIZE)
    for eye, camera in zip(found.eyes, (RIG.left, RIG.right), strict=True):
        np.testing.assert_allclose(eye.info.K, camera.K, atol=0.02)
    np.testing.assert_allclose(found.T_right_left, RIG.T_right_left, atol=1e-5)
    # The two files alone say the same.
    np.testing.assert_allclose(stereo_rig(*(eye.info for eye in found.eyes)).T_right_left, RIG.T_right_left, atol=1e-5)


def test_an_image_that_one_eye_alone_sees_counts_for_that_eye():
    some = pairs(10)
    alone = [(left, None if k in (2, 7) else right) for k, (left, right) in enumerate(some)]
    found = solve_pair(alone, BOARD, SIZE)
    assert found.eyes[1].rms_of_images[2] is None and found.eyes[0].rms_of_images[2] < 0.01
    np.testing.assert_allclose(found.T_right_left, RIG.T_right_left, atol=1e-4)


def test_eyes_that_count_a_board_from_different_ends_agree():
    turned = [(left, right.turned() if k % 2 else right) for k, (left, right) in enumerate(pairs())]
    np.testing.assert_allclose(solve_pair(turned, BOARD, SIZE).T_right_left, RIG.T_right_left, atol=1e-5)


def test_corners_that_both_eyes_see_count_together():
    even, most = np.arange(0, 35, 2), np.arange(4, 35)
    some = [(shot(RIG.left, T, even), shot(RIG.right, RIG.T_right_left @ T, most)) for T in poses(10)]
    found = solve_pair(some, BOARD, SIZE)
    np.testing.assert_allclose(found.T_right_left, RIG.T_right_left, atol=1e-4)
    assert {len(one) for one in found.eyes[0].residuals} == {16}


@pytest.mark.parametrize(
    ("shots", "said"),
    [
        (pairs(2), "found in 2 images of both eyes, a calibration needs 3"),
        ([], "found in 0 images"),
        ([(right, left) for left, right in pairs()], "exchange the two"),
    ],
)
def test_what_makes_no_pair_is_one_line(shots, said):
    with pytest.raises(FlysimError, match=said) as refused:
        solve_pair(shots, BOARD, SIZE)
    assert "\n" not in str(refused.value)


def test_a_tenth_more_square_is_a_tenth_more_baseline():
    larger = Board(columns=BOARD.columns, rows=BOARD.rows, square=1.1 * BOARD.square)
    assert solve_pair(pairs(), larger, SIZE).baseline == pytest.approx(1.1 * RIG.baseline, rel=1e-3)


def test_images_become_cameras(album):
    views = look_at(image_sets([str(album)]), BOARD)
    found = calibrated(BOARD, views)
    np.testing.assert_array_equal(calibrated(BOARD, views).infos["left"].K, found.infos["left"].K)  # to the last bit
    for eye, camera in zip(found.solved.eyes, (RIG.left, RIG.right), strict=True):
        assert eye.info.camera.fx == pytest.approx(camera.fx, rel=5e-3)
        assert eye.info.camera.cx == pytest.approx(camera.cx, abs=1.5)
    assert found.solved.baseline == pytest.approx(RIG.baseline, rel=5e-3)
    assert found.solved.rms < 0.15
    assert found.views.left_out == ()


def test_the_verdict_says_what_is_missing(album):
    few = look_at([one[:4] for one in image_sets([str(album)])], BOARD)
    found = calibrated(BOARD, few)
    assert found.verdict == "poor"
    assert any(words.startswith("only 4 boards") for words in found.advice)
    assert any("of the image was covered" in words for words in found.advice)
