"""Selection with sharing: a crowded cell of the image keeps its best flies and gives up the rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def shared_fitness(
    pixels: NDArray[np.int32], fitness: NDArray[np.float32], cell: int, width: int, strength: float, enough: float
) -> NDArray[np.float32]:
    """`[N]` fitness over rank ** strength, the rank that in the fly's image cell (rejected flies stay below 0).

    Fitness saturates towards `enough` first: eq. (1) spans decades, and a crowded high-contrast cell would otherwise
    win against every cell that is merely good. Recomputed for survivors too at each generation, so that none keeps a
    stale penalty.

    Args:
        pixels: `[N, 2]` u, v.
        fitness: `[N]` unshared.
        cell: side of a cell [px].
        width: of the image [px].
        strength: 0 turns sharing off.
        enough: fitness that counts for half of what an endless one does.
    """
    places = pixels // cell
    cells = places[:, 1].astype(np.int64) * (width // cell + 1) + places[:, 0]
    order = np.lexsort((-fitness, cells))  # cell by cell, the fittest first; equal ones by slot
    sorted_cells = cells[order]
    first = np.r_[True, sorted_cells[1:] != sorted_cells[:-1]]
    position = np.arange(len(order))
    rank = np.empty(len(order), np.float32)
    rank[order] = position - np.maximum.accumulate(np.where(first, position, 0)) + 1
    alive = np.maximum(fitness, 0.0)
    shared = alive / (1.0 + alive / enough) / rank**strength
    return np.where(fitness < 0.0, fitness, shared).astype(np.float32)


def select(shared: NDArray[np.float32], slots: NDArray[np.int64], count: int) -> NDArray[np.int64]:
    """The `count` best of `slots` by shared fitness, best first, rejected flies left out."""
    best = slots[np.argsort(-shared[slots], kind="stable")[:count]]
    return best[shared[best] >= 0.0]
