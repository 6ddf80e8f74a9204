"""What has been seen lately, round the robot: points kept in the odometry frame, told as distances by sector."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.common.ranges import ranged
from flysim.compute.compiled import compiled
from flysim.geometry.frames import Array, Pose2

# Parts of the observation: another number of either is another environment.
SECTORS = 72
RANGE = 5.0  # [m] farthest distance told
CELL = 0.10  # [m] of the cells in which points back each other


@dataclass(frozen=True, slots=True, kw_only=True)
class SurroundingsParams:
    """What of the points seen counts as an obstacle; chosen with the agents, on `random-medium`.

    Attributes:
        most: points kept of one look.
        cell: of the cells in which points back each other [m].
        backed: points that a cell and its neighbours must hold together; one alone is a stray.
        sure_to: what was seen from nearer than this stands where it was seen [m]; of what was seen from farther away
            the depth is off by the square of the distance, and of many looks the nearest error would be told.
        backed_near: as `backed`, for what was seen from nearer than that: what comes into view beside the robot has
            few flies before it is out of view again.
        far_looks: looks for which counts what was seen from farther away.
    """

    most: int = 256
    cell: float = CELL
    backed: int = 3
    sure_to: float = 1.6
    backed_near: int = 1
    far_looks: int = 5

    def __post_init__(self) -> None:
        ranged(self, most=(1, 100_000), cell=(0.01, 5.0, "m"), backed=(1, 1000))
        ranged(self, sure_to=(0.0, RANGE, "m"), backed_near=(1, 1000), far_looks=(1, 1_000_000))


class Surroundings:
    """A short memory of points on obstacles."""

    def __init__(self, looks: int, params: SurroundingsParams | None = None) -> None:
        """`looks` is how many are remembered, at least one."""
        self._params = params or SurroundingsParams()
        self._points = np.zeros((looks, self._params.most, 2))
        self._away = np.zeros((looks, self._params.most))
        self._counts = np.zeros(looks, np.int64)
        self._next = 0

    def clear(self) -> None:
        """Forgets everything."""
        self._counts[:] = 0
        self._next = 0

    def add(self, points: Array, pose: Pose2) -> None:
        """A look's points: `[n, 2]` [m], odometry frame, seen at `pose`. It takes the place of the oldest one."""
        n = min(len(points), self._params.most)
        self._points[self._next, :n] = points[:n]
        self._away[self._next, :n] = np.hypot(points[:n, 0] - pose.x, points[:n, 1] - pose.y)
        self._counts[self._next] = n
        self._next = (self._next + 1) % len(self._counts)

    def points(self) -> Array:
        """`[n, 2]` all that is remembered [m], odometry frame."""
        return np.concatenate([self._points[i, :n] for i, n in enumerate(self._counts)])

    def distances(self, pose: Pose2) -> NDArray[np.float32]:
        """`[SECTORS]` distance [m] of the nearest point in each sector about `pose`; RANGE where there is none.

        Sector k is about the bearing `sector_bearings()[k]`, counter-clockwise from straight behind.
        """
        out = np.full(SECTORS, RANGE, np.float32)
        p = self._params
        ages = (self._next - 1 - np.arange(len(self._counts))) % len(self._counts)
        far = np.where(ages < p.far_looks, p.backed, 0)[:, None]
        enough = np.where(self._away < p.sure_to, p.backed_near, far)
        _nearest(self._points, self._counts, enough, pose.x, pose.y, pose.yaw, p.cell, out)
        return out


def exact_distances(points: Array, pose: Pose2) -> NDArray[np.float32]:
    """`[SECTORS]` as `Surroundings.distances`, of `[n, 2]` points that all count."""
    out = np.full(SECTORS, RANGE, np.float32)
    counts, enough = np.array([len(points)]), np.ones((1, len(points)), np.int64)
    _nearest(points[None], counts, enough, pose.x, pose.y, pose.yaw, CELL, out)
    return out


def sector_bearings() -> Array:
    """`[SECTORS]` bearing [rad] of each sector's middle, from the robot's heading, in (-pi, pi)."""
    return np.asarray((np.arange(SECTORS) + 0.5) * (math.tau / SECTORS) - math.pi, np.float64)


@compiled
def _nearest(points, counts, enough, x, y, yaw, cell, out):
    """Of points [looks, most, 2], those that count: `enough` > 0, the points that must be about each, itself too."""
    side = int(2.0 * RANGE / cell) + 3
    cells = np.zeros((side, side), np.int32)
    cos, sin = math.cos(yaw), math.sin(yaw)
    for i in range(len(counts)):
        for k in range(counts[i]):
            a, b = points[i, k, 0] - x, points[i, k, 1] - y
            u, v = int((a + RANGE) / cell) + 1, int((b + RANGE) / cell) + 1
            if enough[i, k] > 0 and 0 < u < side - 1 and 0 < v < side - 1:
                cells[u, v] += 1
    for i in range(len(counts)):
        for k in range(counts[i]):
            a, b = points[i, k, 0] - x, points[i, k, 1] - y
            distance = math.sqrt(a * a + b * b)
            u, v = int((a + RANGE) / cell) + 1, int((b + RANGE) / cell) + 1
            if enough[i, k] == 0 or distance >= RANGE or not (0 < u < side - 1 and 0 < v < side - 1):
                continue
            bearing = math.atan2(-sin * a + cos * b, cos * a + sin * b)
            sector = min(int((bearing + math.pi) / (2.0 * math.pi) * len(out)), len(out) - 1)
            if distance < out[sector] and cells[u - 1 : u + 2, v - 1 : v + 2].sum() >= enough[i, k]:
                out[sector] = distance
