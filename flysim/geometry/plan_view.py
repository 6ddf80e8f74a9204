"""Shapes seen from above: convex hulls, smallest rectangles, extents along a heading."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from flysim.geometry.frames import Array

# [m] What stands nearer together is one obstacle: to who finds them, who judges them, and who plans a way round them.
APART = 0.09
SIDES = 16  # of the polygon that leaves out most points before a hull is made
NOISE = 1e-4  # [m] of rendered depth


class Rectangle(NamedTuple):
    """A rectangle on the floor: `length >= width` [m], its length at heading `yaw` [rad]."""

    center: Array  # [2] m
    length: float
    width: float
    yaw: float


def fold_yaw(yaw: float) -> float:
    """The heading of the same box in [-pi/2, pi/2): half a turn changes nothing."""
    folded = (yaw + math.pi / 2.0) % math.pi - math.pi / 2.0
    return -math.pi / 2.0 if folded >= math.pi / 2.0 else folded


def axes(yaw: float) -> Array:
    """`[2, 2]` unit rows: the length and the width direction of a box at heading `yaw`."""
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, s], [-s, c]])


def plan_hull(xy: Array) -> NDArray[np.intp]:
    """Indices of the convex hull of `[N, 2]` points, N >= 1; the two ends where all lie in a line.

    Of many points, those that lie in the polygon of the farthest ones, or 0.1 mm off it, are left out first
    (Akl and Toussaint, "A fast convex hull algorithm", 1978).
    """
    if len(xy) > 1000:
        outer = _outer(xy)
        return outer[plan_hull(xy[outer])] if len(outer) < len(xy) else _hull(xy)
    return _hull(xy)


def _outer(xy: Array) -> NDArray[np.intp]:
    x, y = np.ascontiguousarray(xy.T)
    angles = np.arange(SIDES) * (2.0 * math.pi / SIDES)
    corners = np.array([np.argmax(math.cos(a) * x + math.sin(a) * y) for a in angles])
    inside = np.ones(len(xy), dtype=bool)
    for i, j in zip(corners, np.roll(corners, -1), strict=True):
        ex, ey = xy[j] - xy[i]
        inside &= ex * (y - y[i]) - ey * (x - x[i]) >= -NOISE * math.hypot(ex, ey)
    inside[corners] = False
    return np.flatnonzero(~inside)


def _hull(xy: Array) -> NDArray[np.intp]:
    if len(xy) > 2:
        try:
            return ConvexHull(xy).vertices.astype(np.intp)
        except QhullError:
            pass  # all in one line or in one place
    offset = xy - xy[0]
    along = offset @ offset[np.argmax((offset**2).sum(axis=1))]
    return np.unique([along.argmin(), along.argmax()])


def smallest_rectangle(xy: Array) -> Rectangle:
    """The rectangle of least area round `[N, 2]` points: one of its sides lies on a side of their hull.

    (Freeman and Shapira, "Determining the minimum-area encasing rectangle", CACM 18(7), 1975.)
    """
    hull = xy[plan_hull(xy)]
    sides = np.roll(hull, -1, axis=0) - hull
    # Headings are rounded before they are made unique, so that a tie does not hang on the last bit.
    yaws = np.unique(np.round(np.arctan2(sides[:, 1], sides[:, 0]) % (math.pi / 2.0), 9))
    low, high = zip(*(extent(hull, yaw) for yaw in yaws), strict=True)
    spans = np.array(high) - np.array(low)
    area = spans.prod(axis=1)
    best = int(np.flatnonzero(area <= area.min() * (1.0 + 1e-9) + 1e-15)[0])
    yaw, (length, width) = float(yaws[best]), spans[best].tolist()
    center = axes(yaw).T @ ((low[best] + high[best]) / 2.0)
    if width > length:
        length, width, yaw = width, length, yaw + math.pi / 2.0
    return Rectangle(center, length, width, fold_yaw(yaw))


def extent(xy: Array, yaw: float) -> tuple[Array, Array]:
    """`[2]` least and `[2]` greatest coordinate of `[N, 2]` points along a box's axes at heading `yaw`."""
    along = xy @ axes(yaw).T
    return along.min(axis=0), along.max(axis=0)
