"""Dense matchers on a pair whose right image is the left one, shifted by whole pixels."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flysim.engines.dense import STEP, Search, dense, search_range
from flysim.geometry.camera import Camera
from flysim.geometry.frames import rotation_rpy, se3
from flysim.geometry.rig import ImagePair, StereoRig

WIDTH, HEIGHT = 240, 120
# f B is 12 px m: 0.5 m is 24 px, 2 m is 6 px, 4 m is 3 px.
CAMERA = Camera(width=WIDTH, height=HEIGHT, fx=100.0, fy=100.0, cx=119.5, cy=59.5)
RIG = StereoRig.parallel(CAMERA, 0.12)
NEAR, FAR = 0.5, 4.0
METHODS = ("sgbm", "bm")


def shifted(disparity):
    """The pair of a wall: what the left image shows at u, the right one shows at u - disparity."""
    noise = np.random.default_rng(0).integers(0, 256, (HEIGHT, WIDTH + 40)).astype(np.float32)
    blotches = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 1.5), None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)
    left, right = blotches[:, :WIDTH], blotches[:, disparity : disparity + WIDTH]
    return ImagePair(left=np.repeat(left[..., None], 3, 2), right=np.repeat(right[..., None], 3, 2), rig=RIG)


def matched(disparity, method):
    found = dense(shifted(disparity), method, min_depth=NEAR, max_depth=FAR)
    assert found.shape == (HEIGHT, WIDTH)
    return found


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("disparity", [3, 6, 10, 24])
def test_a_shift_is_found_exactly(method, disparity):
    found = matched(disparity, method)[:, disparity:]  # left of that the right image shows nothing of the wall
    assert found.dtype == np.float32
    assert np.isfinite(found).mean() > 0.93
    off = np.abs(found[:, 8:-8] - disparity)
    assert np.nanmedian(off) < 0.1
    # StereoBM's parabola leans to the side on which its sums of differences grow less, by half a pixel at most.
    assert np.nanmax(off) <= {"sgbm": 0.1, "bm": 0.5}[method]


@pytest.mark.parametrize("method", METHODS)
def test_the_borders_are_not_lost(method):
    found = np.isfinite(matched(6, method))
    # Unpadded, OpenCV gives none of the first 3 + 32 columns, and StereoBM none of the two outermost rows.
    assert found[:, 8:35].mean() > 0.9
    assert found[[0, 1, -2, -1]].mean() > 0.8
    assert found[:, -1].mean() > 0.4


def test_what_lies_nearer_than_the_range_is_not_found():
    found = dense(shifted(24), "sgbm", min_depth=1.0, max_depth=FAR)  # 3 to 12 px, in a step of 16: to 18
    assert 3.0 <= np.nanmin(found) <= np.nanmax(found) <= 18.5


def test_a_plain_image_has_no_match_for_block_matching():
    plain = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
    found = dense(ImagePair(left=plain, right=plain, rig=RIG), "bm", min_depth=NEAR, max_depth=FAR)
    assert np.isnan(found).all()


def test_the_range_by_hand():
    # 3 to 24 px are 22 disparities, searched in steps of 16.
    assert search_range(RIG, NEAR, FAR) == Search(first=3, count=32)
    assert search_range(RIG, NEAR, FAR).padding == 35
    assert search_range(RIG, 12.0 / 18.0, FAR) == Search(first=3, count=16)  # 3 to 18 px: exactly 16
    assert search_range(RIG, 12.0 / 18.5, FAR) == Search(first=3, count=32)
    assert search_range(RIG, NEAR, 12.0 / 3.9) == Search(first=3, count=32)


def test_the_range_moves_with_the_principal_points():
    right = Camera(width=WIDTH, height=HEIGHT, fx=100.0, fy=100.0, cx=114.5, cy=59.5)
    rig = StereoRig(left=CAMERA, right=right, T_right_left=RIG.T_right_left)
    assert search_range(rig, NEAR, FAR) == Search(first=8, count=32)


@given(st.floats(0.2, 2.0), st.floats(0.1, 10.0), st.floats(0.0, 1.0))
def test_every_depth_asked_for_is_in_the_range(near, more, share):
    search = search_range(RIG, near, near + more)
    disparity = 12.0 / (near + share * more)
    assert search.first <= disparity <= search.first + search.count - 1 + 1e-9
    assert search.count % STEP == 0


def test_opencv_keeps_its_threads():
    before = cv2.getNumThreads()
    try:
        cv2.setNumThreads(1)
        dense(shifted(6), "sgbm", min_depth=NEAR, max_depth=FAR, threads=2)
        assert cv2.getNumThreads() == 1
    finally:
        cv2.setNumThreads(before)


def test_it_runs_on_the_threads_it_is_given(monkeypatch):
    asked = []
    monkeypatch.setattr(cv2, "setNumThreads", asked.append)
    dense(shifted(6), "bm", min_depth=NEAR, max_depth=FAR, threads=2)
    assert asked == [2, cv2.getNumThreads()]
    asked.clear()
    dense(shifted(6), "bm", min_depth=NEAR, max_depth=FAR)
    assert not asked


def test_what_it_refuses():
    pair = shifted(6)

    def with_rig(T):
        return ImagePair(left=pair.left, right=pair.right, rig=StereoRig(left=CAMERA, right=CAMERA, T_right_left=T))

    turned = with_rig(se3(rotation_rpy(0.0, 0.1, 0.0), (-0.12, 0.0, 0.0)))
    mirrored = with_rig(se3(np.eye(3), (0.12, 0.0, 0.0)))
    for bad in (turned, mirrored):
        with pytest.raises(ValueError, match="needs a rectified pair with the right camera on the right"):
            dense(bad, "sgbm", min_depth=NEAR, max_depth=FAR)
    for near, far in ((4.0, 0.5), (0.0, 4.0), (0.5, float("inf")), (float("nan"), 4.0)):
        with pytest.raises(ValueError, match="0 < min_depth < max_depth"):
            dense(pair, "sgbm", min_depth=near, max_depth=far)
    with pytest.raises(ValueError, match="'sgbm' or 'bm', got 'sad'"):
        dense(pair, "sad", min_depth=NEAR, max_depth=FAR)  # type: ignore[arg-type]
    right = Camera(width=WIDTH, height=HEIGHT, fx=100.0, fy=100.0, cx=124.5, cy=59.5)
    with pytest.raises(ValueError, match=r">= 0 px, got -2 px at 4\.0 m"):
        search_range(StereoRig(left=CAMERA, right=right, T_right_left=RIG.T_right_left), NEAR, FAR)
