"""After evolution: each survivor moved to sub-pixel depth, and dropped if another place matches as well."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange

from flysim.flies.fitness import mean_squared_difference, project_right, visible

GAUSS_NEWTON_STEPS = 4
MAX_STEP_PX = 1.0
# Places nearer than this on the epipolar line belong to the same match, not to a rival one [px].
SAME_MATCH_PX = 2.5


@njit(cache=True, parallel=True)
def refine(left, right, to_right, shift, u, v, q, half, q_near, q_far):
    """Moves each fly along its ray to the least squared difference, by Gauss-Newton on the window (Lucas and Kanade).

    Fills q in place. A step that leaves the view or the searched depths is not taken.
    """
    right_height, right_width = right.shape[:2]
    for i in prange(len(u)):
        for _ in range(GAUSS_NEWTON_STEPS):
            ur, vr = project_right(u[i], v[i], q[i], to_right, shift)
            # How the right projection moves with inverse depth [px m].
            eu, ev = project_right(u[i], v[i], q[i] * 1.01, to_right, shift)
            du, dv = (eu - ur) / (0.01 * q[i]), (ev - vr) / (0.01 * q[i])
            speed = math.hypot(du, dv)
            if not (speed > 0.0 and visible(ur, vr, right_width, right_height, half + 1)):
                break
            nu, nv = du / speed, dv / speed
            u0, v0 = int(ur), int(vr)
            a, b = ur - u0, vr - v0
            num, den = 0.0, 0.0
            for j in range(-half, half + 1):
                for k in range(-half, half + 1):
                    for c in range(3):
                        value, slope_u, slope_v = _sample(right, u0 + k, v0 + j, c, a, b)
                        slope = slope_u * nu + slope_v * nv
                        # The mean of both images' slopes: the estimate then has no bias towards whole pixels.
                        sl = 0.5 * (float(left[v[i] + j, u[i] + k + 1, c]) - float(left[v[i] + j, u[i] + k - 1, c]))
                        st = 0.5 * (float(left[v[i] + j + 1, u[i] + k, c]) - float(left[v[i] + j - 1, u[i] + k, c]))
                        slope = 0.5 * (slope + sl * nu + st * nv)
                        num += slope * (float(left[v[i] + j, u[i] + k, c]) - value)
                        den += slope * slope
            if den <= 0.0:
                break
            step = max(-MAX_STEP_PX, min(MAX_STEP_PX, num / den))
            moved = q[i] + step / speed
            if not q_far <= moved <= q_near:
                break
            q[i] = moved
            if abs(step) < 0.005:
                break


@njit(cache=True)
def _sample(image, u0, v0, c, a, b):
    """Bilinear value and central-difference slopes at (u0 + a, v0 + b)."""
    value = (1.0 - b) * _row(image, u0, v0, c, a) + b * _row(image, u0, v0 + 1, c, a)
    slope_u = 0.5 * (
        (1.0 - b) * (_row(image, u0 + 1, v0, c, a) - _row(image, u0 - 1, v0, c, a))
        + b * (_row(image, u0 + 1, v0 + 1, c, a) - _row(image, u0 - 1, v0 + 1, c, a))
    )
    below = (1.0 - b) * _row(image, u0, v0 + 1, c, a) + b * _row(image, u0, min(v0 + 2, image.shape[0] - 1), c, a)
    above = (1.0 - b) * _row(image, u0, v0 - 1, c, a) + b * _row(image, u0, v0, c, a)
    return value, slope_u, 0.5 * (below - above)


@njit(cache=True)
def _row(image, u, v, c, a):
    w = image.shape[1]
    return (1.0 - a) * float(image[v, max(0, min(u, w - 1)), c]) + a * float(image[v, max(0, min(u + 1, w - 1)), c])


@njit(cache=True, parallel=True)
def rival_difference(left, right, to_right, shift, u, v, q, half, q_near, q_far, disparity_gain):
    """`[N]` least mean squared difference elsewhere on each fly's epipolar line, in whole-pixel steps; inf if none."""
    right_height, right_width = right.shape[:2]
    steps = int(math.ceil((q_near - q_far) * disparity_gain)) + 1
    best = np.full(len(u), np.inf, np.float32)
    for i in prange(len(u)):
        for k in range(steps):
            there = q_far + (q_near - q_far) * k / max(steps - 1, 1)
            if abs(there - q[i]) * disparity_gain < SAME_MATCH_PX:
                continue
            ur, vr = project_right(u[i], v[i], there, to_right, shift)
            if visible(ur, vr, right_width, right_height, half):
                d = mean_squared_difference(left, right, u[i], v[i], ur, vr, half)
                best[i] = min(best[i], d)
    return best


@njit(cache=True, parallel=True)
def own_difference(left, right, to_right, shift, u, v, q, half):
    """`[N]` mean squared difference of each fly where it is; inf out of view."""
    right_height, right_width = right.shape[:2]
    out = np.full(len(u), np.inf, np.float32)
    for i in prange(len(u)):
        ur, vr = project_right(u[i], v[i], q[i], to_right, shift)
        if visible(ur, vr, right_width, right_height, half):
            out[i] = mean_squared_difference(left, right, u[i], v[i], ur, vr, half)
    return out
