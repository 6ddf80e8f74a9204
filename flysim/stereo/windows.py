"""A fly's two windows: where the right one lies, what it holds, and how it differs from the left one."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from flysim.compute.compiled import by_rows, compiled, inlined
from flysim.compute.vectors import byte, fetch, row, sobel

SCALE = 256.0  # of a sample
SOBEL = 8.0  # what its kernel sums to over a ramp of 1 level/px
ONE, THREE = np.int64(1), np.int64(3)  # samples from one pixel to the next, in grey and in colour


class Warp(NamedTuple):
    """Where a fly's window lies in the right image: the left pixel (u0 + i, v0 + j) falls on
    (u + ui i + uj j, v + vi i + vj j) [px].
    """

    u: float
    v: float
    ui: float
    uj: float
    vi: float
    vj: float


def _warp_along_rows(views, u, v, q, qu, qv):
    # The same as below with the figures of a pair whose rows meet, of which all others are 0 or 1.
    return Warp(u + views.m02 + q * views.s0, float(v), 1.0 + qu * views.s0, qv * views.s0, 0.0, 1.0)


def _warp_any(views, u, v, q, qu, qv):
    h2 = views.m20 * u + views.m21 * v + views.m22 + q * views.s2
    if not h2 > 1e-9:
        return Warp(math.nan, math.nan, 1.0, 0.0, 0.0, 1.0)
    ur = (views.m00 * u + views.m01 * v + views.m02 + q * views.s0) / h2
    vr = (views.m10 * u + views.m11 * v + views.m12 + q * views.s1) / h2
    h2u, h2v = views.m20 + qu * views.s2, views.m21 + qv * views.s2
    a = (views.m00 + qu * views.s0 - ur * h2u) / h2
    b = (views.m01 + qv * views.s0 - ur * h2v) / h2
    c = (views.m10 + qu * views.s1 - vr * h2u) / h2
    d = (views.m11 + qv * views.s1 - vr * h2v) / h2
    return Warp(ur, vr, a, b, c, d)


_warp = by_rows(_warp_along_rows, _warp_any)


@compiled
def warp(views, u, v, q, qu, qv):
    """The right pixel of a fly, and how its window maps there to first order: the derivative of the homography that the
    fly's plane induces (Hartley and Zisserman, section 13.1). NaN where the fly lies behind the right camera.
    """
    return _warp(views, u, v, q, qu, qv)


@compiled
def visible(views, w, half):
    """Whether the warped window, with its bilinear neighbours, lies in the right image. NaN is outside."""
    reach_u, reach_v = half * (abs(w.ui) + abs(w.uj)) + 0.001, half * (abs(w.vi) + abs(w.vj)) + 0.001
    in_columns = w.u - reach_u >= 0.0 and w.u + reach_u < views.right_width - 1.0
    return in_columns and w.v - reach_v >= 0.0 and w.v + reach_v < views.right_height - 1.0


@inlined
def fetch_windows(views, u, v, w, half):
    """Asks for the memory of both windows: each row is another cache line, and they are read one after the other."""
    at = ((v - half) * views.width + u - half) * 3
    right_at = (int(w.v - half) * views.right_width + int(w.u - half)) * 3
    for _ in range(2 * half + 1):
        fetch(views.left, at)
        fetch(views.right, right_at)
        at += 3 * views.width
        right_at += 3 * views.right_width


@compiled
def squared_difference(views, u, v, w, half, most):
    """Sum over window and colours of (256 (left - right))^2, the right window interpolated bilinearly.

    Once the sum exceeds `most` the rest of the window is left out, and what is returned is any number above `most`.
    """
    total, j = 0, -half
    for _ in range(2 * half + 1):
        total += difference_of_row(views, u, v, w, half, j)
        if total > most:
            break
        j += 2  # every second row first: those beside each other tell much the same
        if j > half:
            j -= 2 * half + 1
    return total


@inlined
def corner(w, half, j):
    """Where the row `j` of a warped window begins [1/65536 px]."""
    x = int((w.u + w.uj * j - w.ui * half) * 65536.0)
    return x, int((w.v + w.vj * j - w.vi * half) * 65536.0 + 0.5)


def _parallax_along_rows(views, u, v, q):
    return views.s0, 0.0, -views.s0  # the right camera is on the right: s0 is below 0


def _parallax_any(views, u, v, q):
    h2 = views.m20 * u + views.m21 * v + views.m22 + q * views.s2
    ur = (views.m00 * u + views.m01 * v + views.m02 + q * views.s0) / h2
    vr = (views.m10 * u + views.m11 * v + views.m12 + q * views.s1) / h2
    du, dv = (views.s0 - ur * views.s2) / h2, (views.s1 - vr * views.s2) / h2
    return du, dv, math.sqrt(du * du + dv * dv)


_parallax = by_rows(_parallax_along_rows, _parallax_any)


@compiled
def parallax(views, u, v, q):
    """How fast the right projection of a left pixel moves with inverse depth [px m]: the derivative of `warp` by q.

    Returns:
        Its parts along both axes, and its length: of a pair side by side the focal length times the baseline.
    """
    return _parallax(views, u, v, q)


def _along_the_row(views, u, v, w, half, j):
    at, x = ((v + j) * views.width + u - half) * 3, int((w.u + w.uj * j - w.ui * half) * 65536.0)
    return row(views.left, views.right, at, (v + j) * views.right_width, x, int(w.ui * 65536.0), 2 * half + 1)


def _across_rows(views, u, v, w, half, j):
    left, right, columns = views.left, views.right, views.right_width
    at = ((v + j) * views.width + u - half) * 3
    x, y = corner(w, half, j)
    total = 0
    for _ in range(2 * half + 1):
        r = ((y >> 16) * columns + (x >> 16)) * 3
        for k in range(3):
            e = (byte(left, at + k) << 8) - bilinear(right, r + k, THREE, 3 * columns, x, y)
            total += e * e
        at += 3
        x += int(w.ui * 65536.0)
        y += int(w.vi * 65536.0)
    return total


difference_of_row = by_rows(_along_the_row, _across_rows)


@compiled
def bilinear(image, at, beside, below, x, y):
    """256 times the value at (x, y) [1/65536 px]; `at` is the place of the pixel up and left of it."""
    f, g = (x >> 8) & 255, (y >> 8) & 255
    p, s = byte(image, at), byte(image, at + below)
    over = (p << 8) + f * (byte(image, at + beside) - p)
    under = (s << 8) + f * (byte(image, at + below + beside) - s)
    return over + ((g * (under - over)) >> 8)


@inlined
def sums(views, u, v, w, half):
    """Sums over window and colours of L, R, L L, R R, L R as floats, L and R the samples of both windows."""
    columns = views.right_width
    sl = sr = sll = srr = slr = 0
    step_x, step_y = int(w.ui * 65536.0), int(w.vi * 65536.0)
    for j in range(-half, half + 1):
        at = ((v + j) * views.width + u - half) * 3
        x, y = corner(w, half, j)
        for _ in range(2 * half + 1):
            r = ((y >> 16) * columns + (x >> 16)) * 3
            for k in range(3):
                one, other = byte(views.left, at + k) << 8, bilinear(views.right, r + k, THREE, 3 * columns, x, y)
                sl, sr = sl + one, sr + other
                sll, srr, slr = sll + one * one, srr + other * other, slr + one * other
            at += 3
            x += step_x
            y += step_y
    unit = SCALE * SCALE
    return sl / SCALE, sr / SCALE, sll / unit, srr / unit, slr / unit


@compiled
def gradient(image, width, height, u, v, e0, e1, e2, norm):
    """Sobel's gradient at a pixel [grey levels / px], root mean square over the colours.

    Along the line to the epipole (e0, e1, e2), or its norm in all directions if `norm`. The border is repeated.
    """
    du, dv = e0 - u * e2, e1 - v * e2
    length = math.sqrt(du * du + dv * dv) + 1e-12
    du, dv = du / length, dv / length
    here, middle = v * width * 3, u * 3
    north, south = here - width * 3 if v > 0 else here, here + width * 3 if v < height - 1 else here
    west, east = middle - 3 if u > 0 else middle, middle + 3 if u < width - 1 else middle
    total = 0.0
    for k in range(3):
        nw, ne = byte(image, north + west + k), byte(image, north + east + k)
        sw, se = byte(image, south + west + k), byte(image, south + east + k)
        gx = float(ne + se - nw - sw + 2 * (byte(image, here + east + k) - byte(image, here + west + k)))
        gy = float(sw + se - nw - ne + 2 * (byte(image, south + middle + k) - byte(image, north + middle + k)))
        along = gx * du + gy * dv
        total += gx * gx + gy * gy if norm else along * along
    return math.sqrt(total / 3.0) / SOBEL


@inlined
def gradient_along_row(image, width, height, u, v):
    """As `gradient`, along the row."""
    row = 3 * width
    squares = sobel(
        image, v * row + 3 * u, -row if v > 0 else 0, row if v < height - 1 else 0,
        -3 if u > 0 else 0, 3 if u < width - 1 else 0,
    )  # fmt: skip
    return math.sqrt(squares / 3.0) / SOBEL


def _gradient_left_by_rows(views, u, v, norm):
    if norm:
        return gradient(views.left, views.width, views.height, u, v, views.el0, views.el1, views.el2, norm)
    return gradient_along_row(views.left, views.width, views.height, u, v)


def _gradient_left_of_any(views, u, v, norm):
    return gradient(views.left, views.width, views.height, u, v, views.el0, views.el1, views.el2, norm)


def _gradient_right_by_rows(views, u, v, norm):
    wide, high = views.right_width, views.right_height
    if norm:
        return gradient(views.right, wide, high, u, v, views.er0, views.er1, views.er2, norm)
    return gradient_along_row(views.right, wide, high, u, v)


def _gradient_right_of_any(views, u, v, norm):
    wide, high = views.right_width, views.right_height
    return gradient(views.right, wide, high, u, v, views.er0, views.er1, views.er2, norm)


# `gradient` of each image, along the line to where the other camera is seen in it.
gradient_left = by_rows(_gradient_left_by_rows, _gradient_left_of_any)
gradient_right = by_rows(_gradient_right_by_rows, _gradient_right_of_any)
