"""Textures: the same for the same seed, of high contrast, without repetition."""

import numpy as np
import pytest

from flysim.worlds.shapes import Box, Cylinder, Sphere
from flysim.worlds.surface.atlas import atlas_pixels, atlas_points, cosine_sine
from flysim.worlds.surface.texture import (
    BRIGHTEST,
    DARKEST,
    speckle,
    speckle_at,
    speckle_shape,
    value_noise,
    write_png,
)


def picture(seed=5, **options):
    return speckle(200, 150, np.random.default_rng(seed), **options)


def test_shape_and_determinism():
    image = picture()
    assert image.shape == (150, 200, 3)
    assert image.dtype == np.uint8
    assert np.array_equal(image, picture())
    assert not np.array_equal(image, picture(6))


def test_contrast_is_high_and_never_saturated():
    for colour in ((0.5, 0.5, 0.5), (0.8, 0.2, 0.2), (0.1, 0.9, 0.5)):
        image = picture(colour=colour)
        assert image.min() >= DARKEST
        assert image.max() <= BRIGHTEST
        assert image.mean(axis=2).std() > 20.0


def test_the_mean_colour_is_near_the_one_asked():
    red, blue = picture(colour=(0.8, 0.25, 0.2)), picture(colour=(0.2, 0.35, 0.8))
    assert red.mean(axis=(0, 1))[0] > red.mean(axis=(0, 1))[2] + 60.0
    assert blue.mean(axis=(0, 1))[2] > blue.mean(axis=(0, 1))[0] + 60.0


def test_channels_go_their_own_ways():
    image = picture(chroma=0.5).reshape(-1, 3).astype(float)
    correlation = np.corrcoef(image.T)[np.triu_indices(3, 1)]
    assert correlation.max() < 0.95
    assert np.corrcoef(picture(chroma=0.0).reshape(-1, 3).T.astype(float)).min() > 0.99


def test_neighbouring_texels_are_alike_so_that_nearest_sampling_does_not_alias():
    # The smallest blotch is eight texels wide: one texel changes less than a quarter of the contrast.
    image = picture(metres_per_texel=0.004, cells=(0.15, 0.07, 0.032)).astype(float)
    assert np.abs(np.diff(image, axis=1)).mean() < 0.25 * image.std()


def test_there_is_contrast_at_the_smallest_blotch():
    # Across 32 mm at 4 mm a texel the picture changes by about its whole contrast.
    image = picture().astype(float)
    assert np.abs(image[:, 8:] - image[:, :-8]).mean() > 0.5 * image.std()


@pytest.mark.parametrize("axis", [0, 1])
def test_nothing_repeats(axis):
    # A window matches itself alone: at shifts beyond a blotch the best match differs by half the contrast.
    image = speckle(400, 400, np.random.default_rng(1), metres_per_texel=0.008).astype(float)
    size, start = 12, 30
    windows = np.lib.stride_tricks.sliding_window_view(image, size, axis=axis)
    band = np.take(windows, range(start, start + size), axis=1 - axis)
    band = band if axis == 0 else np.swapaxes(band, 0, 1)  # [shift, across, colour, along]
    difference = np.sqrt(((band - band[100]) ** 2).mean(axis=(1, 2, 3)))
    shifts = np.abs(np.arange(len(band)) - 100)
    assert difference[shifts > 20].min() > 0.5 * image.std()


def test_noise_is_in_range_and_smooth():
    points = np.stack([np.linspace(0.0, 3.0, 3001), np.zeros(3001)], axis=-1)
    noise = value_noise(points, 0.1, 3, np.random.default_rng(0))
    assert noise.min() >= 0.0
    assert noise.max() <= 1.0
    # Smoothstep has a slope of at most 1.5 over a cell, and the line crosses two axes of it.
    assert np.abs(np.diff(noise, axis=0)).max() <= 2.0 * 1.5 * 0.001 / 0.1 * 1.01


