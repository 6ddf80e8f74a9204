"""After evolution: each survivor at sub-pixel depth, and tested for the ways in which a window can lie."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flysim.compute.compiled import by_rows, compiled, kernel
from flysim.compute.vectors import COLUMNS, add, byte, differences
from flysim.flies.fitness import ENDLESS, NOISE
from flysim.flies.tuning import RefineParams
from flysim.stereo.descent import descend
from flysim.stereo.windows import ONE, SCALE, bilinear, parallax, squared_difference, visible, warp

EVERY_ROW = np.int64(1)  # numba compiles a function once more for a number that stands in the call
# What a settled fly may fail, in the order in which it is asked; a verdict is a place in this list, 0 for a good one.
TESTS = ("", "out of view", "uniqueness", "left_right", "misfit", "an empty half")
LONGEST = 8192.0  # [px] of an epipolar line that is searched
GOOD, OUT_OF_VIEW, RIVAL, NO_WAY_BACK, MISFIT, HALF_EMPTY = (np.int64(k) for k in range(6))


@compiled
def gradient_energy(views, u, v, half):
    """Mean squared gradient along the epipolar line [(grey levels / px)^2] of a window, and of its emptiest half."""
    total = west = east = north = south = 0.0
    middle = 1 if half > 1 else 0  # columns that belong to no half: Sobel's gradient reaches one pixel beyond its own
    image, wide = views.grey_left, views.width
    du, dv = views.el0 - u * views.el2, views.el1 - v * views.el2
    length = math.sqrt(du * du + dv * dv) + 1e-12
    du, dv = du / length, dv / length
    for j in range(-half, half + 1):
        for i in range(-half, half + 1):
            at = (v + j) * wide + u + i
            nw, ne = byte(image, at - wide - 1), byte(image, at - wide + 1)
            sw, se = byte(image, at + wide - 1), byte(image, at + wide + 1)
            across = ne + se - nw - sw + 2 * (byte(image, at + 1) - byte(image, at - 1))
            down = sw + se - nw - ne + 2 * (byte(image, at + wide) - byte(image, at - wide))
            e = (across * du + down * dv) / 8.0
            e *= e
            total += e
            if i < -middle:
                west += e
            elif i > middle:
                east += e
            if j < -middle:
                north += e
            elif j > middle:
                south += e
    side = 2 * half + 1
    return total / (side * side), min(west, east, north, south) / (side * (half - middle))


@compiled
def mean_difference(views, u, v, w, half, limit):
    """Mean squared colour difference [grey levels^2]; above `limit`, any number above it."""
    unit = 3.0 * (2 * half + 1) * (2 * half + 1) * SCALE * SCALE
    most = int(limit * unit) if limit < 65536.0 else ENDLESS
    return squared_difference(views, u, v, w, half, most) / unit


@compiled
def curve(views, u, v, first, half, n, found):
    """Fills `found[:n]` with the grey windows' mean squared difference at right columns `first`, `first + 1`, ...

    For rectified pairs, windows that face the camera. `found` has room for a multiple of `vectors.COLUMNS`.
    """
    wide, right_wide, side = views.width, views.right_width, 2 * half + 1
    at, start = (v - half) * wide + u - half, (v - half) * right_wide + first - half
    differences(views.grey_left, views.grey_right, at, start, wide, right_wide, side, n, found)
    for k in range(n):
        found[k] /= np.float32(side * side)


@compiled
def slow_curve(views, u, v, q_first, gain, half, n, found):
    """As `curve` for any pair: `found[k]` is at inverse depth `q_first - k / gain`; inf out of view."""
    area = (2 * half + 1) * (2 * half + 1)
    for k in range(n):
        w = warp(views, u, v, q_first - k / gain, 0.0, 0.0)
        found[k] = math.inf
        if not visible(views, w, half):
            continue
        total = 0
        for j in range(-half, half + 1):
            for i in range(-half, half + 1):
                x = int((w.u + w.ui * i + w.uj * j) * 65536.0 + 0.5)
                y = int((w.v + w.vi * i + w.vj * j) * 65536.0 + 0.5)
                at = (y >> 16) * views.right_width + (x >> 16)
                value = bilinear(views.grey_right, at, ONE, views.right_width, x, y)
                e = (byte(views.grey_left, (v + j) * views.width + u + i) << 8) - value
                total += e * e
        found[k] = total / (area * SCALE * SCALE)


def _gain_by_rows(views, rules, u, v):
    return views.gain


def _gain_of_any(views, rules, u, v):
    # It falls or rises over all depths: the fastest is at one end.
    fastest = max(parallax(views, u, v, rules.q_near)[2], parallax(views, u, v, rules.q_far)[2])
    return fastest if fastest > 0.0 else views.gain  # NaN where the nearest depth lies behind the right camera


# Pixels that a left pixel's projection moves along its epipolar line for 1/m of inverse depth, at most.
gain_at = by_rows(_gain_by_rows, _gain_of_any)


def _columns_by_rows(views, rules, u, v, found):
    half, gain = rules.half, views.gain
    far, near = warp(views, u, v, rules.q_far, 0.0, 0.0).u, warp(views, u, v, rules.q_near, 0.0, 0.0).u
    first, last = math.ceil(near), math.floor(far)
    if first < half + 1:
        first = half + 1
    if last > views.right_width - 2 - half:
        last = views.right_width - 2 - half
    n = last - first + 1 if last >= first else 0
    curve(views, u, v, first, half, n, found)
    return n, rules.q_far + (far - first) / gain


def _columns_of_any(views, rules, u, v, found):
    # The same places as above where the pair is rectified: those at whole columns, from the near end on.
    gain = gain_at(views, rules, u, v)
    near = warp(views, u, v, rules.q_near, 0.0, 0.0).u
    q_first = rules.q_near - (math.ceil(near) - near) / gain if near > -math.inf else rules.q_near
    n = min(max(int((q_first - rules.q_far) * gain + 1e-9) + 1, 1), len(found))
    slow_curve(views, u, v, q_first, gain, rules.half, n, found)
    return n, q_first


# (n, q_first): `found[:n]` is filled with a curve over all searched depths, from inverse depth `q_first` on.
all_columns = by_rows(_columns_by_rows, _columns_of_any)


def most_columns(views: NDArray[np.void], rules: NDArray[np.void]) -> int:
    """Room that `all_columns` needs; a pair that is not level may move some pixels twice as fast as others."""
    searched = (float(rules["q_near"][0]) - float(rules["q_far"][0])) * float(views["gain"][0])
    if "level" not in (views.dtype.names or ()):
        searched *= 2.0
    return max(int(views["right_width"][0]), int(searched) + 3) + COLUMNS


@compiled
def has_rival(views, rules, u, v, q, limit, allowance, found):
    """Whether another place on the epipolar line differs by less than `limit`, in colour.

    It is looked for pixel by pixel, in grey, with windows that face the camera. The least of a valley that is below
    `limit + allowance`, what a place half a pixel off would leave, is moved to its own least before it is judged.
    `found` is scratch for `most_columns` floats.
    """
    half, gain, here = rules.half, gain_at(views, rules, u, v), parallax(views, u, v, q)[2]
    n, q_first = all_columns(views, rules, u, v, found)
    for k in range(n):
        valley = (k == 0 or found[k - 1] >= found[k]) and (k == n - 1 or found[k + 1] > found[k])
        if not valley or found[k] >= limit + allowance:
            continue
        there = q_first - k / gain
        if abs(there - q) * here < rules.same_match or not rules.q_far <= there <= rules.q_near:
            continue
        there, nu, nv = descend(views, rules, u, v, there, 0.0, 0.0, rules.rival_steps, EVERY_ROW)
        if abs(there - q) * here < rules.same_match:
            continue
        w = warp(views, u, v, there, nu, nv)
        if visible(views, w, half) and mean_difference(views, u, v, w, half, limit) < limit:
            return True
    return False


class Finished(NamedTuple):
    """What `finish` fills, of each fly.

    Attributes:
        genes: `[N, 3]`, refined in place.
        own: `[N]` mean squared difference where it is, inf out of view [grey levels^2].
        energy: `[N, 2]` of `gradient_energy`.
        verdict: `[N]` int8, a place in TESTS.
    """

    genes: np.ndarray
    own: np.ndarray
    energy: np.ndarray
    verdict: np.ndarray


@kernel
def finish(lane, counters, all_views, all_back, all_rules, scratch, pixels, finished, uniqueness, left_right):
    """Refines flies and judges each on its own.

    A fly is a RIVAL's where another place on its epipolar line differs by less than `uniqueness` times what it does
    itself, 0 turns that off; NO_WAY_BACK where the best match of its right pixel in the left image lies further than
    `left_right` px from it. `all_back` is the pair with left and right exchanged, None: the latter is off, and not
    compiled. `scratch` has `most_columns` float32 for each lane, `counters[0]` the flies that were taken.
    """
    genes, own, energy, verdict = finished.genes, finished.own, finished.energy, finished.verdict
    views, rules = all_views[0], all_rules[0]
    while True:
        n = add(counters, 0, 1)
        if n >= len(pixels):
            return
        u, v = np.int64(pixels[n, 0]), np.int64(pixels[n, 1])
        energy[n, 0], energy[n, 1] = gradient_energy(views, u, v, rules.half)
        qu, qv = genes[n, 1], genes[n, 2]
        if energy[n, 1] < rules.empty_half * energy[n, 0]:  # it does not tell slopes: those that were bred are chance
            qu, qv = 0.0, 0.0
        q, qu, qv = descend(views, rules, u, v, genes[n, 0], qu, qv, rules.steps, EVERY_ROW)
        genes[n, 0], genes[n, 1], genes[n, 2] = q, qu, qv
        w = warp(views, u, v, q, qu, qv)
        own[n], verdict[n] = math.inf, OUT_OF_VIEW
        if not visible(views, w, rules.half):
            continue
        own[n] = mean_difference(views, u, v, w, rules.half, math.inf)
        verdict[n] = GOOD
        if uniqueness > 0.0:
            limit = uniqueness * (own[n] + NOISE)
            if has_rival(views, rules, u, v, q, limit, 0.25 * energy[n, 0], scratch[lane]):
                verdict[n] = RIVAL
        # Nested: numba leaves out what stands behind a None.
        if all_back is not None:  # noqa: SIM102
            if verdict[n] == GOOD and not comes_back(views, all_back[0], rules, u, v, q, w, left_right):
                verdict[n] = NO_WAY_BACK


@kernel
def refined(lane, counters, all_views, all_rules, pixels, genes, moved):
    """Refines `genes` `[N, 3]` of flies near their place already; `moved` `[N]` by how far [px], inf out of view.

    `counters[0]` counts the flies that were taken.
    """
    views, rules = all_views[0], all_rules[0]
    while True:
        n = add(counters, 0, 1)
        if n >= len(pixels):
            return
        u, v = np.int64(pixels[n, 0]), np.int64(pixels[n, 1])
        q, qu, qv = descend(views, rules, u, v, genes[n, 0], genes[n, 1], genes[n, 2], rules.steps, EVERY_ROW)
        moved[n] = abs(q - genes[n, 0]) * parallax(views, u, v, q)[2]
        genes[n, 0], genes[n, 1], genes[n, 2] = q, qu, qv
        if not visible(views, warp(views, u, v, q, qu, qv), rules.half):
            moved[n] = math.inf


@compiled
def comes_back(views, back, rules, u, v, q, w, most):
    """Whether the best match of a fly's right pixel, sought in the left image, is the fly's own to `most` px."""
    x, y, half = math.floor(w.u + 0.5), math.floor(w.v + 0.5), rules.half
    if not (half < x < back.width - half - 1 and half < y < back.height - half - 1):
        return False
    # The fly's depth in the right camera: the third coordinate of its projection.
    q_right = q / (views.m20 * u + views.m21 * v + views.m22 + q * views.s2)
    gain = gain_at(back, rules, x, y)
    near = rules.q_near + 1.0 / gain
    searched = (near - rules.q_far) * gain
    if not searched < LONGEST:  # a camera that moved ahead may pass what is nearest: it is seen at no pixel, or at all
        return True
    found = np.empty(int(searched) + 2, np.float32)
    slow_curve(back, x, y, near, gain, half, len(found), found)
    best = 0
    for k in range(len(found)):
        if found[k] < found[best]:
            best = k
    off = abs(near - best / gain - q_right) * parallax(back, x, y, q_right)[2]
    return off <= most + 0.5  # half a pixel is the search's step


def judge(finished: Finished, misfit: float, refine: RefineParams) -> None:
    """Writes into the verdicts that are GOOD: whether a whole window matches, and all its halves hold contrast.

    A window that hangs over a silhouette can match by the part on the nearer surface alone; its difference is then
    large for the contrast it holds, which `misfit` pixels of misplacement explain. What the cameras' noise adds to
    every difference is read off the swarm itself.
    """
    own, energy, verdict = finished.own, finished.energy, finished.verdict
    if misfit <= 0.0 or len(own) == 0:
        return
    n, ranked = len(own), np.sort(own)  # the median, which numpy takes ten times as long for
    noise = 0.5 * (float(ranked[(n - 1) // 2]) + float(ranked[n // 2]))
    # Differences that are not finite are out of view already.
    fits = own <= misfit**2 * energy[:, 0] + refine.noise_allowance * noise + NOISE
    verdict[(verdict == GOOD) & ~fits] = MISFIT
    full = energy[:, 1] >= refine.empty_half * energy[:, 0]
    if full.mean() >= refine.sparse:
        verdict[(verdict == GOOD) & ~full] = HALF_EMPTY
