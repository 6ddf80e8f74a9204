"""What is wrong with a pair is told in words, and nothing is told of a good one."""

import re

import cv2
import numpy as np
import photographed as ph
import pytest

import flysim as fs


def soft(picture, sigma):
    return cv2.GaussianBlur(picture, (0, 0), sigma)


def half_plain(picture):
    return np.where(np.arange(320)[None, :, None] > 90, 128, picture).astype(np.uint8)


CASES = {
    "good": (lambda a, b: (a, b), ph.CALIB, None),
    "dark": (lambda a, b: (a, (b * 0.6).astype(np.uint8)), ph.CALIB, "the right eye is darker: .* grey levels"),
    "blurred": (lambda a, b: (soft(a, 5.0), soft(b, 5.0)), ph.CALIB, "the left picture is nowhere sharp"),
    "one blurred": (lambda a, b: (a, soft(b, 1.3)), ph.CALIB, "the right eye is out of focus by 1[.]. px more"),
    "rows": (lambda a, b: (a, np.roll(b, 1, axis=0)), ph.CALIB, "the right picture lies 1[.]0 px lower"),
    "plain": (lambda a, b: (half_plain(a), half_plain(b)), ph.CALIB, "70 % of the left picture shows no texture"),
    "near": (lambda a, b: (a, b), ph.CALIB.replace("vmax=60", "vmax=20"), "8 to 20 px may cut off what is near"),
    "far": (lambda a, b: (a, b), ph.CALIB.replace("vmin=8", "vmin=16"), "16 to 60 px may cut off what is far"),
}


@pytest.fixture(scope="module")
def room():
    return ph.room()[:2]


@pytest.mark.parametrize("case", CASES)
def test_what_is_wrong_is_told(room, tmp_path, case):
    change, calib, says = CASES[case]
    left, right, path = ph.save(tmp_path, *change(*room), calib=calib)
    told = fs.see(left, right, calib=path).remarks
    if says is None:
        assert told == ()
    else:
        assert any(re.search(says, one) for one in told), told
