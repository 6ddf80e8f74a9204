"""A picture through another camera: where each pixel lies, what is black, and one way to read between pixels."""

import cv2
import numpy as np
import pytest
from boards import RIG

from flysim.calibration.lens import Lookup, projected, through
from flysim.calibration.rectify import rectified_infos
from flysim.calibration.undistort import Straight
from flysim.geometry.calibration.calibration import Calibration, RawCamera
from flysim.geometry.camera_info import CameraInfo
from flysim.geometry.frames import rotation_rpy
from flysim.photographs.level import Leveller

K = RIG.left.K
BENT = RawCamera(K=K, distortion=np.array([-0.2, 0.05, 0.001, -0.002, 0.01]), size=(320, 240))
FISH = RawCamera(K=K, distortion=np.array([0.02, -0.01, 0.0, 0.0]), size=(320, 240), model="fisheye")


def rough():
    return np.random.default_rng(3).integers(0, 256, (240, 320, 3), np.uint8)


def grid():
    return [at.astype(np.float32) for at in np.meshgrid(np.arange(320), np.arange(240))]


@pytest.mark.parametrize("lens", [BENT, FISH])
def test_a_pixel_lies_where_the_lens_puts_its_ray(lens):
    turn, wide = rotation_rpy(0.02, -0.03, 0.01), np.diag([0.8, 0.8, 1.0]) @ K
    found = through(lens, turn, wide, (300, 200))
    rays = turn.T @ np.linalg.inv(wide) @ (250.0, 30.0, 1.0)
    at = projected(lens, rays[None, :2] / rays[2])[0]
    assert (found.x[30, 250], found.y[30, 250]) == pytest.approx(at, abs=1e-3)


def test_black_is_what_was_not_seen_and_nothing_else():
    x, y = grid()
    taken = np.maximum(rough(), 1)
    same = Lookup(x=x, y=y)(taken)
    assert np.array_equal(same, taken)
    moved = Lookup(x=x - 10.0, y=y + 0.4)(taken)
    assert not moved[:, :10].any() and moved[:, 10:].any(axis=2).all()


def test_a_fisheye_without_coefficients_is_bent():
    assert RawCamera(K=K, distortion=np.zeros(4), model="fisheye").bent
    assert not RawCamera(K=K, distortion=np.zeros(5)).bent


def test_photographs_are_read_between_their_pixels_as_runs_read_them():
    # Of light that a cubic follows and a line cuts short: waves of 5 px, half a pixel off.
    x, _ = grid()
    wave = lambda at: np.repeat((128.0 + 100.0 * np.sin(2.0 * np.pi * at / 5.0))[..., None], 3, axis=2)  # noqa: E731
    maps = np.stack([x + 0.5, grid()[1]], axis=-1)
    made = Leveller(Calibration(name="x", metric=False, maps=(maps, maps)))("pair", *[wave(x).astype(np.uint8)] * 2)
    off = np.abs(made.pair.left - wave(x + 0.5))[:, 5:-5]
    assert off.max() < 10.0  # 20 by a line

    raw = [CameraInfo(width=320, height=240, K=one.K, D=BENT.distortion) for one in (RIG.left, RIG.right)]
    straight, taken = Straight(*rectified_infos(raw, RIG.T_right_left)), rough()
    seen = straight.images(taken, taken)[0]
    own = through(BENT, np.eye(3), straight.rig.left.K, (320, 240))
    assert np.array_equal(seen, own(taken))
    by_a_line = cv2.remap(taken, own.x, own.y, cv2.INTER_LINEAR)
    assert not np.array_equal(seen, by_a_line)
