"""One eye out of focus: how far is told from the pictures alone, and the other one is softened as much."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.geometry.camera import Camera
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.runs.run import run
from flysim.stereo.sharpness import Softening, softening

WIDTH, HEIGHT = 320, 240
CAMERA = Camera(width=WIDTH, height=HEIGHT, fx=250.0, fy=250.0, cx=159.5, cy=119.5)


def seen_by_two(seed):
    """`[H, W, 3]` left and right of a surface that leans away to one side, with detail of all sizes."""
    rng = np.random.default_rng(seed)
    big = sum(
        cv2.resize(
            rng.normal(0.0, size**0.7, (HEIGHT // size + 2, 640 // size + 2, 3)).astype(np.float32), (640, HEIGHT)
        )
        for size in (1, 2, 4, 8, 16, 32)
    )
    big = cv2.GaussianBlur(big, (0, 0), 0.8)  # as a lens has it; and sampling between pixels then softens no eye more
    big = np.clip(128.0 + 35.0 * big / big.std(), 0, 255).astype(np.float32)
    u, v = np.meshgrid(np.arange(WIDTH, dtype=np.float32), np.arange(HEIGHT, dtype=np.float32))
    left = cv2.remap(big, u + 60, v, cv2.INTER_LINEAR)
    right = cv2.remap(big, u + 60 + 8 + 0.04 * u, v, cv2.INTER_LINEAR)
    return left.astype(np.uint8), right.astype(np.uint8)


def blurred(image, sigma, sigma_y=None):
    return cv2.GaussianBlur(image, (0, 0), sigma, sigmaY=sigma if sigma_y is None else sigma_y)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("sigma", [0.8, 1.0, 1.5, 2.0])
def test_the_blur_of_an_eye_is_told_to_a_sixth_of_a_pixel(seed, sigma):
    left, right = seen_by_two(seed)
    for pair, blur in (((left, blurred(right, sigma)), "left_px"), ((blurred(left, sigma), right), "right_px")):
        found = softening(*pair)
        along, down = getattr(found, blur)
        assert along == down == pytest.approx(sigma, abs=0.17)
        assert not any(found.right_px if blur == "left_px" else found.left_px)


@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    gain=st.floats(0.6, 1.2),
    offset=st.floats(-25.0, 25.0),
    both=st.floats(0.0, 2.0),
    noise=st.floats(0.0, 8.0),
)
def test_eyes_that_are_equally_sharp_are_left_alone(seed, gain, offset, both, noise):
    left, right = seen_by_two(seed)
    if both > 0.3:
        left, right = blurred(left, both), blurred(right, both)
    rng = np.random.default_rng(seed)
    right = np.clip(gain * right + offset + rng.normal(0.0, noise, right.shape), 0, 255).astype(np.uint8)
    left = np.clip(left + rng.normal(0.0, noise, left.shape), 0, 255).astype(np.uint8)
    assert softening(left, right) == Softening()


def test_a_smear_of_one_eye_along_the_rows_is_no_defocus():
    left, right = seen_by_two(3)
    smeared = cv2.blur(right, (5, 1))
    along, down = softening(left, smeared).left_px
    assert along == pytest.approx(5 / 12**0.5, abs=0.4)  # a box so long has that deviation
    assert down < 0.5


def test_nothing_to_see_says_nothing():
    flat = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
    assert softening(flat, flat) == Softening()
    assert softening(np.zeros((16, 16, 3), np.uint8), np.full((16, 16, 3), 255, np.uint8)) == Softening()


def test_the_sharper_picture_alone_is_softened():
    left, right = seen_by_two(1)
    pair = ImagePair(left=left, right=right, rig=StereoRig.parallel(CAMERA, 0.1))
    assert Softening().pair(pair) is pair
    soft = Softening(left_px=(1.5, 1.5)).pair(pair)
    assert soft.right is right or np.array_equal(soft.right, right)
    np.testing.assert_array_equal(soft.left, cv2.GaussianBlur(left, (0, 0), 1.5, borderType=cv2.BORDER_REPLICATE))


# Of 22 seeds the centre is off by 0.5 cm on average, with a deviation of 0.2 cm.
@pytest.mark.parametrize("seed", [22, 23])
def test_an_obstacle_is_measured_as_well_with_one_eye_out_of_focus(seed):
    report = run("paper_c", seed=seed, overrides=["sensors.defocus_right=1.2"])
    assert report.f1 == report.well["f1"] == 1.0
    assert report.center_visible_error.max < 0.01
    assert report.alignment["right_blur_px"] == pytest.approx(1.2, abs=0.15)
    assert "focus      the right picture is blurred by" in str(report)


def test_off_it_is_neither_asked_for_nor_said(short):
    report = run(str(short), overrides=["sensors.defocus_right=1.2", "flies.align=false"], renderer="tiny")
    assert report.alignment is None and "\nfocus " not in str(report)
