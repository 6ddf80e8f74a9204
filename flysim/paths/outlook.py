"""What a robot would see of the targets from each place it could stand at, in each of sixteen directions."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from flysim.geometry.frames import Array, inverse, transform
from flysim.geometry.rig import StereoRig
from flysim.paths.grid import Grid
from flysim.paths.target import BANDS, Targets

HEADINGS = 16
NEAREST, FARTHEST = 0.6, 2.5  # [m] from the camera
SHARP = 1.2  # [m] nearer than this depth is as good as it gets; its error grows with the square
MOST_SLANT = math.radians(65.0)
BORDER = 12.0  # [px] a window of the matcher and more
AT_ONCE = 200_000  # pairs of place and target in memory


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RobotGeometry:
    """What a path has to know of the robot.

    Attributes:
        radius: of the circle about its axis that holds it [m].
        height: [m]
        rig: its cameras.
        T_base_left: `[4, 4]` left optical frame in base_link.
        max_range: [m] along the optical axis; what is farther is not looked at.
    """

    radius: float
    height: float
    rig: StereoRig
    T_base_left: Array
    max_range: float

    def __post_init__(self) -> None:
        for name in ("radius", "height", "max_range"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise ValueError(f"{name} must be > 0 m, got {getattr(self, name)}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outlook:
    """Every view that there is to choose from.

    Attributes:
        xy: `[v, 2]` where the robot stands [m].
        yaw: `[v]` where it looks [rad].
        place: `[v]` index of the place; views of one place differ in yaw alone.
        starts: `[v + 1]` where each view's entries begin in the two that follow.
        columns: `[e]` what is seen: 3 i, 3 i + 1, 3 i + 2 are foot, middle and top of target i.
        quality: `[e]` how well: over 0, 1 is best.
    """

    xy: Array
    yaw: Array
    place: NDArray[np.intp]
    starts: NDArray[np.intp]
    columns: NDArray[np.intp]
    quality: NDArray[np.float32]

    def entries(self, view: int) -> tuple[NDArray[np.intp], NDArray[np.float32]]:
        """What a view sees, and how well."""
        at = slice(self.starts[view], self.starts[view + 1])
        return self.columns[at], self.quality[at]


def outlook(grid: Grid, targets: Targets, robot: RobotGeometry, places: Array, yaws: Array | None = None) -> Outlook:
    """What is seen from `places` `[p, 2]` [m], in sixteen directions or in those of `yaws` `[p]`."""
    heading = np.linspace(0.0, 2.0 * math.pi, HEADINGS, endpoint=False, dtype=np.float64)
    count = HEADINGS if yaws is None else 1
    place, target = _in_range(grid, targets, robot, places)
    rows, columns, quality = [], [], []
    for start in range(0, len(place), AT_ONCE):
        p, t = place[start : start + AT_ONCE], target[start : start + AT_ONCE]
        clear = _unhidden(grid, targets, robot, places[p], t)
        p, t, clear = p[clear.any(axis=1)], t[clear.any(axis=1)], clear[clear.any(axis=1)]
        for h in range(count):
            yaw = np.full(len(p), heading[h]) if yaws is None else yaws[p]
            value = _shown(targets, robot, places[p], yaw, t) * clear
            k, band = np.nonzero(value)
            rows.append(p[k] * count + h)
            columns.append(t[k] * BANDS + band)
            quality.append(value[k, band])
    row, column = np.concatenate(rows or [np.empty(0, int)]), np.concatenate(columns or [np.empty(0, int)])
    order = np.lexsort((column, row))
    return Outlook(
        xy=np.repeat(places, count, axis=0),
        yaw=np.tile(heading, len(places)) if yaws is None else yaws,
        place=np.repeat(np.arange(len(places)), count),
        starts=np.searchsorted(row[order], np.arange(len(places) * count + 1)),
        columns=column[order],
        quality=np.concatenate(quality or [np.empty(0)])[order].astype(np.float32),
    )


def _in_range(
    grid: Grid, targets: Targets, robot: RobotGeometry, places: Array
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs of a place and a target that faces it, near enough."""
    if not len(places) or not len(targets.xy):
        return np.empty(0, dtype=np.intp), np.empty(0, dtype=np.intp)
    far = min(FARTHEST, robot.max_range)
    near = KDTree(targets.xy).query_ball_point(places, far)
    place = np.repeat(np.arange(len(places)), [len(n) for n in near])
    target = np.array([t for n in near for t in sorted(n)], dtype=np.intp)
    to = places[place] - targets.xy[target]
    distance = np.hypot(*to.T)
    facing = (to * targets.normal[target]).sum(axis=1)
    keep = (distance >= NEAREST) & (facing >= distance * math.cos(MOST_SLANT))
    return place[keep], target[keep]


def _unhidden(
    grid: Grid, targets: Targets, robot: RobotGeometry, xy: Array, target: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """`[n, 3]` whether the line from the camera to foot, middle and top of a target is free."""
    eye = float(robot.T_base_left[2, 3])
    ends = targets.xy[target]
    distance = np.hypot(*(ends - xy).T)
    clear = np.ones((len(target), BANDS), dtype=bool)
    steps = math.ceil(float(distance.max(initial=0.0)) / (2.0 * grid.cell))
    for k in range(1, steps):
        share = np.minimum(k * 2.0 * grid.cell / np.maximum(distance, 1e-9), 1.0)
        i, j = grid.cells(xy + share[:, None] * (ends - xy)).T
        z = eye + share[:, None] * (targets.z[target] - eye)
        clear &= ~((grid.top[i, j][:, None] > z) & (grid.bottom[i, j][:, None] < z) & (share < 1.0)[:, None])
    return clear


def _shown(targets: Targets, robot: RobotGeometry, xy: Array, yaw: Array, target: NDArray[np.intp]) -> Array:
    """`[n, 3]` how well views show foot, middle and top of targets, were nothing in the way."""
    dx, dy = (targets.xy[target] - xy).T
    c, s = np.cos(yaw), np.sin(yaw)
    ahead, aside = c * dx + s * dy, c * dy - s * dx
    value = np.zeros((len(target), BANDS))
    front = np.flatnonzero(ahead > np.abs(aside) * 0.5)  # cheap, before the exact test
    if not len(front):
        return value
    points = np.empty((len(front), BANDS, 3))
    points[..., 0], points[..., 1] = ahead[front, None], aside[front, None]
    points[..., 2] = targets.z[target[front]]
    optical = transform(inverse(robot.T_base_left), points.reshape(-1, 3))
    left, right = robot.rig.project(optical)
    both = robot.rig.left.contains(left, BORDER) & robot.rig.right.contains(right, BORDER)
    depth = optical[:, 2]
    both &= (depth >= NEAREST) & (depth <= robot.max_range)
    sharp = (SHARP / np.maximum(depth, SHARP)) ** 2
    distance = np.hypot(dx[front], dy[front])
    straight = -(dx[front] * targets.normal[target[front], 0] + dy[front] * targets.normal[target[front], 1]) / distance
    good = np.clip(0.4 + 0.6 * (straight - math.cos(MOST_SLANT)) / 0.35, 0.4, 1.0)
    value[front] = (both * sharp).reshape(-1, BANDS) * good[:, None]
    return value
