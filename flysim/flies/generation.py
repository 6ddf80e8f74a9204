"""The compiled inside of a generation: every child bred, evaluated and polished on its own, then the selection."""

from __future__ import annotations

import numpy as np

from flysim.compute.compiled import compiled, inlined, kernel
from flysim.compute.randomness import stream
from flysim.compute.vectors import add
from flysim.flies.fitness import OUT_OF_VIEW, evaluate
from flysim.flies.operators import CROSSOVER, IMMIGRATION, MUTATION, child
from flysim.flies.selection import select, shared_fitness
from flysim.stereo.descent import descend
from flysim.stereo.windows import fetch_windows, visible, warp

EVERY_THIRD_ROW = np.int64(3)  # of a window is enough to polish by
# Times the fitness that promises: below it a child counts for nothing, and its window is not read to the end.
WORTHLESS = 0.15
BLOCK = 32  # slots that a thread takes together


@compiled
def polished(views, rules, other, u, v, q, qu, qv, w, needed):
    """(q, qu, qv, fitness) of a child, after polishing where it promises to survive and is the fitter for it."""
    fetch_windows(views, u, v, w, rules.half)
    # A child that is polished may start below what is needed.
    aim = max(needed, WORTHLESS * rules.promising)
    aim = min(aim, rules.promising) if rules.polish > 0 else needed
    fitness = evaluate(views, rules.norm, other, u, v, w, rules.half, aim)
    if rules.polish > 0 and rules.promising <= fitness < rules.sharp:
        q2, qu2, qv2 = descend(views, rules, u, v, q, qu, qv, rules.polish, EVERY_THIRD_ROW)
        w = warp(views, u, v, q2, qu2, qv2)
        if visible(views, w, rules.half):
            better = evaluate(views, rules.norm, other, u, v, w, rules.half, fitness)
            if better > fitness:
                return q2, qu2, qv2, better
    return q, qu, qv, fitness


@kernel
def generation(
    lane, counters, views, rules, other, seed, number, regions, parents, flies, out, cell, weights, enough, settled,
    keys, spots, cells,
):  # fmt: skip
    """Breeds a generation and selects in it. A lane takes a block of slots, breeds it and comes for the next.

    Who has bred the last block of a region selects there. A slot's draws depend on (seed, number, slot) alone, so
    the number of threads and the order of their work change nothing.

    Args:
        lane: which of the threads this is.
        counters: `[1 + R]` int64, the blocks that were taken, and those of each region that are to be bred.
        views, rules: `[1]` records of `views.RECORD` or `LEVEL`, `operators.RULES`.
        other: of `fitness.code`.
        seed, number: of the draws, of the generation.
        regions: `[R]` of `state.REGION`, in order of their slots.
        parents: slots of the old generation that were preserved, of every region from `region.parents` on.
        flies, out: `[N]` of `state.FLY`, the old generation and the new one.
        cell, weights, enough, settled, keys, spots, cells: of `preserve`, of `cells` a row for each region.
    """
    while True:
        r, block = 0, add(counters, 0, 1)
        while r < len(regions) and block >= blocks(regions[r]):
            block -= blocks(regions[r])
            r += 1
        if r == len(regions):
            return
        region = regions[r]
        first = region.first + block * BLOCK
        for slot in range(first, min(first + BLOCK, region.last)):
            breed(views[0], rules[0], other, seed, number, region, parents, flies, out, slot)
        if add(counters, 1 + r, -1) == 1:
            preserve(out, region, parents, cell, weights, enough, settled, keys, spots, cells[r])


@inlined
def blocks(region):
    """Blocks of a region's slots; a region without any has one, so that it is selected in as well."""
    return max((region.last - region.first + BLOCK - 1) // BLOCK, 1)


@inlined
def breed(views, rules, other, seed, number, region, parents, flies, out, slot):
    """Fills a slot of a new generation: a region's first ones with its survivors, the others with their children."""
    k, new = slot - region.first, out[slot]
    if k < region.kept:
        old = flies[parents[region.parents + k]]
        new.u, new.v, new.q, new.qu, new.qv = old.u, old.v, old.q, old.qu, old.qv
        new.fitness, new.age = old.fitness, old.age + 1
        if number == 0:  # it comes from another pair
            u, v, q, qu, qv = int(old.u), int(old.v), float(old.q), float(old.qu), float(old.qv)
            w, fit = warp(views, u, v, q, qu, qv), float(OUT_OF_VIEW)
            if visible(views, w, rules.half):
                q, qu, qv, fit = polished(views, rules, other, u, v, q, qu, qv, w, region.needed)
            new.q, new.qu, new.qv, new.fitness = q, qu, qv, fit
    else:
        kind = IMMIGRATION
        if k < region.kept + region.crossed:
            kind = CROSSOVER
        elif k < region.kept + region.crossed + region.mutated:
            kind = MUTATION
        state = stream(seed, number, slot)
        u, v, q, qu, qv, w = child(views, rules, region, kind, parents, flies, state)
        fit = float(OUT_OF_VIEW)
        if q > 0.0:
            q, qu, qv, fit = polished(views, rules, other, u, v, q, qu, qv, w, region.needed)
        new.u, new.v, new.q, new.qu, new.qv, new.fitness, new.age = u, v, q, qu, qv, fit, 0


@compiled
def preserve(flies, region, parents, cell, weights, enough, settled, keys, spots, cells):
    """Selects in a region; fills its part of `parents`, and in it what is told of selection.

    Args:
        flies, region, parents: as `generation`'s, the new flies.
        cell, weights, enough: of `selection.shared_fitness`; no weights: no sharing.
        settled: fitness from which a fly is settled.
        keys, spots, cells: scratch of `selection`.
    """
    if len(weights) > 0:
        shared_fitness(flies, region, cell, weights, enough, keys, spots, cells)
    else:
        for slot in range(region.first, region.last):
            flies[slot].shared = flies[slot].fitness
    n = select(flies, region, parents, keys)
    best, total, fit, least = 0.0, 0.0, 0, np.inf
    for k in range(region.parents, region.parents + n):
        fly = flies[parents[k]]
        best, least = max(best, float(fly.fitness)), min(least, float(fly.shared))
        total += fly.fitness
        fit += fly.fitness >= settled
    region.kept, region.best, region.total, region.settled = n, best, total, fit
    # The least fitness that, alone in its cell, is worth as much as the last of the preserved.
    region.needed = 0.0
    if n == region.places and n > 0:
        # Close to `enough` that is all rounding: never more than a fitness that a fly can have.
        region.needed = least / max(1.0 - least / enough if len(weights) > 0 else 1.0, 1e-3)
