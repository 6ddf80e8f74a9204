"""Gauss-Newton on a fly's window (Lucas and Kanade, 1981): the step that evolution alone would take many tries for."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from flysim.flies.fitness import visible, warp

MAX_STEP_PX = 1.5  # no corner of the window moves further than the image's slope can foretell
DONE_PX = 0.005
SLOPE_DAMPING = 0.02  # a window with one edge tells depth, but not its slopes


@njit(cache=True)
def descend(left, right, u, v, q, qu, qv, to_right, shift, half, q_near, q_far, slanted, steps):
    """(q, qu, qv) after up to `steps` steps down the squared difference of the grey windows.

    The slopes move only if `slanted`. A step that leaves the view or the searched depths is not taken.
    """
    height, width = right.shape
    for _ in range(steps):
        w = warp(u, v, q, qu, qv, to_right, shift)
        # How the right projection moves with inverse depth [px m].
        e = warp(u, v, q * 1.01, qu, qv, to_right, shift)
        du, dv = (e[0] - w[0]) / (0.01 * q), (e[1] - w[1]) / (0.01 * q)
        speed = math.hypot(du, dv)
        if not (speed > 0.0 and visible(w, width, height, half + 1)):
            break
        s00, s01, s02, s11, s12, s22, g0, g1, g2 = _normal_equations(left, right, u, v, w, du / speed, dv / speed, half)
        if slanted:
            damp = SLOPE_DAMPING * s00 * half * half
            step, step_u, step_v = _solve3(s00, s01, s02, s11 + damp, s12, s22 + damp, g0, g1, g2)
        elif s00 > 0.0:
            step, step_u, step_v = g0 / s00, 0.0, 0.0
        else:
            break
        reach = max(abs(step), half * abs(step_u), half * abs(step_v))  # [px]
        if not math.isfinite(reach):
            break
        scale = min(1.0, MAX_STEP_PX / reach) / speed if reach > 0.0 else 0.0
        if not q_far <= q + scale * step <= q_near:
            break
        q, qu, qv = q + scale * step, qu + scale * step_u, qv + scale * step_v
        if reach < DONE_PX:
            break
    return q, qu, qv


@njit(cache=True)
def _normal_equations(left, right, u, v, w, nu, nv, half):
    """Sums of slope * (1, i, j) against itself and against the difference, over the window; (nu, nv) is the way."""
    ur, vr, a, b, c, d = w
    s00 = s01 = s02 = s11 = s12 = s22 = g0 = g1 = g2 = np.float32(0.0)
    half_ = np.float32(0.5)
    rows, columns = right.shape
    level = nv == 0.0 and c == 0.0 and d == 1.0 and vr == math.floor(vr)  # rectified: no slope across is needed
    wu, wv = np.float32(nu), np.float32(nv)
    for j in range(-half, half + 1):
        for i in range(-half, half + 1):
            x, y = ur + a * i + b * j, vr + c * i + d * j
            x0, y0 = int(x), int(y)
            fx, fy = np.float32(x - x0), np.float32(y - y0)
            west, east = max(x0 - 1, 0), min(x0 + 2, columns - 1)
            r00, r01 = np.float32(right[y0, x0]), np.float32(right[y0, x0 + 1])
            value = r00 + fx * (r01 - r00)
            # Slopes of the right image, interpolated between central differences.
            g = r01 - np.float32(right[y0, west])
            g += fx * (np.float32(right[y0, east]) - r00 - g)
            # The mean of both images' slopes: the estimate then has no bias towards whole pixels.
            g += np.float32(left[v + j, u + i + 1]) - np.float32(left[v + j, u + i - 1])
            slope = half_ * half_ * g * wu
            if not level:
                r10, r11 = np.float32(right[y0 + 1, x0]), np.float32(right[y0 + 1, x0 + 1])
                value += fy * (r10 + fx * (r11 - r10) - value)
                north, south = max(y0 - 1, 0), min(y0 + 2, rows - 1)
                h = r10 - np.float32(right[north, x0])
                h += fy * (np.float32(right[south, x0]) - r00 - h)
                h += np.float32(left[v + j + 1, u + i]) - np.float32(left[v + j - 1, u + i])
                slope += half_ * half_ * h * wv
            e = np.float32(left[v + j, u + i]) - value
            square, product = slope * slope, slope * e
            fi, fj = np.float32(i), np.float32(j)
            s00 += square
            s01 += square * fi
            s02 += square * fj
            s11 += square * fi * fi
            s12 += square * fi * fj
            s22 += square * fj * fj
            g0 += product
            g1 += product * fi
            g2 += product * fj
    return s00, s01, s02, s11, s12, s22, g0, g1, g2


@njit(cache=True)
def _solve3(s00, s01, s02, s11, s12, s22, g0, g1, g2):
    """Solution of a symmetric 3x3 system by its adjugate; NaN where it has none."""
    c00, c01, c02 = s11 * s22 - s12 * s12, s02 * s12 - s01 * s22, s01 * s12 - s02 * s11
    det = s00 * c00 + s01 * c01 + s02 * c02
    if not det > 0.0:
        return math.nan, math.nan, math.nan
    c11, c12, c22 = s00 * s22 - s02 * s02, s01 * s02 - s00 * s12, s00 * s11 - s01 * s01
    return (
        (c00 * g0 + c01 * g1 + c02 * g2) / det,
        (c01 * g0 + c11 * g1 + c12 * g2) / det,
        (c02 * g0 + c12 * g1 + c22 * g2) / det,
    )
