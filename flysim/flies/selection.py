"""Selection with sharing: a crowded cell of the image keeps its best flies and gives up the rest."""

from __future__ import annotations

import numpy as np

from flysim.flies.compiled import inlined

_LOW = np.uint64(0xFFFFFFFF)
_S32 = np.uint64(32)
GAPS = (1750, 701, 301, 132, 57, 23, 10, 4, 1)  # Ciura's: a crowded cell is sorted in n^1.3 at worst


@inlined
def shared_fitness(pixels, fitness, bits, first, last, rect, cell, weights, enough, shared):
    """Fills `shared[first:last]` with fitness times the weight of its rank in its image cell.

    Fitness saturates towards `enough` first: eq. (1) spans decades, and a crowded high-contrast cell would otherwise
    win against every cell that is merely good. Taken anew for survivors too at each generation, so that none keeps a
    stale penalty. Rejected flies stay below 0.

    Args:
        pixels: `[N, 2]` u, v.
        fitness: `[N]` float32 unshared.
        bits: the same memory as uint32: of floats that are not negative, in the same order.
        first, last: the slots of a region.
        rect: its pixels, u0, u1, v0, v1.
        cell: side of a cell [px]; cells do not reach over the region's border.
        weights: `[last - first]` for the first, second, ... of a cell: 1 / rank ** strength.
        enough: fitness that counts for half of what an endless one does.
        shared: `[N]` float32.
    """
    columns = (rect[1] - 1) // cell - rect[0] // cell + 1
    rows = (rect[3] - 1) // cell - rect[2] // cell + 1
    starts = np.zeros(columns * rows + 1, np.int32)
    places = np.empty(last - first, np.int32)
    for slot in range(first, last):
        if fitness[slot] < 0.0:
            places[slot - first] = -1
            continue
        place = (pixels[slot, 1] // cell - rect[2] // cell) * columns + pixels[slot, 0] // cell - rect[0] // cell
        places[slot - first] = place
        starts[place + 1] += 1
    for place in range(columns * rows):
        starts[place + 1] += starts[place]
    keys = np.empty(last - first, np.uint64)
    filled = starts[:-1].copy()
    for slot in range(first, last):
        place = places[slot - first]
        if place < 0:
            shared[slot] = fitness[slot]
            continue
        keys[filled[place]] = (np.uint64(~bits[slot]) << _S32) | np.uint64(slot)  # the fittest first, then by slot
        filled[place] += 1
    for place in range(columns * rows):
        low, high = starts[place], starts[place + 1]
        if high - low > 1:
            _sort(keys, low, high)
        for k in range(low, high):
            slot = np.int64(keys[k] & _LOW)
            shared[slot] = fitness[slot] / (np.float32(1.0) + fitness[slot] / enough) * weights[k - low]


@inlined
def select(shared, bits, first, last, count, chosen):
    """Fills `chosen` with the `count` best of the slots by shared fitness, in no order; returns how many there are.

    `bits` is the memory of `shared` as uint32.

    Rejected flies are left out. Equals go by slot, the lower one first: survivors stand before children.
    """
    keys = np.empty(last - first, np.uint64)
    n = np.int64(0)
    for slot in range(first, last):
        if shared[slot] >= 0.0:
            keys[n] = (np.uint64(~bits[slot]) << _S32) | np.uint64(slot)
            n += 1
    if n > count:
        _put_smallest_first(keys, n, count)
        n = count
    for k in range(n):
        chosen[k] = np.int64(keys[k] & _LOW)
    return n


@inlined
def _sort(keys, low, high):
    for gap in GAPS:
        for i in range(low + gap, high):
            key, j = keys[i], i
            while j >= low + gap and keys[j - gap] > key:
                keys[j] = keys[j - gap]
                j -= gap
            keys[j] = key


@inlined
def _put_smallest_first(keys, n, count):
    """Hoare's selection (1961): keys[:count] become the smallest, in no order."""
    low, high = 0, n - 1
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
        if count - 1 <= j:
            high = j
        elif count - 1 >= i:
            low = i
        else:
            return