def test_a_sphere_has_no_seam_and_even_blotches():
    sphere = Sphere(0.25)
    image = speckle_shape(sphere, np.random.default_rng(3)).astype(float)
    step = np.abs(np.diff(image, axis=1)).mean()
    assert np.abs(image[:, 0] - image[:, -1]).mean() < 2.0 * step
    # Near a pole a row of the picture is a small circle: it changes as much a metre as the equator does.
    width, height = atlas_pixels(sphere, 0.004)
    points = atlas_points(sphere, width, height)
    for row in (height // 2, height // 6):
        metres = np.linalg.norm(np.diff(points[row], axis=0), axis=1).sum()
        change = np.abs(np.diff(image[row], axis=0)).sum() / 3.0 / metres
        assert 400.0 < change < 4000.0


def test_a_cylinder_closes_round_its_side():
    cylinder = Cylinder(0.2, 0.5)
    image = speckle_shape(cylinder, np.random.default_rng(3)).astype(float)
    side = image[-round(0.5 / 0.004) :]
    step = np.abs(np.diff(side, axis=1)).mean()
    assert np.abs(side[:, 0] - side[:, -1]).mean() < 2.0 * step


def test_density_is_metric():
    assert speckle_shape(Box((0.4, 0.3, 0.35)), np.random.default_rng(0)).shape == (162, 350, 3)


def test_png_bytes_are_the_same_and_palettes_are_close(tmp_path):
    from PIL import Image

    image = picture()
    for name in "ab":
        write_png(image, tmp_path / f"{name}.png")
        write_png(image, tmp_path / f"{name}64.png", colours=64)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    assert (tmp_path / "a64.png").read_bytes() == (tmp_path / "b64.png").read_bytes()
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), image)
    reduced = np.asarray(Image.open(tmp_path / "a64.png").convert("RGB")).astype(float)
    assert np.abs(reduced - image).mean() < 12.0


@pytest.mark.parametrize("cells", [(), (0.0,), (-1.0,), (float("nan"),)])
def test_blotches_that_cannot_be(cells):
    with pytest.raises(ValueError, match="cells must be"):
        picture(cells=cells)


def test_sizes_that_cannot_be():
    with pytest.raises(ValueError, match="at least 1x1"):
        speckle(0, 5, np.random.default_rng(0))
    with pytest.raises(ValueError, match="too small for a surface"):
        far = np.array([[0.0, 0.0, 0.0], [100.0, 100.0, 100.0]])
        speckle_at(far, np.random.default_rng(0), cells=(0.01,))


def plain_noise(points, cell, channels, rng):
    """`value_noise` in plain numpy, one operation after the other."""
    dimensions = points.shape[-1]
    turn = np.zeros((dimensions, dimensions))
    for row, vector in enumerate(rng.uniform(-1.0, 1.0, (dimensions, dimensions))):
        for other in turn[:row]:
            vector = vector - other * (other * vector).sum()
        turn[row] = vector / np.sqrt((vector * vector).sum())
    scaled = np.zeros(points.shape)
    for axis in range(dimensions):
        scaled += points[..., axis, None] * (turn[axis] / cell)
    low = np.floor(scaled.min(axis=0)) - 1.0
    counts = (np.ceil(scaled.max(axis=0)) - low + 2.0).astype(int)
    lattice = rng.random((*counts, channels), dtype=np.float32)
    scaled = scaled - low
    index = np.floor(scaled).astype(np.int32)
    t = (scaled - index).astype(np.float32)
    t = t * t * (np.float32(3.0) - np.float32(2.0) * t)
    noise = np.zeros((len(points), channels), np.float32)
    for corner in np.ndindex(*(2,) * dimensions):
        weight = np.ones(len(points), np.float32)
        for axis, upper in enumerate(corner):
            weight = weight * (t[..., axis] if upper else np.float32(1.0) - t[..., axis])
        noise += weight[..., None] * lattice[tuple((index + corner).T)]
    return noise


@pytest.mark.parametrize("dimensions", [2, 3])
def test_compiled_noise_has_the_bits_of_plain_numpy(dimensions):
    points = np.random.default_rng(5).uniform(-0.5, 0.8, (4000, dimensions))
    compiled = value_noise(points, 0.07, 4, np.random.default_rng(6))
    assert np.array_equal(compiled, plain_noise(points, 0.07, 4, np.random.default_rng(6)))


def test_cosine_and_sine_by_sums_are_the_true_ones():
    angle = np.linspace(-7.0, 7.0, 10_001)
    cos, sin = cosine_sine(angle)
    assert np.abs(cos - np.cos(angle)).max() < 1e-15
    assert np.abs(sin - np.sin(angle)).max() < 1e-15


def test_a_quick_palette_is_nearly_as_close(tmp_path):
    image = speckle_shape(Box((0.4, 0.3, 0.35)), np.random.default_rng(3), colour=(0.2, 0.4, 0.8))
    from PIL import Image

    error = []
    for quick in (False, True):
        write_png(image, tmp_path / "image.png", colours=128, quick=quick)
        read = np.asarray(Image.open(tmp_path / "image.png").convert("RGB"), dtype=float)
        error.append(np.sqrt(((read - image) ** 2).mean()))
    assert error[1] < 1.15 * error[0]
