"""The genetic operators of section 3.1: barycentric crossover, Gaussian mutation, immigration."""

from __future__ import annotations

import math

import numpy as np

from flysim.compute.compiled import compiled, inlined
from flysim.compute.randomness import gaussian, high, low, word
from flysim.stereo.windows import visible, warp

GAUSSIAN = np.int64(0)  # not heavy-tailed
CROSSOVER, MUTATION, IMMIGRATION = 0, 1, 2
TRIES = 16  # draws before a child becomes an immigrant, and an immigrant is given up
DRAWS_A_TRY = 16
RIVALS = 12  # the draw of a tournament's rivals, behind all others of a try
STEPS = 1 << 32  # of a number drawn from half a word
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
    # A pixel times its depth is linear in the 3-D point, so the barycentre can be taken there; all times q1 q2.
    depth = share * q2 + (1.0 - share) * q1
    if not depth > 0.0:  # extrapolated behind the camera
        return u1, v1, -1.0
    one, over = share * q2 / depth, 1.0 - share * q2 / depth
    return one * u1 + over * u2, one * v1 + over * v2, q1 * q2 / depth


@inlined
def slanted(steepest, bits):
    """(qu, qv) of a random face: a third faces the camera, a third leans sideways, a third back or forth."""
    axis = low(bits, 3)
    slope = steepest * ((2.0 / STEPS) * high(bits, STEPS) - 1.0)
    return (slope if axis == 1 else 0.0), (slope if axis == 2 else 0.0)


@compiled
def mutated(views, rules, u, v, q, qu, qv, folds, state, n):
    """(u, v, q, qu, qv) after a random step, in space or in the image; q < 0 behind the camera.

    One that `folds` takes a new slant half-way, where flies may lean.
    """
    g1 = rules.mutation * gaussian(state, n, rules.heavy)
    g2 = rules.mutation * gaussian(state, n + 2, rules.heavy)
    g3 = gaussian(state, n + 4, rules.heavy)
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
        if folds:
            nu, nv = slanted(rules.steepest, word(state, n + 6))
        else:
            nu += MUTATED_SLOPE * rules.steepest * gaussian(state, n + 6, GAUSSIAN)
            nv += MUTATED_SLOPE * rules.steepest * gaussian(state, n + 7, GAUSSIAN)
    q += 0.5 * (qu + nu) * g1 + 0.5 * (qv + nv) * g2 + rules.mutation_q * g3
    return u + g1, v + g2, q, nu, nv


@compiled
def child(views, rules, region, kind, parents, flies, state):
    """(u, v, q, qu, qv, w) of one child, inside its region, the searched depths and both views; w is its `warp`.

    Its parents are any of those that the region kept, or the fitter of any two. A child that would lie outside is
    drawn again; after TRIES it becomes an immigrant. Left pixels are whole: a fly on a pixel's ray is as good a 3-D
    point as one between, and the left window needs no interpolation. One pixel beyond the window is left free.
    """
    half = rules.half
    u0, v0 = max(region.u0, half + 1), max(region.v0, half + 1)
    u1, v1 = min(region.u1, views.width - half - 1), min(region.v1, views.height - half - 1)
    if region.kept == 0:
        kind = IMMIGRATION
    cu, cv, q, qu, qv = u0, v0, -1.0, 0.0, 0.0
    w = warp(views, u0, v0, q, qu, qv)
    if u0 >= u1 or v0 >= v1:
        return cu, cv, q, qu, qv, w
    for attempt in range(2 * TRIES):
        if attempt == TRIES:
            kind = IMMIGRATION
        n = attempt * DRAWS_A_TRY
        bits = word(state, n)
        if kind == IMMIGRATION:
            cu, cv = u0 + low(bits, u1 - u0), v0 + high(bits, v1 - v0)
            bits = word(state, n + 1)
            q = rules.q_far + (high(bits, STEPS) / STEPS) * (rules.q_near - rules.q_far)  # uniform in disparity
            qu, qv = slanted(rules.steepest, word(state, n + 2))
        else:
            first, second = low(bits, region.kept), high(bits, region.kept)
            one, other = parents[region.parents + first], parents[region.parents + second]
            if rules.contest:
                bits = word(state, n + RIVALS)
                first, second = low(bits, region.kept), high(bits, region.kept)
                rival, another = parents[region.parents + first], parents[region.parents + second]
                one = rival if flies[rival].fitness > flies[one].fitness else one
                other = another if flies[another].fitness > flies[other].fitness else other
            fly = flies[one]
            x, y, q, qu, qv = float(fly.u), float(fly.v), float(fly.q), float(fly.qu), float(fly.qv)
            if kind == CROSSOVER:
                mate = flies[other]
                share = high(word(state, n + 1), STEPS) / STEPS * (1.0 + 2.0 * rules.beyond) - rules.beyond
                x, y, q = crossed(x, y, q, float(mate.u), float(mate.v), float(mate.q), share)
                qu, qv = share * qu + (1.0 - share) * mate.qu, share * qv + (1.0 - share) * mate.qv
            else:
                folds = high(word(state, n + 1), STEPS) < FOLD_SHARE * STEPS
                x, y, q, qu, qv = mutated(views, rules, x, y, q, qu, qv, folds, state, n + 2)
            cu, cv = math.floor(x + 0.5), math.floor(y + 0.5)
        if u0 <= cu < u1 and v0 <= cv < v1 and rules.q_far <= q <= rules.q_near:
            w = warp(views, cu, cv, q, qu, qv)
            if visible(views, w, half):
                break
            # What leaves the right view by its slant alone may stay as a fly that faces the camera.
            w = warp(views, cu, cv, q, 0.0, 0.0)
            if visible(views, w, half):
                qu, qv = 0.0, 0.0
                break
        q = -1.0  # after the last try there is no child
    return cu, cv, q, qu, qv, w
