"""Gauss-Newton on a fly's window (Lucas and Kanade, 1981): the step that evolution alone would take many tries for."""

from __future__ import annotations

import math
from typing import NamedTuple

from flysim.compute.compiled import by_rows, compiled, inlined
from flysim.compute.vectors import byte, slopes
from flysim.stereo.windows import ONE, bilinear, corner, parallax, visible, warp


class NormalEquations(NamedTuple):
    """Of the least squares step in (depth, its slope along i, along j): sums over a window of slope^2 times 1, i, j
    times 1, i, j, and of slope times difference times 1, i, j.
    """

    s00: float
    s01: float
    s02: float
    s11: float
    s12: float
    s22: float
    g0: float
    g1: float
    g2: float


@compiled
def descend(views, rules, u, v, q, qu, qv, steps, stride):
    """(q, qu, qv) after up to `steps` steps down the squared difference of the grey windows.

    Only every `stride`-th row of the window is read. The slopes move only if flies may lean. A step that leaves the
    view or the searched depths is not taken.
    """
    half = rules.half
    for _ in range(steps):
        w = warp(views, u, v, q, qu, qv)
        if not visible(views, w, half + 1):
            break
        du, dv, speed = parallax(views, u, v, q)
        if not speed > 0.0:
            break
        sums = normal_equations(views, u, v, w, du / speed, dv / speed, half, stride)
        if rules.steepest > 0.0:
            step, step_u, step_v = solved(sums, rules.slope_damping * sums.s00 * half * half)
        elif sums.s00 > 0.0:
            step, step_u, step_v = sums.g0 / sums.s00, 0.0, 0.0
        else:
            break
        reach = max(abs(step), half * abs(step_u), half * abs(step_v))  # [px]
        if not math.isfinite(reach):
            break
        scale = (rules.most_step / reach if reach > rules.most_step else 1.0) / speed
        if not rules.q_far <= q + scale * step <= rules.q_near:
            break
        q, qu, qv = q + scale * step, qu + scale * step_u, qv + scale * step_v
        if reach < rules.done:
            break
    return q, qu, qv


def _along_rows(views, u, v, w, nu, nv, half, stride):
    # nu is -1 here, so that all is whole numbers over 16: no sum is rounded, whatever its order.
    square, way = nu * nu / 16.0, nu / 4.0  # what it calls slope is four times that of 256 levels
    s, si, sj, sii, sij, sjj, d, di, dj = slopes(
        views.grey_left, views.grey_right, v * views.width + u - half, v * views.right_width,
        views.width, views.right_width, w.u, w.ui, w.uj, half, stride,
    )  # fmt: skip
    return NormalEquations(
        s * square, si * square, sj * square, sii * square, sij * square, sjj * square, d * way, di * way, dj * way
    )


def _across_rows(views, u, v, w, nu, nv, half, stride):
    s00 = s01 = s02 = s11 = s12 = s22 = g0 = g1 = g2 = 0.0
    for j in range(-half, half + 1, stride):
        s, si, sii, d, di = slopes_of_row(views, u, v, w, nu, nv, half, j)
        s00 += s
        s01 += si
        s02 += s * j
        s11 += sii
        s12 += si * j
        s22 += s * (j * j)
        g0 += d
        g1 += di
        g2 += d * j
    return NormalEquations(s00, s01, s02, s11, s12, s22, g0, g1, g2)


# Those of a window; (nu, nv) is the direction in which its right pixel moves with depth.
normal_equations = by_rows(_along_rows, _across_rows)


@inlined
def slopes_of_row(views, u, v, w, nu, nv, half, j):
    """Sums over a window's row of slope^2 times 1, i, i^2, and of slope times difference times 1, i."""
    left, right = views.grey_left, views.grey_right
    wide, columns, rows = views.width, views.right_width, views.right_height
    s00 = s01 = s11 = g0 = g1 = 0.0
    at = (v + j) * wide + u - half
    x, y = corner(w, half, j)
    for i in range(-half, half + 1):
        x0, row = x >> 16, (y >> 16) * columns
        f, g = (x >> 8) & 255, (y >> 8) & 255
        # Slopes of the right image, interpolated between central differences.
        p, e = byte(right, row + x0), byte(right, row + x0 + 1)
        west = e - byte(right, row + max(x0 - 1, 0))
        east = byte(right, row + min(x0 + 2, columns - 1)) - p
        north = byte(right, row + columns + x0) - byte(right, max((y >> 16) - 1, 0) * columns + x0)
        south = byte(right, min((y >> 16) + 2, rows - 1) * columns + x0) - p
        # The mean of both images' slopes: the estimate then has no bias towards whole pixels.
        across = (west << 8) + f * (east - west) + ((byte(left, at + 1) - byte(left, at - 1)) << 8)
        down = (north << 8) + g * (south - north) + ((byte(left, at + wide) - byte(left, at - wide)) << 8)
        slope = 0.25 * (across * nu + down * nv)
        difference = float((byte(left, at) << 8) - bilinear(right, row + x0, ONE, columns, x, y))
        square, product = slope * slope, slope * difference
        s00 += square
        s01 += square * i
        s11 += square * (i * i)
        g0 += product
        g1 += product * i
        at += 1
        x += int(w.ui * 65536.0)
        y += int(w.vi * 65536.0)
    return s00, s01, s11, g0, g1


@inlined
def solved(sums, damp):
    """(step, step_u, step_v) of normal equations, by the adjugate; NaN where there is none.

    `damp` is added to what the slopes are told by.
    """
    s00, s01, s02, s12, g0, g1, g2 = sums.s00, sums.s01, sums.s02, sums.s12, sums.g0, sums.g1, sums.g2
    s11, s22 = sums.s11 + damp, sums.s22 + damp
    c00, c01, c02 = s11 * s22 - s12 * s12, s02 * s12 - s01 * s22, s01 * s12 - s02 * s11
    det = s00 * c00 + s01 * c01 + s02 * c02
    if not det > 0.0:
        return math.nan, math.nan, math.nan
    c11, c12, c22 = s00 * s22 - s02 * s02, s01 * s02 - s00 * s12, s00 * s11 - s01 * s01
    g0, g1, g2 = g0 / det, g1 / det, g2 / det
    return c00 * g0 + c01 * g1 + c02 * g2, c01 * g0 + c11 * g1 + c12 * g2, c02 * g0 + c12 * g1 + c22 * g2
