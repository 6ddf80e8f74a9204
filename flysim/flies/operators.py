"""The genetic operators of section 3.1: barycentric crossover, Gaussian mutation, immigration."""

from __future__ import annotations

import math

import numpy as np

from flysim.flies.compiled import compiled, inlined
from flysim.flies.randomness import gaussian, uniform
from flysim.flies.windows import visible, warp

GAUSSIAN = np.int64(0)  # not heavy-tailed
CROSSOVER, MUTATION, IMMIGRATION = 0, 1, 2
TRIES = 16  # draws before a child becomes an immigrant, and an immigrant is given up
DRAWS_A_TRY = 32
RIVAL_DRAW = 24  # draws from a parent's to its rival's, behind all others of a try
FOLD_SHARE = 0.25  # of mutations that step over an edge onto a face with another slant
MUTATED_SLOPE = 0.1  # standard deviation of the other mutations' change of slope, as a share of the steepest


# What of the parameters the kernels read, in their units.
RULES = np.dtype(
    [
        ("norm", np.int64),  # of eq. (1): by `fitness.code`
        ("half", np.int64),  # of the window [px]
        ("q_near", np.float64),  # [1/m]
        ("q_far", np.float64),  # [1/m]
        ("beyond", np.float64),  # how far a crossover may lie beyond its parents, as a share of their distance
        ("contest", np.int64),  # a parent is the fitter of two
        ("metric", np.int64),  # mutate in space rather than in the image
        ("heavy", np.int64),  # mutations have heavy tails
        ("mutation", np.float64),  # standard deviation of a mutation [m or px]
        ("mutation_q", np.float64),  # standard deviation of an image mutation in inverse depth [1/m]
        ("steepest", np.float64),  # slope of inverse depth [1/m/px]; 0 for flies that all face the camera
        ("polish", np.int64),  # Gauss-Newton steps on a promising child
        ("promising", np.float64),  # fitness from which a child is polished
        ("sharp", np.float64),  # fitness from which there is nothing left to polish
    ]
)


@compiled
def crossed(u1, v1, q1, u2, v2, q2, share):
    """(u, v, q) of the heir OF = share OF1 + (1 - share) OF2, taken in metric space, as the paper's vectors are."""
    z1, z2 = 1.0 / q1, 1.0 / q2
    z = share * z1 + (1.0 - share) * z2
    if not z > 0.0:  # extrapolated behind the camera
        return u1, v1, -1.0
    # A pixel times its depth is linear in the 3-D point, so the barycentre can be taken there.
    u = (share * u1 * z1 + (1.0 - share) * u2 * z2) / z
    v = (share * v1 * z1 + (1.0 - share) * v2 * z2) / z
    return u, v, 1.0 / z


@compiled
def slanted(steepest, state, n):
    """(qu, qv) of a random face: a third faces the camera, a third leans sideways, a third back or forth."""
    axis = 3.0 * uniform(state, n)
    slope = steepest * (2.0 * uniform(state, n + 1) - 1.0)
    return (slope if 1.0 <= axis < 2.0 else 0.0), (slope if axis >= 2.0 else 0.0)


@compiled
def mutated(views, rules, u, v, q, qu, qv, state, n):
    """(u, v, q, qu, qv) after a random step, in space or in the image; q < 0 behind the camera."""
    g1 = rules.mutation * gaussian(state, n, rules.heavy)
    g2 = rules.mutation * gaussian(state, n + 4, rules.heavy)
    g3 = gaussian(state, n + 8, rules.heavy)
    if rules.metric:
        depth = 1.0 / q + rules.mutation * g3
        if depth <= 0.0:
            return u, v, -1.0, qu, qv
        x = ((u - views.cx) / (views.fx * q) + g1) / depth
        y = ((v - views.cy) / (views.fy * q) + g2) / depth
        return views.cx + views.fx * x, views.cy + views.fy * y, 1.0 / depth, qu, qv
    # Sideways the child keeps to its parent's plane, or folds onto another half-way.
    nu, nv = qu, qv
    if rules.steepest > 0.0:
        if uniform(state, n + 12) < FOLD_SHARE:
            nu, nv = slanted(rules.steepest, state, n + 13)
        else:
            nu += MUTATED_SLOPE * rules.steepest * gaussian(state, n + 15, GAUSSIAN)
            nv += MUTATED_SLOPE * rules.steepest * gaussian(state, n + 19, GAUSSIAN)
    q += 0.5 * (qu + nu) * g1 + 0.5 * (qv + nv) * g2 + rules.mutation_q * g3
    return u + g1, v + g2, q, nu, nv


@inlined
def parent(rules, parents, count, fitness, state, n):
    """One of the first `count` parents: any, or the fitter of any two."""
    one = parents[int(uniform(state, n) * count)]
    if rules.contest:
        rival = parents[int(uniform(state, n + RIVAL_DRAW) * count)]
        if fitness[rival] > fitness[one]:
            return rival
    return one


@inlined
def child(views, rules, kind, rect, parents, count, pixels, genes, fitness, state):
    """(u, v, q, qu, qv) of one child, inside its region, the searched depths and both views.

    Parents are drawn from the first `count` of the region's `parents`. A child that would lie outside is drawn again;
    after TRIES it becomes an immigrant. Left pixels are whole: a fly on a pixel's ray is as good a 3-D point as one
    between, and the left window needs no interpolation. One pixel beyond the window is left free.
    """
    half = rules.half
    u0 = rect[0] if rect[0] > half else half + 1
    v0 = rect[2] if rect[2] > half else half + 1
    u1, v1 = views.width - half - 1, views.height - half - 1
    u1, v1 = rect[1] if rect[1] < u1 else u1, rect[3] if rect[3] < v1 else v1
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
            q = rules.q_far + uniform(state, n + 2) * (rules.q_near - rules.q_far)  # uniform in disparity
            qu, qv = slanted(rules.steepest, state, n + 3)
        else:
            one = parent(rules, parents, count, fitness, state, n)
            x, y, q = float(pixels[one, 0]), float(pixels[one, 1]), float(genes[one, 0])
            qu, qv = float(genes[one, 1]), float(genes[one, 2])
            if kind == CROSSOVER:
                other = parent(rules, parents, count, fitness, state, n + 1)
                share = uniform(state, n + 2) * (1.0 + 2.0 * rules.beyond) - rules.beyond
                x, y, q = crossed(x, y, q, float(pixels[other, 0]), float(pixels[other, 1]), genes[other, 0], share)
                qu = share * qu + (1.0 - share) * genes[other, 1]
                qv = share * qv + (1.0 - share) * genes[other, 2]
            else:
                x, y, q, qu, qv = mutated(views, rules, x, y, q, qu, qv, state, n + 1)
            cu, cv = math.floor(x + 0.5), math.floor(y + 0.5)
        if u0 <= cu < u1 and v0 <= cv < v1 and rules.q_far <= q <= rules.q_near:
            if visible(views, warp(views, cu, cv, q, qu, qv), half):
                break
            # What leaves the right view by its slant alone may stay as a fly that faces the camera.
            if visible(views, warp(views, cu, cv, q, 0.0, 0.0), half):
                qu, qv = 0.0, 0.0
                break
        q = -1.0  # after the last try there is no child
    return cu, cv, q, qu, qv
