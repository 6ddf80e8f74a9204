"""Selection with sharing: a crowded cell of the image keeps its best flies and gives up the rest."""

from __future__ import annotations

import numpy as np

from flysim.compute.compiled import compiled, inlined

_LOW = np.uint64(0xFFFFFFFF)
_S32 = np.uint64(32)


@inlined
def key(value, slot):
    """Sorts by value, the highest first, then by slot. Floats that are not negative are in the order of their bits."""
    return (np.uint64(~np.float32(value).view(np.uint32)) << _S32) | np.uint64(slot)


@compiled
def shared_fitness(flies, region, cell, weights, enough, keys, spots, cells):
    """Fills `shared` of a region's flies with their fitness times the weight of its rank in its image cell.

    Fitness saturates towards `enough` first: eq. (1) spans decades, and a crowded high-contrast cell would otherwise
    win against every cell that is merely good. Taken anew for survivors too at each generation, so that none keeps a
    stale penalty. Rejected flies stay below 0.

    Args:
        flies: `[N]` of `state.FLY`.
        region: one of `state.REGION`; cells do not reach over its border.
        cell: side of a cell [px].
        weights: for the first, second, ... of a cell: 1 / rank ** strength.
        enough: fitness that counts for half of what an endless one does.
        keys, spots, cells: scratch, `[N]` uint64, `[N]` int32, and `[n]` int32 with one more than the region has cells.
    """
    left, top = region.u0 // cell, region.v0 // cell
    columns, rows = (region.u1 - 1) // cell - left + 1, (region.v1 - 1) // cell - top + 1
    for place in range(columns * rows + 1):
        cells[place] = 0
    for slot in range(region.first, region.last):
        fly = flies[slot]
        fly.shared = fly.fitness
        spots[slot] = -1
        if fly.fitness >= 0.0:
            place = (fly.v // cell - top) * columns + fly.u // cell - left
            spots[slot] = place
            cells[place + 1] += 1
    for place in range(columns * rows):
        cells[place + 1] += cells[place]
    for slot in range(region.first, region.last):
        place = spots[slot]
        if place >= 0:
            keys[region.first + cells[place]] = key(flies[slot].fitness, slot)
            cells[place] += 1  # from where a cell begins to where it ends
    low = region.first
    for place in range(columns * rows):
        high = region.first + cells[place]
        if high - low > 1:
            _sort(keys, low, high)
        for k in range(low, high):
            fly = flies[np.int64(keys[k] & _LOW)]
            fly.shared = fly.fitness / (np.float32(1.0) + fly.fitness / enough) * weights[k - low]
        low = high


@compiled
def select(flies, region, parents, keys):
    """Puts the slots of the region's best by shared fitness in its part of `parents`, in no order; how many there are.

    Rejected flies are left out. Equals go by slot, the lower one first: survivors stand before children.
    """
    n = first = region.first
    for slot in range(first, region.last):
        if flies[slot].shared >= 0.0:
            keys[n] = key(flies[slot].shared, slot)
            n += 1
    n -= first
    if n > region.places:
        _put_smallest_first(keys, first, n, region.places)
        n = region.places
    for k in range(n):
        parents[region.parents + k] = np.int64(keys[first + k] & _LOW)
    return n


@inlined
def _sort(keys, low, high):
    """Shell's sort with Knuth's gaps: most cells hold a few flies, a crowded one takes n^1.5 at worst."""
    gap = 1
    while 9 * gap < high - low:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(low + gap, high):
            key, j = keys[i], i
            while j >= low + gap and keys[j - gap] > key:
                keys[j] = keys[j - gap]
                j -= gap
            keys[j] = key
        gap //= 3


@inlined
def _put_smallest_first(keys, first, n, count):
    """Hoare's selection (1961): of `keys[first : first + n]` the `count` smallest come first, in no order."""
    low, high, last = first, first + n - 1, first + count - 1
    while low < high:
        pivot = keys[(low + high) // 2]
        i, j = low, high
        while i <= j:
            while keys[i] < pivot:
                i += 1
            while keys[j] > pivot:
                j -= 1
            if i <= j:
                keys[i], keys[j] = keys[j], keys[i]
                i += 1
                j -= 1
        if last <= j:
            high = j
        elif last >= i:
            low = i
        else:
            return
