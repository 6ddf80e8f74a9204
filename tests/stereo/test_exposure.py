"""What one eye has to be multiplied with and what has to be added, read off matches."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from flysim.stereo.exposure import LEAST, levels_alike

HIGH, WIDE, SHIFT = 120, 160, 9
V, U = np.indices((HIGH, WIDE))


def seen(columns, seed=0):
    """`[H, W, 3]` levels about 115 of a texture at such columns, 43 to 187 at most."""
    rng = np.random.default_rng(seed)
    found = np.zeros((HIGH, WIDE, 3))
    for _ in range(8):
        du, dv = rng.uniform(-0.35, 0.35, 2)
        found += np.sin((du * columns + dv * V)[..., None] + rng.uniform(0.0, 6.3, 3))
    return 115.0 + 9.0 * found


def picture(levels):
    return np.rint(np.clip(levels, 0.0, 255.0)).astype(np.uint8)


def matched(count=200, seed=1):
    """`[N, 2]` left pixels and their matches, SHIFT columns further left."""
    rng = np.random.default_rng(seed)
    uv = np.stack([rng.integers(SHIFT + 3, WIDE - 3, count), rng.integers(3, HIGH - 3, count)], axis=1).astype(np.int32)
    return uv, (uv - (SHIFT, 0)).astype(np.float32)


def off(found, right):
    return np.abs(found.astype(float) - right)[:, : WIDE - SHIFT]


def test_eyes_that_are_exposed_alike_are_left_alone():
    right = picture(seen(U + SHIFT))
    found, apart = levels_alike(picture(seen(U)), right, *matched())
    assert found is right and apart < 0.5


@given(gain=st.floats(0.65, 1.4), offset=st.floats(-20.0, 20.0), seed=st.integers(0, 30))
@settings(max_examples=25)
def test_the_gain_and_offset_that_are_found_are_those_that_were_applied(gain, offset, seed):
    true = seen(U + SHIFT, seed)
    changed = picture(gain * true + offset)
    found, apart = levels_alike(picture(seen(U, seed)), changed, *matched())
    # Half a level of rounding is stretched by 1 / gain; what is less apart than is worth it is left alone.
    assert apart < 1.3 and np.median(off(found, true)) < 1.3
    if np.median(np.abs(changed - true)) > 3.0:
        assert np.median(off(found, true)) < 0.5 / gain + 0.6
        assert np.percentile(off(found, true), 99) < 4.0


def test_each_colour_has_its_own():
    true = seen(U + SHIFT)
    found, _ = levels_alike(picture(seen(U)), picture(true * (0.7, 0.9, 1.2) + (15.0, -5.0, 0.0)), *matched())
    assert (np.median(off(found, true), axis=(0, 1)) < 1.0).all()


@pytest.mark.parametrize("lost", [0.2, 0.35])
def test_light_that_fades_towards_the_corners_is_found_too(lost):
    x, y = U / WIDE * 2.0 - 1.0, V / HIGH * 2.0 - 1.0
    true, field = seen(U + SHIFT), 1.0 - lost / 2.0 * (x * x + y * y)
    faded = picture(true * field[..., None])
    before = off(faded, true)
    found, apart = levels_alike(picture(seen(U)), faded, *matched())
    assert apart < 1.3
    assert np.median(off(found, true)) < 1.5 < np.median(before) / 3.0
    # And where it has changed most: the corners.
    corner = (x * x + y * y > 1.2)[:, : WIDE - SHIFT]
    assert off(found, true)[corner].mean() < 0.25 * before[corner].mean()


def test_matches_that_are_wrong_have_no_say():
    uv, uv_right = matched()
    uv_right[::4, 0] = np.random.default_rng(2).uniform(5.0, WIDE - 5.0, len(uv_right[::4]))
    true = seen(U + SHIFT)
    found, _ = levels_alike(picture(seen(U)), picture(0.75 * true + 10.0), uv, uv_right)
    assert np.median(off(found, true)) < 1.2


def test_of_too_few_matches_nothing_is_said():
    uv, uv_right = matched(LEAST - 1)
    right = picture(0.5 * seen(U + SHIFT))
    found, apart = levels_alike(picture(seen(U)), right, uv, uv_right)
    assert found is right and apart == math.inf


def test_what_cannot_be_made_alike_is_left_alone_and_said():
    other = picture(seen(U, seed=77))
    found, apart = levels_alike(picture(seen(U)), other, *matched())
    assert apart > 5.0
    assert np.median(np.abs(found.astype(float) - other)) < 60.0
