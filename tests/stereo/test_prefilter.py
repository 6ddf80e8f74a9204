"""Derivatives in the picture's own unit: by hand, by numpy, and blind to how an eye was exposed."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.flies.threads import limited, share
from flysim.stereo.prefilter import (
    LEAST_BLUR,
    LEAST_UNIT,
    MOST_BLUR,
    Photometry,
    plain_share,
    prefiltered,
    read_off,
    units,
)


def waves(high=120, wide=160, seed=0):
    """`[H, W, 3]` smooth levels between 40 and 140, as floats."""
    rng = np.random.default_rng(seed)
    v, u = np.indices((high, wide))[..., None]
    found = np.zeros((high, wide, 3))
    for _ in range(8):
        du, dv = rng.uniform(-0.9, 0.9, 2)
        found += np.sin(du * u + dv * v + rng.uniform(0.0, 6.3, 3))
    return 90.0 + 50.0 * found / np.abs(found).max()


def picture(levels):
    return np.rint(np.clip(levels, 0.0, 255.0)).astype(np.uint8)


def own(image):
    """A picture's derivative in its own unit, smoothed as a clean one is."""
    told = [read_off(image)]
    return prefiltered([image], LEAST_BLUR, units([image], told, LEAST_BLUR))[0].astype(int)


def by_numpy(image, blur, unit):
    """The same as `prefiltered` gives, by convolutions as they are written in a textbook."""
    n = max(math.ceil(3.0 * blur), 1)
    x = np.arange(-n, n + 1)
    smooth, across = (np.exp(-0.5 * (x / s) ** 2) for s in (blur, min(blur, 0.6 + 2.5 * max(blur - 1.0, 0.0))))
    across /= across.sum()
    slope = x * smooth / (x * x * smooth).sum()
    padded = np.pad(image.astype(float), ((n, n), (n, n), (0, 0)), mode="reflect")
    rows = sum(across[k] * padded[k : k + image.shape[0]] for k in range(2 * n + 1))
    found = sum(slope[k] * rows[:, k : k + image.shape[1]] for k in range(2 * n + 1))
    return np.clip(128.0 + 127.0 / (2.0 * unit) * found, 0.0, 255.0)


def test_a_ramp_of_two_levels_a_pixel_is_half_a_unit_of_four():
    ramp = np.broadcast_to((2 * np.arange(100, dtype=np.uint8))[None, :, None], (40, 100, 3))
    found = prefiltered([ramp], 1.0, [4.0])[0]
    # 2 / 4 of a unit; two units are the 127 levels from the middle to the end.
    assert (found[:, 3:-3] == round(128 + 127 * 0.5 / 2)).all()
    back = prefiltered([ramp[:, ::-1]], 1.0, [4.0])[0]
    assert (back[:, 3:-3] == round(128 - 127 * 0.5 / 2)).all()
    across = prefiltered([np.ascontiguousarray(ramp.transpose(1, 0, 2))], 1.0, [4.0])[0]
    assert (across == 128).all(), "what changes from row to row alone tells no disparity"
    steep = prefiltered([ramp], 1.0, [0.5])[0]
    assert (steep[:, 3:-3] == 255).all(), "more than two units are not told apart"


@pytest.mark.parametrize("blur", [0.3, 0.5, 1.0, 1.4, 2.2, 4.0])
@pytest.mark.parametrize("size", [(9, 11), (61, 83)])
def test_it_is_the_derivative_of_a_gaussian(blur, size):
    image = np.random.default_rng(3).integers(0, 256, (*size, 3), np.uint8)
    if min(size) > math.ceil(3.0 * blur):  # numpy mirrors once
        found = prefiltered([image], blur, [17.0])[0]
        assert np.abs(found - by_numpy(image, blur, 17.0)).max() < 0.501
    plain = np.full((*size, 3), 77, np.uint8)
    assert (prefiltered([plain], blur, [1.0])[0] == 128).all()


def test_two_pictures_in_two_lanes_are_what_each_is_alone():
    images = [picture(waves(70, 90, seed)) for seed in (1, 2)]
    with limited(2):
        both = prefiltered(images, 1.0, [3.0, 5.0], share, 2)
    for image, unit, found in zip(images, (3.0, 5.0), both, strict=True):
        assert np.array_equal(found, prefiltered([image], 1.0, [unit])[0])


def test_a_picture_stays_what_it_is_while_others_are_filtered():
    image = picture(waves())
    first = prefiltered([image], 1.0, [4.0])[0]
    part, kept = first[10:20], first.copy()
    del first
    for seed in range(15):
        prefiltered([picture(waves(seed=seed))], 1.0, [2.0])
    assert np.array_equal(part, kept[10:20])


@given(gain=st.sampled_from([0.5, 2.0]), offset=st.integers(0, 20), seed=st.integers(0, 50))
@settings(max_examples=25)
def test_a_gain_and_an_offset_that_round_nothing_change_nothing(gain, offset, seed):
    dim = picture(waves(seed=seed) / 2.0)
    one, other = (dim * 2, dim) if gain < 1.0 else (dim, dim * 2)
    # The unit is read to a sixteenth of a level: a hundredth of what is told apart.
    assert np.abs(own(other + np.uint8(offset)) - own(one)).max() <= 2


