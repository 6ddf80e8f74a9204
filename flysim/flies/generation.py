"""The compiled inside of a generation: every child bred, evaluated and polished on its own, then the selection."""

from __future__ import annotations

from typing import NamedTuple

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
def polished(views, rules, measure, u, v, q, qu, qv, w, needed):
    """(q, qu, qv, fitness) of a child, after polishing where it promises to survive and is the fitter for it."""
    fetch_windows(views, u, v, w, rules.half)
    # A child that is polished may start below what is needed.
    aim = max(needed, WORTHLESS * rules.promising)
    aim = min(aim, rules.promising) if rules.polish > 0 else needed
    fitness = evaluate(views, rules.norm, measure, u, v, w, rules.half, aim)
    if rules.polish > 0 and rules.promising <= fitness < rules.sharp:
        q2, qu2, qv2 = descend(views, rules, u, v, q, qu, qv, rules.polish, EVERY_THIRD_ROW)
        w = warp(views, u, v, q2, qu2, qv2)
        if visible(views, w, rules.half):
            better = evaluate(views, rules.norm, measure, u, v, w, rules.half, fitness)
            if better > fitness:
                return q2, qu2, qv2, better
    return q, qu, qv, fitness


class Selection(NamedTuple):
    """By what is selected in a generation.

    Attributes:
        cell: side of a sharing cell [px].
        weights: of the first, second, ... of a cell, as `selection.shared_fitness` has them; none: no sharing.
        enough: fitness that counts for half of what an endless one does.
        settled: fitness from which a fly is settled.
    """

    cell: int
    weights: np.ndarray
    enough: float
    settled: float


class Workspace(NamedTuple):
    """Room to work in: `[N]` uint64 and int32 of the flies, and `[R, n]` int32, one more than a region has cells."""

    keys: np.ndarray
    spots: np.ndarray
    cells: np.ndarray


class Population(NamedTuple):
    """What a generation turns into the next.

    Attributes:
        regions: `[R]` of `state.REGION`, in order of their slots.
        parents: slots of the old generation that were preserved, of every region from `region.parents` on.
        flies, out: `[N]` of `state.FLY`, the old generation and the new one.
    """

    regions: np.ndarray
    parents: np.ndarray
    flies: np.ndarray
    out: np.ndarray


class Draws(NamedTuple):
    """What random numbers depend on, beside a slot: the seed, and the generation's number."""

    seed: np.uint64
    number: int


@kernel
def generation(
    lane, counters, all_views, all_rules, measure, crossover, mutation, draws, population, selection, scratch
):
    """Breeds a generation and selects in it. A lane takes a block of slots, breeds it and comes for the next.

    Who has bred the last block of a region selects there. A slot's draws depend on (seed, number, slot) alone, so
    the number of threads and the order of their work change nothing.

    Args:
        lane: which of the threads this is.
        counters: `[1 + R]` int64, the blocks that were taken, and those of each region that are to be bred.
        all_views, all_rules: `[1]` records of `views.RECORD` or `LEVEL`, and of `rules.RULES`.
        measure: of `fitness.plugged`.
        crossover, mutation: of `operators.plugged`.
        draws, population, selection, scratch: as their classes say.
    """
    views, rules, regions = all_views[0], all_rules[0], population.regions
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
            breed(views, rules, measure, crossover, mutation, draws, region, population, slot)
        if add(counters, 1 + r, -1) == 1:
            preserve(population.out, region, population.parents, selection, scratch, scratch.cells[r])


@inlined
def blocks(region):
    """Blocks of a region's slots; a region without any has one, so that it is selected in as well."""
    return max((region.last - region.first + BLOCK - 1) // BLOCK, 1)


@inlined
def breed(views, rules, measure, crossover, mutation, draws, region, population, slot):
    """Fills a slot of a new generation: a region's first ones with its survivors, the others with their children."""
    k, new, parents, flies = slot - region.first, population.out[slot], population.parents, population.flies
    if k < region.kept:
        old = flies[parents[region.parents + k]]
        new.u, new.v, new.q, new.qu, new.qv = old.u, old.v, old.q, old.qu, old.qv
        new.fitness, new.age = old.fitness, old.age + 1
        if draws.number == 0:  # it comes from another pair
            u, v, q, qu, qv = int(old.u), int(old.v), float(old.q), float(old.qu), float(old.qv)
            w, fit = warp(views, u, v, q, qu, qv), float(OUT_OF_VIEW)
            if visible(views, w, rules.half):
                q, qu, qv, fit = polished(views, rules, measure, u, v, q, qu, qv, w, region.needed)
            new.q, new.qu, new.qv, new.fitness = q, qu, qv, fit
    else:
        kind = IMMIGRATION
        if k < region.kept + region.crossed:
            kind = CROSSOVER
        elif k < region.kept + region.crossed + region.mutated:
            kind = MUTATION
        state = stream(draws.seed, draws.number, slot)
        u, v, q, qu, qv, w = child(views, rules, crossover, mutation, region, kind, parents, flies, state)
        fit = float(OUT_OF_VIEW)
        if q > 0.0:
            q, qu, qv, fit = polished(views, rules, measure, u, v, q, qu, qv, w, region.needed)
        new.u, new.v, new.q, new.qu, new.qv, new.fitness, new.age = u, v, q, qu, qv, fit, 0


@compiled
def preserve(flies, region, parents, selection, scratch, cells):
    """Selects in a region; fills its part of `parents`, and in it what is told of selection.

    Args:
        flies, region, parents: as `generation`'s, the new flies.
        selection, scratch: as `generation`'s; `cells`, of the scratch, are the region's own.
    """
    weights, enough = selection.weights, selection.enough
    if len(weights) > 0:
        shared_fitness(flies, region, selection.cell, weights, enough, scratch.keys, scratch.spots, cells)
    else:
        for slot in range(region.first, region.last):
            flies[slot].shared = flies[slot].fitness
    n = select(flies, region, parents, scratch.keys)
    best, total, fit, least = 0.0, 0.0, 0, np.inf
    for k in range(region.parents, region.parents + n):
        fly = flies[parents[k]]
        best, least = max(best, float(fly.fitness)), min(least, float(fly.shared))
        total += fly.fitness
        fit += fly.fitness >= selection.settled
    region.kept, region.best, region.total, region.settled = n, best, total, fit
    # The least fitness that, alone in its cell, is worth as much as the last of the preserved.
    region.needed = 0.0
    if n == region.places and n > 0:
        # Close to `enough` that is all rounding: never more than a fitness that a fly can have.
        region.needed = least / max(1.0 - least / enough if len(weights) > 0 else 1.0, 1e-3)
