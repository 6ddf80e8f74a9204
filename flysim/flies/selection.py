"""Selection with sharing: a crowded cell of the image keeps its best flies and gives up the rest."""

from __future__ import annotations

import numpy as np

from flysim.flies.compiled import compiled, inlined

_LOW = np.uint64(0xFFFFFFFF)
_S32 = np.uint64(32)


@compiled
def shared_fitness(pixels, fitness, bits, first, last, rect, cell, weights, enough, shared, keys, spots, cells):
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
        keys, spots, cells: scratch, `[N]` uint64, `[N]` int32, and `[n]` int32 with one more than the region has cells.
    """
    columns = (rect[1] - 1) // cell - rect[0] // cell + 1
    rows = (rect[3] - 1) // cell - rect[2] // cell + 1
    for place in range(columns * rows + 1):
        cells[place] = 0
    for slot in range(first, last):
        spots[slot] = -1
        if fitness[slot] < 0.0:
            shared[slot] = fitness[slot]
            continue
        place = (pixels[slot, 1] // cell - rect[2] // cell) * columns + pixels[slot, 0] // cell - rect[0] // cell
        spots[slot] = place
        cells[place + 1] += 1
    for place in range(columns * rows):
        cells[place + 1] += cells[place]
    for slot in range(first, last):
        place = spots[slot]
        if place >= 0:
            keys[first + cells[place]] = (np.uint64(~bits[slot]) << _S32) | np.uint64(slot)  # the fittest, then by slot
            cells[place] += 1  # from where a cell begins to where it ends
    low = first
    for place in range(columns * rows):
        high = first + cells[place]
        if high - low > 1:
            _sort(keys, low, high)
        for k in range(low, high):
            slot = np.int64(keys[k] & _LOW)
            shared[slot] = fitness[slot] / (np.float32(1.0) + fitness[slot] / enough) * weights[k - low]
        low = high


@compiled
def select(shared, bits, first, last, count, chosen, keys):
    """Fills `chosen` with the `count` best of the slots by shared fitness, in no order; returns how many there are.

    `bits` is the memory of `shared` as uint32, `keys` `[N]` uint64 scratch.

    Rejected flies are left out. Equals go by slot, the lower one first: survivors stand before children.
    """
    n = first
    for slot in range(first, last):
        if shared[slot] >= 0.0:
            keys[n] = (np.uint64(~bits[slot]) << _S32) | np.uint64(slot)
            n += 1
    n -= first
    if n > count:
        _put_smallest_first(keys, first, n, count)
        n = count
    for k in range(n):
        chosen[k] = np.int64(keys[first + k] & _LOW)
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
