"""Textures that do not repeat: smooth noise of several sizes and colours, the same for the same generator."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.worlds.shapes import Shape
from flysim.worlds.surface.atlas import atlas_pixels, atlas_points
from flysim.worlds.surface.noise import blended, coloured, turned

CELLS = (0.15, 0.07, 0.032)  # [m] sizes of the blotches: 8 texels of 4 mm and more
# Shading takes colours down and lamps take them up: those in between stay distinct.
DARKEST, BRIGHTEST = 28, 228
MAX_LATTICE = 20_000_000  # points
SAMPLE = 4_000  # pixels that a quick palette is made from, or up to four times as many


def value_noise(points: Array, cell: float, channels: int, rng: np.random.Generator) -> NDArray[np.float32]:
    """`[..., channels]` smooth noise in [0, 1] at `[..., D]` points: random values on a lattice.

    Between its points, `cell` apart, they are blended with the smoothstep polynomial: there are no edges. The
    lattice is turned at random, so that it is not seen.
    """
    dimensions = points.shape[-1]
    # Gram-Schmidt in the form of sums and square roots: the same bits on every machine.
    turn = np.zeros((dimensions, dimensions))
    for row, vector in enumerate(rng.uniform(-1.0, 1.0, (dimensions, dimensions))):
        for other in turn[:row]:
            vector = vector - other * (other * vector).sum()
        turn[row] = vector / np.sqrt((vector * vector).sum())
    scaled, least, greatest = turned(np.ascontiguousarray(points.reshape(-1, dimensions), np.float64), turn / cell)
    low = np.floor(least) - 1.0
    counts = (np.ceil(greatest) - low + 2.0).astype(int)
    if counts.prod() > MAX_LATTICE:
        raise ValueError(f"cells of {cell} m are too small for a surface of that size: make them larger")
    values = rng.random((*counts, channels), dtype=np.float32).reshape(-1, channels)
    strides = np.append(np.cumprod(counts[:0:-1])[::-1], 1)
    return blended(scaled, low, strides, values).reshape(*points.shape[:-1], channels)


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
    total = np.zeros((*points.shape[:-1], 4), np.float32)
    for cell in cells:
        total += value_noise(points, cell, 4, rng) - np.float32(0.5)
    return _coloured(total, points.shape[-1], len(cells), colour, contrast, chroma)


def _coloured(
    noise: NDArray[np.float32],
    dimensions: int,
    sizes: int,
    colour: tuple[float, float, float],
    contrast: float,
    chroma: float,
) -> NDArray[np.uint8]:
    """`[..., 3]` colours of `[..., 4]` noise about 0, summed over some sizes of cells."""
    # The noise of one cell size has a standard deviation of about 0.2 (2-D) or 0.15 (3-D).
    gain = np.float32(contrast / (0.2 if dimensions == 2 else 0.15) / math.sqrt(sizes))
    gain /= np.float32(math.sqrt(1.0 + chroma**2))
    levels = np.float32(DARKEST), np.float32(BRIGHTEST)
    picture = coloured(noise.reshape(-1, 4), np.array(colour, np.float32), gain, np.float32(chroma), *levels)
    return picture.reshape(*noise.shape[:-1], 3)


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
    return _coloured(total, 2, len(cells), colour, contrast, chroma)


def _blend(
    count: int, metres_per_texel: float, cell: float, rng: np.random.Generator
) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
    """`[count]` the lattice point before each texel, and the smoothstep weight of the one after it."""
    at = np.arange(count) * (metres_per_texel / cell) + rng.random()
    index = np.floor(at).astype(np.intp)
    t = (at - index).astype(np.float32)
    return index, (t * t * (np.float32(3.0) - np.float32(2.0) * t)).astype(np.float32)


def write_png(image: NDArray[np.uint8], path: Path, *, colours: int | None = None, quick: bool = False) -> None:
    """Writes an RGB image as PNG; the same image gives the same bytes.

    With `colours` (2 to 256) it is reduced to a palette first, without dither: a third of the size. `quick` takes a
    tenth of the time and errs by up to a tenth more: the palette is that of some thousands of pixels, evenly spread,
    and colours are looked up to 3 bits less.
    """
    from PIL import Image

    picture = Image.fromarray(image)
    if colours is not None:
        step = max(1, math.isqrt(image.shape[0] * image.shape[1] // SAMPLE)) if quick else 1
        sample = Image.fromarray(np.ascontiguousarray(image[::step, ::step]))
        picture = sample.quantize(colours, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        if quick:
            palette = np.array(picture.getpalette(), np.uint8).reshape(-1, 3)
            indices = nearest_colours(image, palette)
            picture = Image.frombytes("P", (image.shape[1], image.shape[0]), indices.tobytes())
            picture.putpalette(palette.tobytes())
    picture.save(path, format="PNG", optimize=True)


def nearest_colours(image: NDArray[np.uint8], palette: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """`[H, W]` for each pixel the index of a colour of `[K, 3]` that is nearest to it, or to one 4 levels off it."""
    level = np.arange(4, 256, 8, dtype=np.int32)[:, None]
    red, green, blue = ((level - palette[:, c].astype(np.int32)) ** 2 for c in range(3))
    nearest = (red[:, None, None] + green[:, None] + blue).argmin(axis=-1).astype(np.uint8)
    cell = image >> 3
    return nearest[cell[..., 0], cell[..., 1], cell[..., 2]]
