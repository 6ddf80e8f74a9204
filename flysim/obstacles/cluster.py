"""Density clusters (DBSCAN; Ester, Kriegel, Sander and Xu, KDD 1996) over a grid, with SciPy's tree.

Points in one cell of the grid are all near each other, so that cells are linked and not points: where flies lie dense,
pairs of points are millions (Gunawan, "A faster algorithm for DBSCAN", TU Eindhoven, 2013). Scikit-learn links points,
and takes two seconds to import, a fifth of a whole run.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from flysim.compute.compiled import compiled, kernel
from flysim.geometry.frames import Array

NOISE = -1


def dbscan(points: Array, distance: float, neighbours: int) -> NDArray[np.int64]:
    """`[N]` cluster of each point, numbered from 0; NOISE where there is none.

    A point with `neighbours` points within `distance`, itself included, is a core. Cores within `distance` of one
    another are one cluster; other points join the cluster of their nearest core within `distance`.
    """
    labels = np.full(len(points), NOISE, np.int64)
    if len(points) == 0:
        return labels
    side = distance / np.sqrt(points.shape[1]) * (1.0 - 1e-9)
    cell = np.floor(points / side)
    order, of = _grouped(cell)
    core = np.bincount(of)[of] >= neighbours  # by their own cell alone
    rest = np.flatnonzero(~core)
    if len(rest):
        core[rest] = KDTree(points).query_ball_point(points[rest], distance, return_length=True) >= neighbours
    order = order[core[order]]
    if len(order) == 0:
        return labels
    first = np.flatnonzero(np.diff(of[order], prepend=-1))  # of each cell's cores, in `order`
    middles = (cell[order[first]] + 0.5) * side
    near = KDTree(middles).query_pairs(2.0 * distance, output_type="ndarray")
    # Neighbours first: by them most others are linked already.
    near = near[np.argsort(((middles[near[:, 0]] - middles[near[:, 1]]) ** 2).sum(axis=1), kind="stable")]
    root = np.arange(len(first))
    _link(np.ascontiguousarray(points[order]), np.append(first, len(order)), near, distance**2, root)
    cluster = np.repeat(root, np.diff(first, append=len(order)))
    earliest = np.full(len(first), len(points))
    np.minimum.at(earliest, cluster, order)
    labels[order] = np.searchsorted(np.unique(earliest[np.unique(root)]), earliest[cluster])
    rest = np.flatnonzero(labels == NOISE)
    gap, nearest = KDTree(points[order]).query(points[rest], distance_upper_bound=distance)
    reached = np.isfinite(gap)
    labels[rest[reached]] = labels[order[np.asarray(nearest)[reached]]]
    return labels


def _grouped(cell: Array) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """`[N]` points in the order of their cells, and `[N]` number of each point's cell."""
    order = np.lexsort(cell.T)
    new = np.any(cell[order[1:]] != cell[order[:-1]], axis=1)
    of = np.empty(len(cell), np.int64)
    of[order] = np.concatenate([[0], np.cumsum(new)])
    return order, of


@compiled
def _root(root, k):
    while root[k] != k:
        root[k] = root[root[k]]
        k = root[k]
    return k


@kernel
def _link(points, first, near, most, root):
    """Fills `root` `[C]`, of each cell one that stands for all linked to it.

    `points` are sorted by cell, cell c has those from `first[c]` to `first[c + 1]`. Cells of a pair in `near` are
    linked if a point of one is within a squared distance `most` of a point of the other.
    """
    for n in range(len(near)):
        a, b = _root(root, near[n, 0]), _root(root, near[n, 1])
        linked = a == b
        i, end = first[near[n, 0]], first[near[n, 0] + 1]
        while not linked and i < end:
            for j in range(first[near[n, 1]], first[near[n, 1] + 1]):
                gap = 0.0
                for k in range(points.shape[1]):
                    gap += (points[i, k] - points[j, k]) ** 2
                if gap <= most:
                    root[b] = a
                    linked = True
                    break
            i += 1
    for k in range(len(root)):
        root[k] = _root(root, k)
