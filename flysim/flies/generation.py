"""The compiled inside of a generation: every child bred, evaluated and polished on its own, then the selection."""

from __future__ import annotations

import numpy as np

from flysim.flies.compiled import compiled, kernel
from flysim.flies.descent import descend
from flysim.flies.fitness import OUT_OF_VIEW, evaluate
from flysim.flies.operators import CROSSOVER, IMMIGRATION, MUTATION, child
from flysim.flies.randomness import stream
from flysim.flies.selection import select, shared_fitness
from flysim.flies.windows import fetch_windows, visible, warp

EVERY_THIRD_ROW = np.int64(3)  # of a window is enough to polish by
BLOCK = 32  # slots that a thread takes together; the next ones are another's, so that all have like work


@compiled
def polished(views, rules, other, u, v, q, qu, qv, needed):
    """(q, qu, qv, fitness) of a child, after polishing where it promises to survive and is the fitter for it."""
    w = warp(views, u, v, q, qu, qv)
    fetch_windows(views, u, v, w, rules.half)
    aim = rules.promising if rules.polish > 0 and rules.promising < needed else needed
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
def breed(
    lane, lanes, views, rules, other, seed, generation, rects, starts, counts, parents, n_parents, needed, pixels,
    genes, age, out_pixels, out_genes, out_fitness, out_age, fitness,
):  # fmt: skip
    """Fills the slots of a new generation: in each region first its survivors, then its children.

    A slot's draws depend on (seed, generation, slot) alone, so the number of threads changes nothing.

    Args:
        lane, lanes: of the slots, blocks `lane`, `lane + lanes`, ... are filled.
        views, rules: `[1]` records of `views.RECORD` or `LEVEL`, `operators.RULES`.
        other: of `fitness.code`.
        seed, generation: of the draws.
        rects: `[R, 4]` pixels of each region.
        starts: `[R + 1]` first slot of each region.
        counts: `[R, 3]` survivors, crossovers, mutations in each region; what is left are immigrants.
        parents: `[R, most]` slots of the old generation that were preserved, region by region.
        n_parents: `[R]` how many of them there are.
        needed: `[R]` fitness without which nothing is preserved.
        pixels, genes, age, fitness: the old generation.
        out_pixels, out_genes, out_fitness, out_age: the new one.
    """
    n = starts[-1]
    for block in range(lane * BLOCK, n, lanes * BLOCK):
        for slot in range(block, block + BLOCK):
            if slot >= n:
                break
            r = 0
            while slot >= starts[r + 1]:
                r += 1
            k = slot - starts[r]
            kept = n_parents[r] if n_parents[r] < counts[r, 0] else counts[r, 0]
            if k < kept:
                old = parents[r, k]
                out_pixels[slot, 0], out_pixels[slot, 1] = pixels[old, 0], pixels[old, 1]
                for gene in range(3):
                    out_genes[slot, gene] = genes[old, gene]
                out_fitness[slot], out_age[slot] = fitness[old], age[old] + 1
                continue
            kind = IMMIGRATION
            if k < kept + counts[r, 1]:
                kind = CROSSOVER
            elif k < kept + counts[r, 1] + counts[r, 2]:
                kind = MUTATION
            state = stream(seed, generation, slot)
            u, v, q, qu, qv = child(views[0], rules[0], kind, rects[r], parents[r], kept, pixels, genes, fitness, state)
            fit = float(OUT_OF_VIEW)
            if q > 0.0:
                q, qu, qv, fit = polished(views[0], rules[0], other, u, v, q, qu, qv, needed[r])
            out_pixels[slot, 0], out_pixels[slot, 1] = u, v
            out_genes[slot, 0], out_genes[slot, 1], out_genes[slot, 2] = q, qu, qv
            out_fitness[slot], out_age[slot] = fit, 0


@kernel
def preserve(
    lane, lanes, rects, starts, places, cell, weights, enough, settled, pixels, fitness, fitness_bits, shared,
    shared_bits, keys, spots, cells, parents, n_parents, needed, told,
):  # fmt: skip
    """Selects in every region; fills `parents`, `n_parents`, `needed` and `told`.

    Args:
        lane, lanes: the regions `lane`, `lane + lanes`, ... are done.
        rects, starts: as `breed`'s.
        places: `[R]` flies that each region may preserve.
        cell, weights, enough: of `selection.shared_fitness`; no weights: no sharing.
        settled: fitness from which a fly is settled.
        pixels, fitness: the generation.
        shared: `[N]` float32 scratch.
        fitness_bits, shared_bits: the same memories as uint32.
        keys, spots, cells: scratch of `selection`.
        parents, n_parents, needed: for `breed`.
        told: `[R, 3]` best fitness, sum of fitness, settled flies among the preserved.
    """
    for r in range(lane, len(rects), lanes):
        first, last = starts[r], starts[r + 1]
        if len(weights) > 0:
            shared_fitness(
                pixels,
                fitness,
                fitness_bits,
                first,
                last,
                rects[r],
                cell,
                weights,
                enough,
                shared,
                keys,
                spots,
                cells[r],
            )
        else:
            for slot in range(first, last):
                shared[slot] = fitness[slot]
        n = select(shared, shared_bits, first, last, places[r], parents[r], keys)
        n_parents[r] = n
        best, total, fit, least = 0.0, 0.0, 0, np.inf
        for k in range(n):
            slot = parents[r, k]
            if fitness[slot] > best:
                best = fitness[slot]
            total += fitness[slot]
            if shared[slot] < least:
                least = shared[slot]
            if fitness[slot] >= settled:
                fit += 1
        told[r, 0], told[r, 1], told[r, 2] = best, total, fit
        # The least fitness that, alone in its cell, is worth as much as the last of the preserved.
        needed[r] = 0.0
        if n == places[r] and n > 0:
            # Close to `enough` that is all rounding: never more than a fitness that a fly can have.
            room = 1.0 - least / enough if len(weights) > 0 else 1.0
            needed[r] = least / (room if room > 1e-3 else 1e-3)
