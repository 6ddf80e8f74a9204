"""Ways over cells: which of them are neighbours, what it costs to go from one to the next, and the cheapest chain."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array

from flysim.geometry.frames import Array

Cells = tuple[slice, slice]


def neighbours(shape: tuple[int, int]) -> Iterator[tuple[Cells, Cells, float]]:
    """Each way in which two cells of a `[rows, columns]` array can be neighbours, once: sideways, down, both diagonals.

    Yields:
        The cells that have such a neighbour, those neighbours in the same order, and their distance in cells.
    """
    rows, columns = shape
    for di, dj in ((0, 1), (1, 0), (1, 1), (1, -1)):
        one = (slice(0, rows - di), slice(max(0, -dj), columns - max(0, dj)))
        other = (slice(di, rows), slice(max(0, dj), columns + min(0, dj)))
        yield one, other, math.hypot(di, dj)


def graph(edges: list[tuple[NDArray[np.int64], NDArray[np.int64], Array]], nodes: int) -> csr_array:
    """The sparse graph of (from, to, cost) of its edges, for scipy's shortest paths with `directed=False`."""
    one, other, costs = (np.concatenate(column) for column in zip(*edges, strict=True))
    return coo_array((costs, (one, other)), shape=(nodes, nodes)).tocsr()


def chain(before: NDArray[np.int32], start: int, end: int) -> list[int] | None:
    """The nodes from `start` to `end` along scipy's predecessors of the ways from `end`; None where there is no way."""
    nodes = [start]
    while nodes[-1] != end:
        if before[nodes[-1]] < 0:
            return None
        nodes.append(int(before[nodes[-1]]))
    return nodes
