"""From light to a file, by hand: exposure, noise, the colour filter, bounds, JPEG."""

import cv2
import numpy as np
import pytest

from flysim.geometry.rig import ImagePair
from flysim.sensors.cameras import Cameras
from flysim.sensors.parameters import SensorParams


@pytest.mark.parametrize(
    ("sensors", "left", "right"),
    [
        ({"gain_right": 0.8}, 100, 80),
        ({"gain_left": 1.5}, 150, 100),
        ({"offset_right": -10.0}, 100, 90),
        ({"offset_left": 20.0}, 120, 100),
        ({"contrast": 0.25}, 121, 121),  # 128 - 28 / 4
        ({"gamma_right": 2.0}, 100, 39),  # 255 (100 / 255)^2 = 39.2
        ({"gamma_left": 0.5}, 160, 100),  # 255 (100 / 255)^0.5 = 159.7
        ({"gain_right": 0.8, "gamma_right": 2.0, "offset_right": 15.0, "contrast": 0.5}, 114, 84),  # 25.1 + 15, to 128
        ({"gain_left": 3.0, "offset_right": -200.0}, 255, 0),  # bounded at the end
        ({"gain_left": 3.0, "offset_left": -100.0}, 200, 100),  # and not before
    ],
)
def test_a_level_of_100_becomes(taken, sensors, left, right):
    images = taken(100, **sensors)
    assert (images[0] == left).all() and (images[1] == right).all()


def test_exposure_holds_the_level_and_comes_late(rig):
    cameras = Cameras(rig, SensorParams(auto_exposure=100.0, exposure_lag=2))

    def level(light):
        image = np.full((61, 81, 3), light, np.uint8)
        pair = cameras.take(ImagePair(left=image, right=image, rig=rig), 0)
        assert (pair.left == pair.right).all()
        return int(pair.left[0, 0, 0])

    # 50 is exposed twice as long; the light that doubles is too bright for the two frames that the control is late.
    assert [level(light) for light in (50, 50, 100, 100, 100, 100)] == [100, 100, 200, 200, 100, 100]
    cameras.begin(0)
    assert level(100) == 100  # a new run measures its own first frame
    assert level(2) == 2


def test_noise_has_the_deviation_that_was_asked_for(taken):
    left, right = (image.astype(float) for image in taken(128, noise=5.0))
    for image in (left, right):
        assert image.mean() == pytest.approx(128.0, abs=0.2)
        assert image.std() == pytest.approx(5.0, rel=0.03)  # 14823 samples: 0.6 %, and 1/12 of rounding
    for one, other in ((left, right), (left[..., 0], left[..., 1]), (left[:, 1:], left[:, :-1])):
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.05


@pytest.mark.parametrize("level", [50, 200])
def test_shot_noise_grows_with_the_root_of_the_light(taken, level):
    image = taken(level, shot_noise=400.0)[0].astype(float)
    assert image.mean() == pytest.approx(level, abs=0.5)
    assert image.std() == pytest.approx((level * 255.0 / 400.0) ** 0.5, rel=0.03)


def test_the_noise_of_reading_is_the_same_with_and_without_that_of_arrival(taken):
    read, both = (taken(100, noise=5.0, **more)[0].astype(float) for more in ({}, {"shot_noise": 1e5}))
    assert 0.4 < (both - read).std() < 0.7  # (100 * 255 / 1e5)^0.5 = 0.5, and rounding; drawn anew it would be 7


def test_a_colour_filter_keeps_what_has_no_detail_and_mixes_what_has(taken):
    plain = np.full((61, 81, 3), (200, 90, 30), np.uint8)
    np.testing.assert_array_equal(taken(plain, bayer=True)[0], plain)
    dot = np.zeros((61, 81, 3), np.uint8)
    dot[30, 40] = 240  # on a red pixel: its green and blue light falls on none
    seen = taken(dot, bayer=True)[0]
    assert tuple(seen[30, 40]) == (240, 0, 0)
    assert seen[..., 1:].max() == 0


def test_jpeg_is_what_opencv_writes_and_reads(taken, texture):
    left, _ = taken(texture, jpeg_quality=40)
    _, data = cv2.imencode(".jpg", cv2.cvtColor(texture, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, 40])
    np.testing.assert_array_equal(left, cv2.cvtColor(cv2.imdecode(data, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB))
    errors = [np.abs(taken(texture, jpeg_quality=q)[0].astype(int) - texture).mean() for q in (95, 50, 10)]
    assert 0 < errors[0] < errors[1] < errors[2]
