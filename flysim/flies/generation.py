"""The compiled inside of a generation: every child bred, polished and evaluated, each on its own."""

from __future__ import annotations

from numba import njit, prange

from flysim.flies.descent import descend
from flysim.flies.fitness import OUT_OF_VIEW, fitness_of, visible, warp
from flysim.flies.operators import child
from flysim.flies.randomness import stream


@njit(cache=True, parallel=True)
def breed(
    left, right, grey_left, grey_right, gradient_left, gradient_right, to_right, shift, seed, generation, kinds,
    regions, parents, first_parents, rects, pixels, genes, out_pixels, out_genes, fitness, first, half, size,
    right_size, q_near, q_far, gain, K, metric, mutation, mutation_disparity, slant, polish,
):  # fmt: skip
    """Fills the slots `[first:]` of (out_pixels, out_genes, fitness) with children of (pixels, genes).

    A slot's draws depend on (seed, generation, slot) alone, so the number of threads changes nothing.
    """
    width, height = size
    for i in prange(first, len(kinds)):
        r = regions[i]
        u, v, q, qu, qv = child(
            stream(seed, generation, i), kinds[i], r, rects, parents, first_parents[r], first_parents[r + 1], pixels,
            genes, to_right, shift, half, size, right_size, q_near, q_far, gain, K, metric, mutation,
            mutation_disparity, slant,
        )  # fmt: skip
        fitness[i] = OUT_OF_VIEW
        # The descent reads one pixel beyond the window.
        if q > 0.0 and half < u < width - half - 1 and half < v < height - half - 1:
            if polish > 0:
                q, qu, qv = descend(
                    grey_left, grey_right, u, v, q, qu, qv, to_right, shift, half, q_near, q_far, slant > 0.0, polish
                )
            w = warp(u, v, q, qu, qv, to_right, shift)
            if visible(w, right_size[0], right_size[1], half):
                fitness[i] = fitness_of(left, right, gradient_left, gradient_right, u, v, w, half)
        out_pixels[i, 0], out_pixels[i, 1] = u, v
        out_genes[i, 0], out_genes[i, 1], out_genes[i, 2] = q, qu, qv
