"""Eq. (1): how alike a fly's two projections are, and how much there is to see there."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

OUT_OF_VIEW = np.float32(-1.0)  # a fly out of either view is rejected, not scored 0
# [grey levels^2] added to the mean squared difference: 8-bit rounding of two images and the blur of one
# interpolation leave about this much on a perfect match, and eq. (1) has a pole there.
NOISE = 1.0


@njit(cache=True)
def project_right(u: float, v: float, q: float, to_right, shift) -> tuple[float, float]:
    """The right pixel of a fly; NaN where it lies behind the right camera."""
    h2 = to_right[2, 0] * u + to_right[2, 1] * v + to_right[2, 2] + q * shift[2]
    if h2 <= 1e-9:
        return math.nan, math.nan
    h0 = to_right[0, 0] * u + to_right[0, 1] * v + to_right[0, 2] + q * shift[0]
    h1 = to_right[1, 0] * u + to_right[1, 1] * v + to_right[1, 2] + q * shift[1]
    return h0 / h2, h1 / h2


@njit(cache=True)
def visible(ur: float, vr: float, width: int, height: int, half: int) -> bool:
    """Whether the window about a right pixel, with its bilinear neighbours, lies in the image. NaN is outside."""
    return ur >= half and vr >= half and ur < width - 1 - half and vr < height - 1 - half


@njit(cache=True)
def mean_squared_difference(left, right, u: int, v: int, ur: float, vr: float, half: int) -> float:
    """Denominator of eq. (1) as a mean: squared colour differences over the window [grey levels^2].

    The left window lies on whole pixels, the right one is interpolated bilinearly.
    """
    u0, v0 = int(ur), int(vr)
    a, b = np.float32(ur - u0), np.float32(vr - v0)
    one = np.float32(1.0)
    total = np.float32(0.0)
    if b == 0.0:  # a rectified pair: rows meet rows, one interpolation is enough
        for j in range(-half, half + 1):
            for i in range(-half, half + 1):
                for c in range(3):
                    r0 = np.float32(right[v0 + j, u0 + i, c])
                    r1 = np.float32(right[v0 + j, u0 + i + 1, c])
                    d = np.float32(left[v + j, u + i, c]) - (r0 + a * (r1 - r0))
                    total += d * d
    else:
        for j in range(-half, half + 1):
            for i in range(-half, half + 1):
                for c in range(3):
                    r00 = np.float32(right[v0 + j, u0 + i, c])
                    r01 = np.float32(right[v0 + j, u0 + i + 1, c])
                    r10 = np.float32(right[v0 + j + 1, u0 + i, c])
                    r11 = np.float32(right[v0 + j + 1, u0 + i + 1, c])
                    top = r00 + a * (r01 - r00)
                    d = np.float32(left[v + j, u + i, c]) - ((one - b) * top + b * (r10 + a * (r11 - r10)))
                    total += d * d
    side = 2 * half + 1
    return total / np.float32(3 * side * side)


@njit(cache=True)
def fitness_of(left, right, gradient_left, gradient_right, u: int, v: int, ur: float, vr: float, half: int) -> float:
    """Eq. (1) on a fly in view: product of the two gradients over the mean squared difference.

    With gradients in levels per pixel the value is about 1 / e^2, e the misplacement in pixels.
    """
    gr = gradient_right[int(vr + 0.5), int(ur + 0.5)]
    difference = mean_squared_difference(left, right, u, v, ur, vr, half)
    return gradient_left[v, u] * gr / (difference + NOISE)  # eq. (1)


@njit(cache=True, parallel=True)
def evaluate(left, right, gradient_left, gradient_right, to_right, shift, u, v, q, half, fitness, first):
    """Fills `fitness[first:]` for flies (u, v, q); OUT_OF_VIEW where a window leaves either image."""
    height, width = left.shape[:2]
    right_height, right_width = right.shape[:2]
    for i in prange(first, len(u)):
        ur, vr = project_right(u[i], v[i], q[i], to_right, shift)
        inside = u[i] >= half and v[i] >= half and u[i] < width - half and v[i] < height - half
        if inside and q[i] > 0.0 and visible(ur, vr, right_width, right_height, half):
            fitness[i] = fitness_of(left, right, gradient_left, gradient_right, u[i], v[i], ur, vr, half)
        else:
            fitness[i] = OUT_OF_VIEW
