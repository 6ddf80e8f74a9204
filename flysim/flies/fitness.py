"""Eq. (1): how alike a fly's two projections are, and how much there is to see there.

A fly is a left pixel (u, v), the inverse depth q [1/m] at it, and the slopes (qu, qv) [1/m/px] of the inverse depth of
its surface: on a plane, inverse depth is affine in the pixel. A fly with slopes 0 is the paper's: its neighbourhood is
taken to face the camera.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

OUT_OF_VIEW = np.float32(-1.0)  # a fly out of either view is rejected, not scored 0
# [grey levels^2] added to the mean squared difference: 8-bit rounding of two images and the blur of one
# interpolation leave about this much on a perfect match, and eq. (1) has a pole there.
NOISE = 0.25


@njit(cache=True)
def warp(u, v, q, qu, qv, to_right, shift):
    """(ur, vr, a, b, c, d): the right pixel of a fly, and how its window maps there to first order.

    The left pixel (u + i, v + j) falls on (ur + a i + b j, vr + c i + d j): the derivative of the homography that the
    fly's plane induces (Hartley and Zisserman, section 13.1). NaN where the fly lies behind the right camera.
    """
    h2 = to_right[2, 0] * u + to_right[2, 1] * v + to_right[2, 2] + q * shift[2]
    if not h2 > 1e-9:
        return math.nan, math.nan, 1.0, 0.0, 0.0, 1.0
    ur = (to_right[0, 0] * u + to_right[0, 1] * v + to_right[0, 2] + q * shift[0]) / h2
    vr = (to_right[1, 0] * u + to_right[1, 1] * v + to_right[1, 2] + q * shift[1]) / h2
    h2u, h2v = to_right[2, 0] + qu * shift[2], to_right[2, 1] + qv * shift[2]
    a = (to_right[0, 0] + qu * shift[0] - ur * h2u) / h2
    b = (to_right[0, 1] + qv * shift[0] - ur * h2v) / h2
    c = (to_right[1, 0] + qu * shift[1] - vr * h2u) / h2
    d = (to_right[1, 1] + qv * shift[1] - vr * h2v) / h2
    return ur, vr, a, b, c, d


@njit(cache=True)
def visible(w, width, height, half):
    """Whether the warped window, with its bilinear neighbours, lies in the right image. NaN is outside."""
    ur, vr, a, b, c, d = w
    reach_u, reach_v = half * (abs(a) + abs(b)), half * (abs(c) + abs(d))
    in_columns = ur - reach_u >= 0.0 and ur + reach_u < width - 1.0
    return in_columns and vr - reach_v >= 0.0 and vr + reach_v < height - 1.0


@njit(cache=True)
def mean_squared_difference(left, right, u, v, w, half, limit):
    """Denominator of eq. (1) as a mean: squared colour differences over the window [grey levels^2].

    The left window lies on whole pixels, the right one (`w` of `warp`) is interpolated bilinearly. Once the mean is
    sure to exceed `limit` the rest of the window is left out, and what is returned is any number above `limit`.
    """
    ur, vr, a, b, c, d = w
    side = 2 * half + 1
    count = np.float32(3 * side * side)
    most = np.float32(limit) * count
    total = np.float32(0.0)
    rows_meet = c == 0.0 and d == 1.0 and vr == math.floor(vr)  # rectified: one interpolation is enough
    for j in range(-half, half + 1):
        for i in range(-half, half + 1):
            x, y = ur + a * i + b * j, vr + c * i + d * j
            x0, y0 = int(x), int(y)
            fx, fy = np.float32(x - x0), np.float32(y - y0)
            for k in range(3):
                r00 = np.float32(right[y0, x0, k])
                r = r00 + fx * (np.float32(right[y0, x0 + 1, k]) - r00)
                if not rows_meet:
                    r10 = np.float32(right[y0 + 1, x0, k])
                    r += fy * (r10 + fx * (np.float32(right[y0 + 1, x0 + 1, k]) - r10) - r)
                e = np.float32(left[v + j, u + i, k]) - r
                total += e * e
        if total > most:
            break
    return total / count


@njit(cache=True)
def fitness_of(left, right, gradient_left, gradient_right, u, v, w, half):
    """Eq. (1) on a fly in view: the product of both gradients over the mean squared difference.

    With gradients in levels per pixel the value is about 1 / e^2, e the misplacement in pixels.
    """
    gradients = gradient_left[v, u] * gradient_right[int(w[1] + 0.5), int(w[0] + 0.5)]
    return gradients / (mean_squared_difference(left, right, u, v, w, half, np.inf) + NOISE)  # eq. (1)
