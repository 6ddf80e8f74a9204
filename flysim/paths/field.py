"""How far it still is: the length of the shortest way to a goal, from anywhere."""

from __future__ import annotations

import math

import numpy as np
from scipy import ndimage

from flysim.paths.course import Ground


class Field:
    """The way to one goal [m], interpolated between the nodes of the ground's ways."""

    def __init__(self, ground: Ground, goal: tuple[float, float]) -> None:
        """Finds the shortest ways from all nodes at once."""
        nodes, costs = ground.ways.nodes, ground.distances(goal)
        step = max(float(np.diff(np.unique(nodes[:, 0])).min(initial=1.0)), 1e-3)
        self._low, self._step, self._goal = nodes.min(axis=0), step, goal
        ji = np.rint((nodes - self._low) / step).astype(int)
        image = np.full(ji.max(axis=0)[::-1] + 1, np.inf)
        image[ji[:, 1], ji[:, 0]] = costs
        # Where no robot's axis can be, the nearest place where it can tells.
        where = ndimage.distance_transform_edt(~np.isfinite(image), return_distances=False, return_indices=True)
        self._image = image[tuple(where)]  # type: ignore[arg-type]

    def at(self, x: float, y: float) -> float:
        """[m] from a place to the goal; within the last node's reach in a straight line."""
        straight = math.dist((x, y), self._goal)
        if straight <= 2.0 * self._step:
            return straight
        height, width = self._image.shape
        u = min(max((x - self._low[0]) / self._step, 0.0), width - 1.0)
        v = min(max((y - self._low[1]) / self._step, 0.0), height - 1.0)
        j, i = min(int(u), max(width - 2, 0)), min(int(v), max(height - 2, 0))
        s, t = u - j, v - i
        j1, i1 = min(j + 1, width - 1), min(i + 1, height - 1)
        f = self._image
        top = f[i, j] * (1.0 - s) + f[i, j1] * s
        return float(top * (1.0 - t) + (f[i1, j] * (1.0 - s) + f[i1, j1] * s) * t)