@given(gain=st.floats(0.5, 1.6), offset=st.floats(-15.0, 30.0), seed=st.integers(0, 50))
@settings(max_examples=25)
def test_exposure_changes_no_more_than_rounding_does(gain, offset, seed):
    levels = waves(seed=seed)
    off = own(picture(gain * levels + offset)) - own(picture(levels))
    assert np.median(np.abs(off)) <= 1.0 / min(gain, 1.0)
    assert np.abs(off).max() <= 8


@pytest.mark.parametrize("sigma", [2.0, 5.0, 10.0])
def test_noise_is_told_to_a_tenth_of_what_was_added(sigma):
    rng = np.random.default_rng(1)
    levels = 0.5 * np.indices((256, 200))[1][..., None] + np.zeros(3) + 40.0  # a ramp
    levels[:, 100:] += 40.0  # and an edge
    assert read_off(picture(levels)).noise < 0.3
    found = read_off(picture(levels + rng.normal(0.0, sigma, levels.shape))).noise
    assert found == pytest.approx(sigma, rel=0.1)


def test_the_unit_is_the_slope_that_most_stay_below():
    levels = np.zeros((80, 200, 3))
    levels[:, 1:] = np.cumsum(np.where(np.arange(199) < 60, 2.0, 0.25))[None, :, None]
    # 30 % of the columns rise by 2: the 85 % quantile is among them.
    assert read_off(picture(levels)).unit == pytest.approx(2.0, abs=0.06)
    few = np.zeros((80, 100, 3))
    few[:, 50:] = 120.0
    # One edge alone is told by a quarter of its strongest slopes, a Gaussian's half a pixel beside its middle.
    strongest = 120.0 * math.exp(-0.125) / math.sqrt(2.0 * math.pi)
    assert read_off(picture(few)).unit == pytest.approx(strongest / 4.0, rel=0.05)


def test_noise_asks_for_smoothing_and_clean_pictures_for_none():
    blurs = [Photometry(noise=noise, unit=5.0).blur for noise in (0.0, 0.5, 3.0, 6.0, 10.0)]
    assert blurs[0] == blurs[1] == LEAST_BLUR
    assert blurs == sorted(blurs) and blurs[2] < blurs[3] < blurs[4]
    assert Photometry(noise=1000.0, unit=5.0).blur == MOST_BLUR
    assert Photometry(noise=3.0, unit=2.5).blur > blurs[2], "the less contrast, the more its noise counts"
    # A derivative that is smoothed by s has 0.2 / s^2 of the noise left: 7 % of what the unit is without it.
    own_unit = math.sqrt(5.0**2 - (1.44 * 0.2 * 3.0) ** 2)
    assert 0.2 * 3.0 / blurs[2] ** 2 == pytest.approx(0.07 * own_unit)


def test_eyes_that_are_exposed_alike_have_one_unit():
    images = [np.zeros((8, 8, 3), np.uint8)] * 2
    alike = [Photometry(noise=0.0, unit=unit) for unit in (4.0, 4.18)]
    assert units(images, alike, LEAST_BLUR) == [pytest.approx(4.09)] * 2
    apart = [Photometry(noise=0.0, unit=unit) for unit in (4.0, 4.3)]
    assert units(images, apart, LEAST_BLUR) == [4.0, 4.3]


def test_a_picture_without_contrast_is_not_blown_up_to_one():
    plain = np.full((80, 100, 3), 90, np.uint8)
    assert units([plain], [Photometry(noise=0.0, unit=0.0)], LEAST_BLUR) == [LEAST_UNIT]
    assert (own(plain) == 128).all()
    plain[::2, ::2] += np.uint8(1)  # a level of flicker
    assert np.abs(own(plain) - 128).max() < 127


def test_for_another_smoothing_units_are_read_anew():
    image = picture(waves())
    told = [read_off(image)]
    sharp, soft = units([image], told, LEAST_BLUR)[0], units([image], told, 3.0)[0]
    assert sharp == told[0].unit and soft < 0.8 * sharp


def test_the_share_that_shows_nothing_is_what_does_not_change_along_the_rows():
    rng = np.random.default_rng(3)
    picture = np.full((160, 320, 3), 128, np.uint8)
    assert plain_share(picture) == 1.0
    picture[:, :80] = rng.integers(0, 256, (160, 80, 3))  # a quarter
    assert plain_share(picture) == pytest.approx(0.75)
    picture[:80, 80:] = 131  # changes by a twentieth of the unit: noise
    assert plain_share(picture) == pytest.approx(0.75)
    assert plain_share(np.full((5, 7, 3), 200, np.uint8)) == 0.0


def test_slats_along_the_rows_show_nothing_and_slats_across_them_do():
    slats = np.repeat(np.where(np.arange(240) % 12 < 6, 60, 180).astype(np.uint8)[:, None], 320, axis=1)
    for image, plain in ((slats, True), (np.ascontiguousarray(slats.T), False)):
        colour = np.repeat(image[..., None], 3, axis=2)
        told = read_off(colour)
        (found,) = prefiltered([colour], 1.0, units([colour], [told], 1.0))
        assert (plain_share(found) > 0.95) == plain and (plain_share(found) < 0.05) != plain
