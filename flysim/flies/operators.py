"""The genetic operators of section 3.1: barycentric crossover, Gaussian mutation, immigration."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from flysim.compute.compiled import compiled, inlined
from flysim.compute.plugged import Plugged, by_plugged, callable_in_kernels, refuse_what_does_not_compile
from flysim.compute.randomness import gaussian, high, low, word
from flysim.flies.operator import OPERATORS, Genes, crossover, find_operator, mutation
from flysim.flies.rules import RULES
from flysim.stereo.told import coarser
from flysim.stereo.views import RECORD
from flysim.stereo.windows import visible, warp

GAUSSIAN = np.int64(0)  # not heavy-tailed
CROSSOVER, MUTATION, IMMIGRATION = 0, 1, 2
TRIES = 16  # draws before a child becomes an immigrant, and an immigrant is given up
DRAWS_A_TRY = 16
RIVALS = 12  # the draw of a tournament's rivals, behind all others of a try
STEPS = 1 << 32  # of a number drawn from half a word


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


@crossover
def barycentric(views, rules, one, other, state, n):
    """Between the parents or, as far as the rules say, beyond them."""
    share = high(word(state, n), STEPS) / STEPS * (1.0 + 2.0 * rules.beyond) - rules.beyond
    # In the precision that flies are kept in: a swarm depends on the last bit.
    u, v, q = crossed(one.u, one.v, np.float32(one.q), other.u, other.v, np.float32(other.q), share)
    return Genes(u, v, q, share * one.qu + (1.0 - share) * other.qu, share * one.qv + (1.0 - share) * other.qv)


@mutation
def random_step(views, rules, one, state, n):
    """A random step, in space or in the image; some take a new slant half-way, where flies may lean."""
    folds = high(word(state, n), STEPS) < rules.fold_share * STEPS
    u, v, q, qu, qv = mutated(views, rules, one.u, one.v, one.q, one.qu, one.qv, folds, state, n + 1)
    return Genes(u, v, q, qu, qv)


def _crossed(plugged, views, rules, one, other, state, n):
    """The genes of a child of two."""


@by_plugged(_crossed)
def heir(operator):
    """The child of two parents, by the crossover that the parameters name."""
    function = callable_in_kernels(operator.function)

    def crossed_by(plugged, views, rules, one, other, state, n):
        return function(views, rules, one, other, state, n)

    return crossed_by


def _mutated(plugged, views, rules, one, state, n):
    """The genes of a child of one."""


@by_plugged(_mutated)
def mutant(operator):
    """A changed copy of a fly, by the mutation that the parameters name."""
    function = callable_in_kernels(operator.function)

    def mutated_by(plugged, views, rules, one, state, n):
        return function(views, rules, one, state, n)

    return mutated_by


@lru_cache(maxsize=64)
def plugged(kind, name):
    """The crossover or the mutation of a name or of a `module:object`, as kernels take it.

    Raises:
        FlysimError: of `operator.find_operator`.
    """
    found = Plugged(find_operator(kind, name))
    if name not in OPERATORS.builtin:
        fly, rules = Genes(0.0, 0.0, 0.0, 0.0, 0.0), np.zeros(1, RULES)[0]
        given = np.zeros(1, RECORD)[0], rules, *[fly] * (2 if kind == "crossover" else 1), np.uint64(0), 1
        refuse_what_does_not_compile(found, kind, name, given)
    return found


@inlined
def genes(fly):
    """Those of one of `state.FLY`."""
    return Genes(np.float64(fly.u), np.float64(fly.v), np.float64(fly.q), np.float64(fly.qu), np.float64(fly.qv))


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
    nu, nv, scale = qu, qv, coarser(views, u, v, q)
    if rules.steepest > 0.0:
        if folds:
            nu, nv = slanted(rules.steepest * scale, word(state, n + 6))
        else:
            nu += rules.mutation_slope * scale * gaussian(state, n + 6, GAUSSIAN)
            nv += rules.mutation_slope * scale * gaussian(state, n + 7, GAUSSIAN)
    q += 0.5 * (qu + nu) * g1 + 0.5 * (qv + nv) * g2 + rules.mutation_q * scale * g3
    return u + g1, v + g2, q, nu, nv


@compiled
def child(views, rules, crossover, mutation, region, kind, parents, flies, state):
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
            qu, qv = slanted(rules.steepest * coarser(views, cu, cv, q), word(state, n + 2))
        else:
            first, second = low(bits, region.kept), high(bits, region.kept)
            one, other = parents[region.parents + first], parents[region.parents + second]
            if rules.contest:
                bits = word(state, n + RIVALS)
                first, second = low(bits, region.kept), high(bits, region.kept)
                rival, another = parents[region.parents + first], parents[region.parents + second]
                one = rival if flies[rival].fitness > flies[one].fitness else one
                other = another if flies[another].fitness > flies[other].fitness else other
            if kind == CROSSOVER:
                born = heir(crossover, views, rules, genes(flies[one]), genes(flies[other]), state, n + 1)
            else:
                born = mutant(mutation, views, rules, genes(flies[one]), state, n + 1)
            q, qu, qv = born.q, born.qu, born.qv
            cu, cv = math.floor(born.u + 0.5), math.floor(born.v + 0.5)
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
