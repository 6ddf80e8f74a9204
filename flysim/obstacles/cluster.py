"""Density clusters (DBSCAN; Ester, Kriegel, Sander and Xu, KDD 1996) on SciPy's tree and graph.

Scikit-learn has it too, but takes two seconds to import, a fifth of a whole run.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

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
    tree = KDTree(points)
    core = _crowded(points, distance, neighbours)
    rest = np.flatnonzero(~core)
    if len(rest):
        core[rest] = tree.query_ball_point(points[rest], distance, return_length=True) >= neighbours
    core = np.flatnonzero(core)
    if len(core) == 0:
        return labels
    core_tree = KDTree(points[core])
    pairs = core_tree.query_pairs(distance, output_type="ndarray")
    links = coo_array((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=(len(core), len(core)))
    _, cluster = connected_components(links, directed=False)
    labels[core] = cluster
    rest = np.flatnonzero(labels == NOISE)
    gap, nearest = core_tree.query(points[rest], distance_upper_bound=distance)
    reached = np.isfinite(gap)
    labels[rest[reached]] = cluster[np.asarray(nearest)[reached]]
    return labels


def _crowded(points: Array, distance: float, neighbours: int) -> NDArray[np.bool_]:
    """`[N]` points that share a cell with enough others, all within `distance`: cores without a search."""
    cell = np.floor(points / (distance / np.sqrt(points.shape[1]) * (1.0 - 1e-9))).astype(np.int64)
    _, index, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    return count[index.ravel()] >= neighbours
