"""Random values on a lattice, blended at points: the inner loops of textures, compiled.

Every product and sum is rounded on its own and in one order (numba fuses none unless asked to), so that the bits are
the same on every machine.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.compute.compiled import compiled
from flysim.geometry.frames import Array


@compiled
def turned(points: Array, axes: Array) -> tuple[Array, Array, Array]:
    """`[N, D]` coordinates of `[N, D]` points on the rows of `axes` `[D, D]`, with `[D]` least and `[D]` greatest.

    Coordinate k is the sum over d of `points[:, d] * axes[d, k]`.
    """
    count, dimensions = points.shape
    found = np.empty((count, dimensions))
    low, high = np.full(dimensions, np.inf), np.full(dimensions, -np.inf)
    for i in range(count):
        for k in range(dimensions):
            value = 0.0
            for d in range(dimensions):
                value += points[i, d] * axes[d, k]
            found[i, k] = value
            low[k] = min(low[k], value)
            high[k] = max(high[k], value)
    return found, low, high


@compiled
def blended(scaled: Array, low: Array, strides: NDArray[np.int64], values: NDArray[np.float32]) -> NDArray[np.float32]:
    """`[N, C]` the `[P, C]` values of a lattice, blended at `[N, D]` points by the smoothstep polynomial.

    Args:
        scaled: the points, in cells of the lattice.
        low: `[D]` the lattice's first corner.
        strides: `[D]` how far apart neighbours along each axis lie in `values`.
        values: at the corners, the last axis the fastest.
    """
    count, dimensions = scaled.shape
    channels = values.shape[1]
    noise = np.zeros((count, channels), np.float32)
    upper, lower = np.empty(dimensions, np.float32), np.empty(dimensions, np.float32)
    one, two, three = np.float32(1.0), np.float32(2.0), np.float32(3.0)
    for i in range(count):
        first = 0
        for d in range(dimensions):
            place = scaled[i, d] - low[d]
            cell = int(np.floor(place))
            t = np.float32(place - cell)
            t = t * t * (three - two * t)
            upper[d], lower[d] = t, one - t
            first += cell * strides[d]
        for corner in range(1 << dimensions):
            weight, at = one, first
            for d in range(dimensions):
                if corner >> (dimensions - 1 - d) & 1:
                    weight, at = weight * upper[d], at + strides[d]
                else:
                    weight = weight * lower[d]
            for c in range(channels):
                noise[i, c] += weight * values[at, c]
    return noise


@compiled
def coloured(
    noise: NDArray[np.float32],
    mean: NDArray[np.float32],
    gain: np.float32,
    chroma: np.float32,
    darkest: np.float32,
    brightest: np.float32,
) -> NDArray[np.uint8]:
    """`[N, 3]` levels of `[N, 4]` noise about 0: one channel of brightness and three of colour, about a mean RGB.

    Strong blotches near the ends of the range are bent, not cut flat. Square roots are the same on every machine.
    """
    count = len(noise)
    levels = np.empty((count, 3), np.uint8)
    nothing, one, little = np.float32(0.0), np.float32(1.0), np.float32(1e-3)
    for i in range(count):
        for c in range(3):
            mixed = (noise[i, 0] + chroma * noise[i, 1 + c]) * gain
            room = (one - mean[c] if mixed > nothing else mean[c]) + little
            share = mixed / room
            value = mean[c] + mixed / np.sqrt(one + share * share)
            value = min(max(value, nothing), one) * (brightest - darkest) + darkest
            levels[i, c] = np.uint8(np.rint(value))
    return levels
