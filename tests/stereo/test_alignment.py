"""Rows that do not meet: by how much, read off matches of a picture whose misalignment is known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.geometry.camera import Camera
from flysim.geometry.rig import StereoRig
from flysim.stereo.alignment import LEAST, WORTH_PX, Misalignment, misalignment

CAMERA = Camera(width=240, height=180, fx=220.0, fy=220.0, cx=121.0, cy=88.0)
RIG = StereoRig.parallel(CAMERA, 0.12)
SHIFT = 14.0  # [px] of disparity everywhere: a wall


def levels(u, v, seed=0):
    """Grey levels of an endless texture at places [px]."""
    rng = np.random.default_rng(seed)
    found = np.zeros(u.shape)
    for _ in range(10):
        du, dv = rng.uniform(-0.6, 0.6, 2)
        found += np.sin(du * u + dv * v + rng.uniform(0.0, 6.3))
    return np.rint(128.0 + 100.0 * found / 10.0).astype(np.uint8)


def turned(u, v, roll_deg, rows_px):
    """Where what a level right camera sees at (u, v) lies in its picture once that is turned and shifted."""
    c, s = math.cos(math.radians(roll_deg)), math.sin(math.radians(roll_deg))
    x, y = u - CAMERA.cx, v - CAMERA.cy
    return CAMERA.cx + c * x - s * y, CAMERA.cy + s * x + c * y + rows_px  # y points down: clockwise


def pair(roll_deg=0.0, rows_px=0.0, seed=0):
    v, u = np.indices((CAMERA.height, CAMERA.width)).astype(float)
    back_u, back_v = turned(u, v - rows_px, -roll_deg, 0.0)
    return levels(u, v, seed), levels(back_u + SHIFT, back_v, seed)


def matches(count=300, sure=1.0, seed=1):
    """Left pixels and where flies believe them to be; a share of them is anywhere on the row."""
    rng = np.random.default_rng(seed)
    uv = np.stack([rng.integers(30, 225, count), rng.integers(15, 165, count)], axis=1).astype(np.float32)
    uv_right = uv - np.float32((SHIFT, 0.0))
    wrong = rng.random(count) > sure
    uv_right[wrong, 0] = rng.uniform(10.0, 230.0, wrong.sum())
    return uv, uv_right


def found(roll_deg=0.0, rows_px=0.0, sure=1.0, seed=0):
    return misalignment(*pair(roll_deg, rows_px, seed), *matches(sure=sure, seed=seed), RIG)


@given(roll=st.floats(-0.6, 0.6), rows=st.floats(-2.5, 2.5), seed=st.integers(0, 20))
@settings(max_examples=25)
def test_rows_and_roll_are_found_as_they_are(roll, rows, seed):
    told = found(roll, rows, seed=seed)
    assert told is not None
    assert told.rows_px == pytest.approx(rows, abs=0.1)
    assert told.roll_deg == pytest.approx(roll, abs=0.05)
    assert told.misplaced(CAMERA.width) > WORTH_PX or abs(rows) + abs(roll) < 0.2


@pytest.mark.parametrize("seed", range(5))
def test_of_a_clean_pair_nothing_is_worth_a_correction(seed):
    told = found(seed=seed)
    assert told is not None and told.misplaced(CAMERA.width) <= WORTH_PX


def test_wrong_matches_have_no_say():
    told = found(0.3, -1.2, sure=0.6)
    assert told is not None
    assert told.rows_px == pytest.approx(-1.2, abs=0.1) and told.roll_deg == pytest.approx(0.3, abs=0.05)


def test_where_too_few_agree_nothing_is_said():
    uv, uv_right = matches(LEAST - 1)
    assert misalignment(*pair(0.3), uv, uv_right, RIG) is None
    left, right = pair()[0], pair(seed=9)[0]
    noise = np.random.default_rng(0).integers(0, 256, right.shape, np.uint8)
    assert misalignment(left, noise, *matches(), RIG) is None
    plain = np.full_like(left, 90)
    assert misalignment(plain, plain, *matches(), RIG) is None


@given(roll=st.floats(-2.0, 2.0), rows=st.floats(-5.0, 5.0), x=st.floats(-0.5, 0.5), y=st.floats(-0.4, 0.4))
def test_the_corrected_rig_sees_a_point_where_the_turned_picture_shows_it(roll, rows, x, y):
    point = np.array([[x, y, 1.5]])
    u, v = RIG.project(point)[1][0]
    there = Misalignment(rows_px=rows, roll_deg=roll).corrected(RIG).project(point)[1][0]
    np.testing.assert_allclose(there, turned(u, v, roll, rows), atol=1e-6)


def test_a_levelled_picture_is_the_one_of_a_level_camera():
    off = Misalignment(rows_px=1.4, roll_deg=0.5)
    level = off.levelled(pair(0.5, 1.4)[1], RIG)
    inner = (slice(8, -8), slice(8, -8))
    before = np.abs(pair(0.5, 1.4)[1].astype(float) - pair()[1])[inner]
    assert np.abs(level.astype(float) - pair()[1])[inner].mean() < 0.2 * before.mean()


def test_what_is_left_adds_to_what_was_taken_already():
    sum_of = Misalignment(rows_px=0.2, roll_deg=-0.1, matches=80).after(Misalignment(rows_px=1.0, roll_deg=0.3))
    assert (sum_of.rows_px, sum_of.roll_deg, sum_of.matches) == (pytest.approx(1.2), pytest.approx(0.2), 80)


def test_half_a_tenth_of_a_pixel_is_worth_nothing():
    assert Misalignment(rows_px=0.05).misplaced(640) < WORTH_PX < Misalignment(rows_px=-0.1).misplaced(640)
    # A quarter of the width away from the middle, 0.03 degrees are 0.08 px of 640.
    assert Misalignment(roll_deg=0.02).misplaced(640) < WORTH_PX < Misalignment(roll_deg=0.04).misplaced(640)
    assert Misalignment(roll_deg=0.04).misplaced(160) < WORTH_PX
