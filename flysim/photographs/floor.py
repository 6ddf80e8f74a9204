"""The floor under a camera, found among flies: the lowest plane that many of them lie on and none below.

RANSAC (Fischler and Bolles, 1981) with one fly a sample, since a fly carries the normal of its surface; the plane of
the best one is then fitted to all flies on it, the surer ones first.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import R_BODY_OPTICAL, Array, se3

SAMPLES = 400
UPRIGHT = math.cos(math.radians(50.0))  # a camera that is tilted by more sees no floor
ALIKE = math.cos(math.radians(25.0))  # of a fly's normal and the plane's
THICK = 0.004  # [of the depth] a fly lies on the plane within this, and three times its own noise
SHARE, LEAST = 0.04, 40  # of all flies that lie on a floor at least, and how many
BELOW = 0.03  # of all flies that may lie below it: false matches
WIDE = 0.15  # [of the median depth] a floor reaches at least so far along and across
ROUNDS = 4  # of fitting


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Floor:
    """A plane that things stand on, as seen by the left camera.

    Attributes:
        up: `[3]` unit normal, left optical frame.
        height: of the camera above it [m].
        pitch_deg: how far the camera looks down [degrees].
        roll_deg: how far it is rolled, clockwise as it looks [degrees].
        share: of the flies that lie on it.
        spread: deviation of those flies from it [m].
    """

    up: Array
    height: float
    pitch_deg: float
    roll_deg: float
    share: float
    spread: float

    @property
    def T_base_left(self) -> Array:
        """`[4, 4]` the left camera above the floor: x ahead, z up."""
        ahead = np.array([0.0, 0.0, 1.0]) - self.up[2] * self.up
        ahead /= np.linalg.norm(ahead)
        return se3(np.stack([ahead, np.cross(self.up, ahead), self.up]), (0.0, 0.0, self.height))


def without_floor(points: Array) -> Array:
    """`[4, 4]` where a level camera is that sees no floor: heights are measured from below the lowest fly."""
    lowest = float(np.quantile(points[:, 1], 0.999)) if len(points) else 0.0
    depth = float(np.median(points[:, 2])) if len(points) else 1.0
    return se3(R_BODY_OPTICAL, (0.0, 0.0, lowest + 0.25 * depth))


def find_floor(points: NDArray, normals: NDArray, spread: NDArray, *, rng: np.random.Generator) -> Floor | None:
    """The floor that flies lie on; None where there is none.

    Args:
        points, normals, spread: `[N, 3]` as `Swarm` has them: left optical frame [m].
        rng: draws the samples.
    """
    points, normals = np.asarray(points, np.float64), np.asarray(normals, np.float64)
    noise = np.abs(np.asarray(spread, np.float64))
    least = max(LEAST, SHARE * len(points))
    facing = np.flatnonzero(-normals[:, 1] > UPRIGHT)
    if len(facing) < least:
        return None
    middle = float(np.median(points[:, 2]))
    best, up, height = 0.0, np.zeros(3), 0.0
    for k in rng.choice(facing, min(SAMPLES, len(facing)), replace=False):
        n = normals[k]
        h = -float(points[k] @ n)
        score, _ = _score(points, normals, noise, n, h)
        if h > 0.0 and score > best:
            best, up, height = score, n, h
    if best < least:
        return None
    on = np.zeros(len(points), np.bool_)
    for _ in range(ROUNDS):
        _, on = _score(points, normals, noise, up, height)
        if on.sum() < least:
            return None
        up, height = _fitted(points[on], noise[on], up)
    score, on = _score(points, normals, noise, up, height)
    there = points[on]
    if score < least or up @ (0.0, -1.0, 0.0) < UPRIGHT or height <= 0.0 or _narrow(there, up, middle):
        return None
    down, aside = -up[2], up[0]
    return Floor(
        up=up,
        height=height,
        pitch_deg=math.degrees(math.asin(np.clip(down, -1.0, 1.0))),
        roll_deg=math.degrees(math.atan2(-aside, -up[1])),
        share=float(on.mean()),
        spread=float(1.4826 * np.median(np.abs(there @ up + height))),
    )


def _score(points: Array, normals: Array, noise: Array, up: Array, height: float) -> tuple[float, NDArray[np.bool_]]:
    """How many flies lie on a plane, less ten for each one below it that may not; and which."""
    over = points @ up + height
    thick = THICK * points[:, 2] + 3.0 * (noise @ np.abs(up))
    on = (np.abs(over) <= thick) & (normals @ up > ALIKE)
    below = float((over < -2.0 * thick).sum()) - BELOW * len(points)
    return float(on.sum()) - 10.0 * max(below, 0.0), on


def _fitted(points: Array, noise: Array, up: Array) -> tuple[Array, float]:
    """The plane through points by least squares, each by how sure it is along the normal."""
    weight = 1.0 / (noise @ np.abs(up) + 1e-4) ** 2
    weight /= weight.sum()
    middle = weight @ points
    away = points - middle
    n = np.linalg.eigh((away * weight[:, None]).T @ away)[1][:, 0]
    n = n if n @ up > 0.0 else -n
    return n, -float(middle @ n)


def _narrow(points: Array, up: Array, depth: float) -> bool:
    """Whether the points make a ledge, and no floor."""
    ahead = np.array([0.0, 0.0, 1.0]) - up[2] * up
    ahead /= np.linalg.norm(ahead)
    along = [np.ptp(np.quantile(points @ axis, (0.02, 0.98))) for axis in (ahead, np.cross(up, ahead))]
    return bool(min(along) < WIDE * depth)
