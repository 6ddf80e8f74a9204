"""How much of an obstacle's error a wrong belief about the cameras explains, without asking any engine.

Every surface point that both cameras saw has two true pixels. Who takes them for pixels of the rig that is believed,
and is right in everything else, puts the point somewhere else: by how far, over all points of an obstacle, is what the
calibration explains. What is left is the engine's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flysim.evaluate.dimensions import compare
from flysim.geometry.frames import Array, inverse, transform
from flysim.geometry.rig import StereoRig
from flysim.products.obstacle import Obstacle
from flysim.truth.obstacles import TrueObstacle
from flysim.truth.sight import Sight

MOST_POINTS = 2000  # of an obstacle at a stop
LEAST_POINTS = 10
NEAREST = 0.1  # [px] of disparity: what seems to lie farther than that is no obstacle


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Explained:
    """What a wrong belief alone does to an obstacle.

    Attributes:
        center: `[2]` by which it moves the centre on the ground, world frame [m].
        size: `[3]` by which it changes length, width and height [m].
    """

    center: Array
    size: Array


def explained(true: TrueObstacle, sights: Sequence[Sight], believed: StereoRig, yaw: float) -> Explained | None:
    """What calibration alone does to what was visible of an obstacle; None where too little was.

    Rows are taken to meet: whoever matches along them loses or mends what a roll or a shift of rows does.

    Args:
        true: the obstacle.
        sights: what both cameras saw, stop by stop.
        believed: the rig that the robot takes its cameras for.
        yaw: of the axes that sizes are along [rad].
    """
    extent = true.visible_extent(yaw)
    places, shifts, weights = [], [], []
    for sight in sights:
        found = _misplaced(true, sight, believed)
        if found is not None:
            places.append(found[0])
            shifts.append(found[1])
            weights.append(found[2])
    if extent is None or sum(map(len, places)) < LEAST_POINTS:
        return None
    center, size = extent
    R = np.array([[np.cos(yaw), np.sin(yaw), 0.0], [-np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    local = (np.concatenate(places) - center) @ R.T
    weight = np.sqrt(np.concatenate(weights))[:, None]
    # A shift and a stretch. Where a side alone was seen, how it stretches across is not known: it does not.
    A = np.concatenate([np.ones((len(local), 1)), local], axis=1)
    held = 0.02 * np.sqrt(len(local)) * np.eye(4)[1:] * float(weight.mean())
    fit = np.linalg.lstsq(
        np.concatenate([A * weight, held]),
        np.concatenate([np.concatenate(shifts) @ R.T * weight, np.zeros((3, 3))]),
        rcond=None,
    )[0]
    return Explained(center=(fit[0] @ R)[:2], size=np.diag(fit[1:]) * size)


def explanation(
    pairs: Sequence[tuple[TrueObstacle, Obstacle]], sights: Sequence[Sight], believed: StereoRig
) -> dict[str, Any]:
    """What a report says of it, for the obstacles that were visible and found.

    Args:
        pairs: the true ones, each with the estimate that stands for it.
        sights: what both cameras saw, stop by stop.
        believed: the rig that the robot takes its cameras for.

    Returns:
        "center_share" and "size_share": what share of the errors, all together, is gone once what calibration does is
        taken from them; 0 where nothing is. "obstacles[]": "name", "center_m" and "size_m", what it does to each.
    """
    rows, left, before = [], np.zeros(2), np.zeros(2)
    for true, estimate in pairs:
        found, seen = explained(true, sights, believed, true.yaw), true.visible_extent()
        if found is None or seen is None:
            continue
        off = np.asarray(estimate.center, np.float64)[:2] - seen[0][:2]
        larger = compare(true, estimate).size_estimated - seen[1]
        before += np.linalg.norm(off), np.abs(larger).sum()
        left += np.linalg.norm(off - found.center), np.abs(larger - found.size).sum()
        rows.append({"name": true.name, "center_m": float(np.linalg.norm(found.center)), "size_m": found.size.tolist()})
    shares = np.clip(1.0 - left / np.maximum(before, 1e-9), 0.0, 1.0)
    return {"center_share": float(shares[0]), "size_share": float(shares[1]), "obstacles": rows}


def _misplaced(true: TrueObstacle, sight: Sight, believed: StereoRig) -> tuple[Array, Array, Array] | None:
    """`[N, 3]` points of an obstacle [m, world], `[N, 3]` how far off they seem, `[N]` how much each counts."""
    left, right = sight.views
    v, u = np.nonzero(sight.seen & np.isin(left.link, true.links))
    every = max(len(u) // MOST_POINTS, 1)
    u, v = u[::every], v[::every]
    if not len(u):
        return None
    uv = np.stack([u, v], axis=1).astype(np.float64)
    points = left.camera.unproject(uv, left.depth[v, u])
    T_right_left = inverse(right.T_world_optical) @ left.T_world_optical
    uv_right = _unrolled(
        right.camera.project(transform(T_right_left, points)), T_right_left, right.camera.cx, right.camera.cy
    )
    disparity = uv[:, 0] - uv_right[:, 0] - (believed.left.cx - believed.right.cx)
    seen = np.isfinite(disparity) & (disparity > NEAREST)
    if not seen.any():
        return None
    depth = believed.left.fx * believed.baseline / disparity[seen]
    seeming = believed.left.unproject(uv[seen], depth)
    T, points = left.T_world_optical, points[seen]
    return transform(T, points), (seeming - points) @ T[:3, :3].T, 1.0 / points[:, 2] ** 2


def _unrolled(uv: Array, T_right_left: Array, cx: float, cy: float) -> Array:
    """Pixels of a rolled camera as they were if it were not."""
    R = T_right_left[:3, :3]
    angle = np.arctan2(R[1, 0], R[0, 0])
    c, s = np.cos(angle), np.sin(angle)
    x, y = uv[:, 0] - cx, uv[:, 1] - cy
    return np.stack([c * x + s * y + cx, c * y - s * x + cy], axis=1)
