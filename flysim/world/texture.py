"""Textures that do not repeat: smooth noise of several sizes and colours, the same for the same generator."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.world.atlas import atlas_pixels, atlas_points
from flysim.world.shapes import Shape

CELLS = (0.15, 0.07, 0.032)  # [m] sizes of the blotches: 8 texels of 4 mm and more
# Shading takes colours down and lamps take them up: those in between stay distinct.
DARKEST, BRIGHTEST = 28, 228
MAX_LATTICE = 20_000_000  # points


def value_noise(points: Array, cell: float, channels: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """`[..., channels]` smooth noise in [0, 1] at `[..., D]` points: random values on a lattice.

    Between its points, `cell` apart, they are blended with the smoothstep polynomial: there are no edges. The
    lattice is turned at random, so that it is not seen.
    """
    dimensions = points.shape[-1]
    axes = tuple(range(points.ndim - 1))
    # Gram-Schmidt in the form of sums and square roots: the same bits on every machine.
    turn = np.zeros((dimensions, dimensions))
    for row, vector in enumerate(rng.uniform(-1.0, 1.0, (dimensions, dimensions))):
        for other in turn[:row]:
            vector = vector - other * (other * vector).sum()
        turn[row] = vector / np.sqrt((vector * vector).sum())
    scaled = np.zeros(points.shape)
    for axis in range(dimensions):
        scaled += points[..., axis, None] * (turn[axis] / cell)
    low = np.floor(scaled.min(axis=axes)) - 1.0
    counts = (np.ceil(scaled.max(axis=axes)) - low + 2.0).astype(int)
    if counts.prod() > MAX_LATTICE:
        raise ValueError(f"cells of {cell} m are too small for a surface of that size: make them larger")
    lattice = rng.random((*counts, channels), dtype=np.float32)
    scaled = scaled - low
    index = np.floor(scaled).astype(np.int32)
    t = (scaled - index).astype(np.float32)
    t = t * t * (np.float32(3.0) - np.float32(2.0) * t)
    noise = np.zeros((*points.shape[:-1], channels), np.float32)
    values = lattice.reshape(-1, channels)
    strides = np.append(np.cumprod(counts[:0:-1])[::-1], 1)
    first = index @ strides
    for corner in np.ndindex(*(2,) * dimensions):
        weight = np.ones(points.shape[:-1], np.float32)
        for axis, upper in enumerate(corner):
            weight = weight * (t[..., axis] if upper else np.float32(1.0) - t[..., axis])
        noise += weight[..., None] * values[first + int(np.dot(corner, strides))]
    return noise


def speckle_at(
    points: Array,
    rng: np.random.Generator,
    *,
    colour: tuple[float, float, float] = (0.5, 0.5, 0.5),
    contrast: float = 0.32,
    chroma: float = 0.5,
    cells: tuple[float, ...] = CELLS,
) -> NDArray[np.uint8]:
    """`[..., 3]` colours of noise at `[..., D]` points [m].

    Args:
        points: on a flat picture (D = 2), or on a surface (D = 3), which the noise then covers without seams.
        rng: the same generator gives the same noise.
        colour: mean RGB in [0, 1].
        contrast: standard deviation of the brightness, in [0, 1] of the whole range.
        chroma: how far the three channels go their own ways: 0 is a grey pattern tinted by `colour`.
        cells: sizes of the blotches [m], all of one strength.

    Raises:
        ValueError: no cells, or one that is not positive.
    """
    if not cells or not all(math.isfinite(cell) and cell > 0.0 for cell in cells):
        raise ValueError(f"cells must be sizes > 0 m, got {cells}")
    grey = np.zeros((*points.shape[:-1], 1), np.float32)
    tint = np.zeros((*points.shape[:-1], 3), np.float32)
    for cell in cells:
        noise = value_noise(points, cell, 4, rng) - np.float32(0.5)
        grey += noise[..., :1]
        tint += noise[..., 1:]
    return _coloured(grey, tint, points.shape[-1], len(cells), colour, contrast, chroma)


def _coloured(
    grey: NDArray[np.float32],
    tint: NDArray[np.float32],
    dimensions: int,
    sizes: int,
    colour: tuple[float, float, float],
    contrast: float,
    chroma: float,
) -> NDArray[np.uint8]:
    """`[..., 3]` colours of summed noise about 0: `grey` `[..., 1]` and `tint` `[..., 3]`."""
    # The noise of one cell size has a standard deviation of about 0.2 (2-D) or 0.15 (3-D).
    gain = np.float32(contrast / (0.2 if dimensions == 2 else 0.15) / math.sqrt(sizes))
    mixed = (grey + np.float32(chroma) * tint) * (gain / np.float32(math.sqrt(1.0 + chroma**2)))
    # Strong blotches near the ends of the range, not cut flat. Square roots are the same on every machine.
    mean = np.array(colour, np.float32)
    room = np.where(mixed > 0.0, np.float32(1.0) - mean, mean) + np.float32(1e-3)
    value = mean + mixed / np.sqrt(np.float32(1.0) + (mixed / room) ** 2)
    value = np.clip(value, 0.0, 1.0) * np.float32(BRIGHTEST - DARKEST) + np.float32(DARKEST)
    return np.rint(value).astype(np.uint8)


def speckle(
    width: int,
    height: int,
    rng: np.random.Generator,
    *,
    metres_per_texel: float = 0.004,
    colour: tuple[float, float, float] = (0.5, 0.5, 0.5),
    contrast: float = 0.32,
    chroma: float = 0.5,
    cells: tuple[float, ...] = CELLS,
) -> NDArray[np.uint8]:
    """`[height, width, 3]` a flat picture of noise; the other arguments are those of `speckle_at`."""
    if width < 1 or height < 1 or not metres_per_texel > 0.0:
        raise ValueError(f"a texture must be at least 1x1 px, got {width}x{height} at {metres_per_texel} m")
    x, y = np.meshgrid(np.arange(width) * metres_per_texel, np.arange(height) * metres_per_texel)
    points = np.stack([x, y], axis=-1).astype(np.float64)
    return speckle_at(points, rng, colour=colour, contrast=contrast, chroma=chroma, cells=cells)


def speckle_shape(
    shape: Shape,
    rng: np.random.Generator,
    *,
    metres_per_texel: float = 0.004,
    colour: tuple[float, float, float] = (0.5, 0.5, 0.5),
    contrast: float = 0.32,
    chroma: float = 0.5,
    cells: tuple[float, ...] = CELLS,
) -> NDArray[np.uint8]:
    """`[H, W, 3]` the texture of a shape, even and without seams, for `surface_mesh` to wrap round it."""
    points = atlas_points(shape, *atlas_pixels(shape, metres_per_texel))
    return speckle_at(points, rng, colour=colour, contrast=contrast, chroma=chroma, cells=cells)


def speckle_flat(
    size: tuple[float, float],
    rng: np.random.Generator,
    *,
    metres_per_texel: float = 0.004,
    colour: tuple[float, float, float] = (0.5, 0.5, 0.5),
    contrast: float = 0.32,
    chroma: float = 0.5,
    cells: tuple[float, ...] = CELLS,
) -> NDArray[np.uint8]:
    """`[H, W, 3]` the texture of a flat rectangle of `size` [m]: `speckle` many times as fast, on lattices not turned.

    The noise is the same blend of lattice values, along one axis and then along the other. Cells are at least two
    texels wide.
    """
    width, height = (max(1, round(side / metres_per_texel)) for side in size)
    total = np.zeros((height, width, 4), np.float32)
    for cell in (max(cell, 2.0 * metres_per_texel) for cell in cells):
        (i, s), (j, t) = ((_blend(n, metres_per_texel, cell, rng)) for n in (height, width))
        lattice = rng.random((i[-1] + 2, j[-1] + 2, 4), dtype=np.float32) - np.float32(0.5)
        rows = lattice[i] * (np.float32(1.0) - s[:, None, None]) + lattice[i + 1] * s[:, None, None]
        total += rows[:, j] * (np.float32(1.0) - t[:, None]) + rows[:, j + 1] * t[:, None]
    return _coloured(total[..., :1], total[..., 1:], 2, len(cells), colour, contrast, chroma)


def _blend(
    count: int, metres_per_texel: float, cell: float, rng: np.random.Generator
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """`[count]` the lattice point before each texel, and the smoothstep weight of the one after it."""
    at = np.arange(count) * (metres_per_texel / cell) + rng.random()
    index = np.floor(at).astype(np.intp)
    t = (at - index).astype(np.float32)
    return index, (t * t * (np.float32(3.0) - np.float32(2.0) * t)).astype(np.float32)


def write_png(image: NDArray[np.uint8], path: Path, *, colours: int | None = None) -> None:
    """Writes an RGB image as PNG; the same image gives the same bytes.

    With `colours` (2 to 256) it is reduced to a palette first, without dither: a third of the size.
    """
    from PIL import Image

    picture = Image.fromarray(image)
    if colours is not None:
        picture = picture.quantize(colours, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    picture.save(path, format="PNG", optimize=True)
