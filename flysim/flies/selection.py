"""Selection with sharing: a crowded cell of the image keeps its best flies and gives up the rest."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def shared_fitness(pixels, fitness, cell: int, columns: int, rows: int, strength: float, enough: float):
    """`[N]` fitness over rank ** strength, the rank that in the fly's image cell (rejected flies stay below 0).

    Fitness saturates towards `enough` first: eq. (1) spans decades, and a crowded high-contrast cell would otherwise
    win against every cell that is merely good.

    Recomputed for survivors too at each generation, so that none keeps a stale penalty.
    """
    order = np.argsort(-fitness, kind="mergesort")
    count = np.zeros(columns * rows, np.int32)
    shared = np.empty(len(fitness), np.float32)
    for i in order:
        if fitness[i] < 0.0:
            shared[i] = fitness[i]
            continue
        c = (pixels[i, 1] // cell) * columns + pixels[i, 0] // cell
        count[c] += 1
        shared[i] = fitness[i] / (1.0 + fitness[i] / enough) / np.float32(float(count[c]) ** strength)
    return shared


@njit(cache=True)
def select(shared, start: int, stop: int, count: int):
    """Indices of the `count` best of the slots [start, stop) by shared fitness, best first, rejected flies left out."""
    order = np.argsort(-shared[start:stop], kind="mergesort")[:count] + start
    alive = 0
    while alive < len(order) and shared[order[alive]] >= 0.0:
        alive += 1
    return order[:alive]
