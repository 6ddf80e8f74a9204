"""After evolution: each survivor at sub-pixel depth, and tested for the ways in which a window can lie."""

from __future__ import annotations

import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from flysim.flies.descent import descend
from flysim.flies.fitness import NOISE, mean_squared_difference, visible, warp

STEPS = 5  # Gauss-Newton steps of the last refinement; most flies need three
# Places nearer than this on the epipolar line belong to the same match, not to a rival one [px].
SAME_MATCH_PX = 2.5
RIVAL_STEPS = 3
# Share of the window's mean gradient energy that each of its halves must hold: a half with none is the sky beyond a
# silhouette, which matches itself everywhere.
EMPTY_HALF = 0.02
NOISE_ALLOWANCE = 1.5  # times the swarm's median difference that a good window may have beside its misplacement


@njit(cache=True)
def gradient_energy(gradient, u, v, half):
    """Mean squared gradient [(grey levels / px)^2] of a window, and of its emptiest half."""
    total = west = east = north = south = 0.0
    middle = min(1, half - 1)  # columns that belong to no half: Sobel's gradient reaches one pixel beyond its own
    for j in range(-half, half + 1):
        for i in range(-half, half + 1):
            e = gradient[v + j, u + i] * gradient[v + j, u + i]
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
    return total / side**2, min(min(west, east), min(north, south)) / (side * (half - middle))


@njit(cache=True)
def has_rival(
    left, right, grey_left, grey_right, u, v, q, qu, qv, to_right, shift, half, q_near, q_far, gain, limit, allowance
):  # fmt: skip
    """Whether another place on the epipolar line differs by less than `limit`.

    It is looked for in steps of a pixel. One that differs by less than `limit + allowance`, what a rival half a step
    away would leave, is moved to its own least difference before it is judged.
    """
    height, width = right.shape[:2]
    steps = math.ceil((q_near - q_far) * gain) + 1
    for k in range(steps):
        there = q_far + (q_near - q_far) * k / max(steps - 1, 1)
        if abs(there - q) * gain < SAME_MATCH_PX:
            continue
        w = warp(u, v, there, qu, qv, to_right, shift)
        if not visible(w, width, height, half):
            continue
        difference = mean_squared_difference(left, right, u, v, w, half, limit + allowance)
        if difference < limit:
            return True
        if difference < limit + allowance:
            there, _, _ = descend(
                grey_left, grey_right, u, v, there, qu, qv, to_right, shift, half, q_near, q_far, False, RIVAL_STEPS
            )
            w = warp(u, v, there, qu, qv, to_right, shift)
            apart = abs(there - q) * gain >= SAME_MATCH_PX
            if apart and visible(w, width, height, half):
                difference = mean_squared_difference(left, right, u, v, w, half, limit)
            if difference < limit:
                return True
    return False


@njit(cache=True, parallel=True)
def finish(
    left, right, grey_left, grey_right, gradient_left, to_right, shift, pixels, genes, own, energy, unique, half,
    q_near, q_far, gain, slanted, uniqueness,
):  # fmt: skip
    """Refines `genes` `[N, 3]` in place; fills `own` `[N]`, `energy` `[N, 2]` and `unique` `[N]`.

    `own` is a fly's mean squared difference where it is, inf out of view; `energy` that of `gradient_energy`;
    `unique` tells that no other place on its epipolar line differs by less than `uniqueness` times that.
    """
    right_height, right_width = right.shape[:2]
    for n in prange(len(pixels)):
        u, v = pixels[n, 0], pixels[n, 1]
        q, qu, qv = descend(
            grey_left, grey_right, u, v, genes[n, 0], genes[n, 1], genes[n, 2], to_right, shift, half, q_near, q_far,
            slanted, STEPS,
        )  # fmt: skip
        genes[n, 0], genes[n, 1], genes[n, 2] = q, qu, qv
        w = warp(u, v, q, qu, qv, to_right, shift)
        own[n], unique[n] = math.inf, False
        energy[n, 0], energy[n, 1] = gradient_energy(gradient_left, u, v, half)
        if visible(w, right_width, right_height, half):
            own[n] = mean_squared_difference(left, right, u, v, w, half, math.inf)
            # A rival is half a pixel at most from where it is looked for: that much difference must be forgiven.
            unique[n] = uniqueness <= 0.0 or not has_rival(
                left, right, grey_left, grey_right, u, v, q, qu, qv, to_right, shift, half, q_near, q_far, gain,
                uniqueness * (own[n] + NOISE), 0.25 * energy[n, 0],
            )  # fmt: skip


def honest(own: NDArray[np.float32], energy: NDArray[np.float32], misfit: float) -> NDArray[np.bool_]:
    """Whether a fly's whole window matches where it is, and all its halves hold contrast.

    A window that hangs over a silhouette can match by the part on the nearer surface alone; its difference is then
    large for the contrast it holds. What the cameras' noise adds to every difference is read off the swarm itself.
    """
    if misfit <= 0.0 or len(own) == 0:
        return np.isfinite(own)
    noise = float(np.median(own))
    fits = own <= misfit**2 * energy[:, 0] + NOISE_ALLOWANCE * noise + NOISE
    return np.isfinite(own) & fits & (energy[:, 1] >= EMPTY_HALF * energy[:, 0])
