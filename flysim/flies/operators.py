"""The genetic operators of section 3.1: barycentric crossover, Gaussian mutation, immigration."""

from __future__ import annotations

import numpy as np
from numba import njit

from flysim.flies.fitness import visible, warp
from flysim.flies.randomness import gaussian, uniform

CROSSOVER, MUTATION, IMMIGRATION = 0, 1, 2
TRIES = 32  # draws before a child becomes an immigrant, and an immigrant is given up
DRAWS_A_TRY = 16
FOLD_SHARE = 0.25  # of mutations that step over an edge onto a face with another slant
MUTATED_SLOPE = 0.1  # standard deviation of the other mutations' change of slope, as a share of the steepest


@njit(cache=True)
def crossed(u1, v1, q1, u2, v2, q2, share):
    """(u, v, q) of the heir OF = share OF1 + (1 - share) OF2, taken in metric space, as the paper's vectors are."""
    z1, z2 = 1.0 / q1, 1.0 / q2
    z = share * z1 + (1.0 - share) * z2
    # A pixel times its depth is linear in the 3-D point, so the barycentre can be taken there.
    u = (share * u1 * z1 + (1.0 - share) * u2 * z2) / z
    v = (share * v1 * z1 + (1.0 - share) * v2 * z2) / z
    return u, v, 1.0 / z


@njit(cache=True)
def slanted(steepest, state, n):
    """(qu, qv) of a random face: a third faces the camera, a third leans sideways, a third back or forth."""
    axis = uniform(state, n)
    slope = steepest * (2.0 * uniform(state, n + 1) - 1.0)
    if axis < 1.0 / 3.0:
        return 0.0, 0.0
    return (slope, 0.0) if axis < 2.0 / 3.0 else (0.0, slope)


@njit(cache=True)
def moved(u, v, q, sigma, K, state, n):
    """(u, v, q) after a Gaussian step of `sigma` metres in each coordinate of the left optical frame; q < 0 behind."""
    depth = 1.0 / q + sigma * gaussian(state, n)
    if depth <= 0.0:
        return u, v, -1.0
    x = ((u - K[0, 2]) / (K[0, 0] * q) + sigma * gaussian(state, n + 2)) / depth
    y = ((v - K[1, 2]) / (K[1, 1] * q) + sigma * gaussian(state, n + 4)) / depth
    return K[0, 2] + K[0, 0] * x, K[1, 2] + K[1, 1] * y, 1.0 / depth


@njit(cache=True)
def child(
    state, kind, region, rects, parents, first_parent, last_parent, pixels, genes, to_right, shift, half, size,
    right_size, q_near, q_far, gain, K, metric, mutation, mutation_disparity, slant,
):  # fmt: skip
    """(u, v, q, qu, qv) of one child, inside its region, the searched depths and both views.

    Parents are drawn uniformly from the region's survivors. A child that would lie outside is drawn again; after
    TRIES it becomes an immigrant. Left pixels are whole: a fly on a pixel's ray is as good a 3-D point as one
    between, and the left window needs no interpolation.
    """
    steepest = slant / gain
    u0, u1 = max(rects[region, 0], half), min(rects[region, 1], size[0] - half)
    v0, v1 = max(rects[region, 2], half), min(rects[region, 3], size[1] - half)
    count = last_parent - first_parent
    if count == 0:
        kind = IMMIGRATION
    cu, cv, q, qu, qv = -1, -1, 0.0, 0.0, 0.0
    for attempt in range(2 * TRIES):
        if attempt == TRIES:
            kind = IMMIGRATION
        n = attempt * DRAWS_A_TRY
        if kind == IMMIGRATION:
            cu = u0 + int(uniform(state, n) * (u1 - u0))
            cv = v0 + int(uniform(state, n + 1) * (v1 - v0))
            q = q_far + uniform(state, n + 2) * (q_near - q_far)  # uniform in disparity
            qu, qv = slanted(steepest, state, n + 3)
        else:
            a = parents[first_parent + int(uniform(state, n) * count)]
            ua, va, qa = pixels[a, 0], pixels[a, 1], genes[a, 0]
            qu, qv = genes[a, 1], genes[a, 2]
            if kind == CROSSOVER:
                b = parents[first_parent + int(uniform(state, n + 1) * count)]
                share = uniform(state, n + 2)
                x, y, q = crossed(ua, va, qa, pixels[b, 0], pixels[b, 1], genes[b, 0], share)
                qu = share * qu + (1.0 - share) * genes[b, 1]
                qv = share * qv + (1.0 - share) * genes[b, 2]
            elif metric:
                x, y, q = moved(ua, va, qa, mutation, K, state, n + 1)
            else:
                x = ua + mutation * gaussian(state, n + 1)
                y = va + mutation * gaussian(state, n + 3)
                # Sideways the child keeps to its parent's plane, or folds onto another half-way.
                nu, nv = qu, qv
                if slant > 0.0:
                    if uniform(state, n + 7) < FOLD_SHARE:
                        nu, nv = slanted(steepest, state, n + 8)
                    else:
                        nu += MUTATED_SLOPE * steepest * gaussian(state, n + 10)
                        nv += MUTATED_SLOPE * steepest * gaussian(state, n + 12)
                q = qa + 0.5 * (qu + nu) * (x - ua) + 0.5 * (qv + nv) * (y - va)
                q += mutation_disparity / gain * gaussian(state, n + 5)
                qu, qv = nu, nv
            cu, cv = int(np.floor(x + 0.5)), int(np.floor(y + 0.5))
        if u0 <= cu < u1 and v0 <= cv < v1 and q_far <= q <= q_near:
            if visible(warp(cu, cv, q, qu, qv, to_right, shift), right_size[0], right_size[1], half):
                break
            # What leaves the right view by its slant alone may stay as a fly that faces the camera.
            if visible(warp(cu, cv, q, 0.0, 0.0, to_right, shift), right_size[0], right_size[1], half):
                qu, qv = 0.0, 0.0
                break
    # After the last try the child stays as it is; its evaluation rejects it if it is out of view.
    return cu, cv, q, qu, qv
