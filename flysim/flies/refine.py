"""After evolution: each survivor moved to sub-pixel depth, and tested against its rivals on the epipolar line."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from flysim.flies.fitness import mean_squared_difference, visible, warp

MAX_STEP_PX = 1.5
DONE_PX = 0.005
# Places nearer than this on the epipolar line belong to the same match, not to a rival one [px].
SAME_MATCH_PX = 2.5


@njit(cache=True, parallel=True)
def refine(left, right, to_right, shift, pixels, genes, half, q_near, q_far, slanted, steps):
    """Moves each fly along its ray to the least squared difference, by Gauss-Newton on its window (Lucas and Kanade).

    Fills `genes` `[N, 3]` float64 in place; the slopes move too if `slanted`. A step that leaves the view or the
    searched depths is not taken.
    """
    right_height, right_width = right.shape[:2]
    for n in prange(len(pixels)):
        u, v = pixels[n, 0], pixels[n, 1]
        q, qu, qv = genes[n, 0], genes[n, 1], genes[n, 2]
        for _ in range(steps):
            w = warp(u, v, q, qu, qv, to_right, shift)
            # How the right projection moves with inverse depth [px m].
            e = warp(u, v, q * 1.01, qu, qv, to_right, shift)
            du, dv = (e[0] - w[0]) / (0.01 * q), (e[1] - w[1]) / (0.01 * q)
            speed = math.hypot(du, dv)
            if not (speed > 0.0 and visible(w[0], w[1], w[2], w[3], w[4], w[5], right_width, right_height, half + 1)):
                break
            s00, s01, s02, s11, s12, s22, g0, g1, g2 = _normal_equations(left, right, u, v, w, du, dv, half)
            if slanted:
                # Damped: a window with one edge tells depth, but not its slopes.
                damp = 0.02 * s00 * half * half
                step, step_u, step_v = _solve3(s00, s01, s02, s11 + damp, s12, s22 + damp, g0, g1, g2)
            elif s00 > 0.0:
                step, step_u, step_v = g0 / s00, 0.0, 0.0
            else:
                break
            # No corner of the window moves by more than the image's slope can foretell.
            reach = speed * max(abs(step), half * abs(step_u), half * abs(step_v))
            if not math.isfinite(reach):
                break
            if reach > MAX_STEP_PX:
                shrink = MAX_STEP_PX / reach
                step, step_u, step_v = shrink * step, shrink * step_u, shrink * step_v
            if not q_far <= q + step <= q_near:
                break
            q, qu, qv = q + step, qu + step_u, qv + step_v
            if reach < DONE_PX:
                break
        genes[n, 0], genes[n, 1], genes[n, 2] = q, qu, qv


@njit(cache=True)
def _normal_equations(left, right, u, v, w, du, dv, half):
    """Sums of slope * (1, i, j) against itself and the difference, over the window and colours."""
    ur, vr, a, b, c, d = w
    s00 = s01 = s02 = s11 = s12 = s22 = g0 = g1 = g2 = 0.0
    rows, columns = right.shape[:2]
    for j in range(-half, half + 1):
        for i in range(-half, half + 1):
            x, y = ur + a * i + b * j, vr + c * i + d * j
            x0, y0 = int(x), int(y)
            fx, fy = x - x0, y - y0
            ul, ur_, vu, vd = max(x0 - 1, 0), min(x0 + 2, columns - 1), max(y0 - 1, 0), min(y0 + 2, rows - 1)
            for k in range(3):
                r00, r01 = float(right[y0, x0, k]), float(right[y0, x0 + 1, k])
                r10, r11 = float(right[y0 + 1, x0, k]), float(right[y0 + 1, x0 + 1, k])
                value = (1.0 - fy) * (r00 + fx * (r01 - r00)) + fy * (r10 + fx * (r11 - r10))
                # Slopes of the right image, interpolated between central differences.
                gx = 0.5 * ((1.0 - fx) * (r01 - float(right[y0, ul, k])) + fx * (float(right[y0, ur_, k]) - r00))
                gy = 0.5 * ((1.0 - fy) * (r10 - float(right[vu, x0, k])) + fy * (float(right[vd, x0, k]) - r00))
                lx = 0.5 * (float(left[v + j, u + i + 1, k]) - float(left[v + j, u + i - 1, k]))
                ly = 0.5 * (float(left[v + j + 1, u + i, k]) - float(left[v + j - 1, u + i, k]))
                # The mean of both images' slopes: the estimate then has no bias towards whole pixels.
                slope = 0.5 * ((gx + lx) * du + (gy + ly) * dv)
                e = float(left[v + j, u + i, k]) - value
                square, product = slope * slope, slope * e
                s00 += square
                s01 += square * i
                s02 += square * j
                s11 += square * i * i
                s12 += square * i * j
                s22 += square * j * j
                g0 += product
                g1 += product * i
                g2 += product * j
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


@njit(cache=True, parallel=True)
def difference_here(left, right, to_right, shift, pixels, genes, half):
    """`[N]` mean squared difference of each fly where it is; inf out of view."""
    right_height, right_width = right.shape[:2]
    out = np.full(len(pixels), np.inf, np.float32)
    for n in prange(len(pixels)):
        w = warp(pixels[n, 0], pixels[n, 1], genes[n, 0], genes[n, 1], genes[n, 2], to_right, shift)
        if visible(w[0], w[1], w[2], w[3], w[4], w[5], right_width, right_height, half):
            out[n] = mean_squared_difference(
                left, right, pixels[n, 0], pixels[n, 1], w[0], w[1], w[2], w[3], w[4], w[5], half
            )
    return out


@njit(cache=True)
def gradient_energy(gradient_left, pixels, half):
    """`[N, 2]` mean squared gradient [(grey levels / px)^2] of each left window, and of its emptiest half."""
    out = np.empty((len(pixels), 2), np.float32)
    for n in range(len(pixels)):
        u, v = pixels[n, 0], pixels[n, 1]
        total = west = east = north = south = 0.0
        for j in range(-half, half + 1):
            for i in range(-half, half + 1):
                e = gradient_left[v + j, u + i] * gradient_left[v + j, u + i]
                total += e
                if i < -1:  # the gradient reaches one pixel beyond its own
                    west += e
                elif i > 1:
                    east += e
                if j < -1:
                    north += e
                elif j > 1:
                    south += e
        side = 2 * half + 1
        out[n, 0] = total / side**2
        out[n, 1] = min(min(west, east), min(north, south)) / (side * max(half - 1, 1))
    return out


@njit(cache=True, parallel=True)
def difference_elsewhere(left, right, to_right, shift, pixels, genes, half, q_near, q_far, gain):
    """`[N]` least mean squared difference elsewhere on each fly's epipolar line, in whole-pixel steps; inf if none."""
    right_height, right_width = right.shape[:2]
    steps = int(math.ceil((q_near - q_far) * gain)) + 1
    out = np.full(len(pixels), np.inf, np.float32)
    for n in prange(len(pixels)):
        for k in range(steps):
            q = q_far + (q_near - q_far) * k / max(steps - 1, 1)
            if abs(q - genes[n, 0]) * gain < SAME_MATCH_PX:
                continue
            w = warp(pixels[n, 0], pixels[n, 1], q, genes[n, 1], genes[n, 2], to_right, shift)
            if visible(w[0], w[1], w[2], w[3], w[4], w[5], right_width, right_height, half):
                out[n] = min(
                    out[n],
                    mean_squared_difference(
                        left, right, pixels[n, 0], pixels[n, 1], w[0], w[1], w[2], w[3], w[4], w[5], half
                    ),
                )
    return out
