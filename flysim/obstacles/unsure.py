"""Far clusters that one stop alone saw, and that a pixel of parallax would put onto another: no obstacles.

Textures that a renderer or a sensor samples coarsely pull disparities towards whole pixels ("pixel locking"; Shimizu
and Okutomi, "Sub-pixel estimation error cancellation on area-based matching", IJCV 63, 2005). Far away half a pixel is
more than flies of one obstacle may lie apart, and a piece of a wall would stand before the wall.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from flysim.geometry.frames import Array, inverse, transform
from flysim.products.cloud import FlyCloud
from flysim.products.frame import Frame
from flysim.products.swarm import Swarm
from flysim.stereo.told import speeds

SHIFTS = np.array([-1.0, -0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0])  # [px] that matches may be wrong by
MOST = 0.8  # share of a cluster's flies that one of them puts onto another cluster

Groups = list[NDArray[np.int64]]


def sure(cloud: FlyCloud, groups: Groups, swarms: Sequence[tuple[Frame, Swarm]], distance: float) -> Groups:
    """The clusters without those that are likely a piece of another, misplaced.

    Such a one has all its flies from one stop, so far away that a pixel of parallax moves them by more than
    `distance`, and within a pixel they would lie on a larger cluster. They are left out: put where that one is, they
    would say nothing new. What several stops saw at one place is there.

    Args:
        cloud: what the flies belong to.
        groups: `[n]` indices of the flies of each cluster.
        swarms: the frames that they were seen in.
        distance: [m] flies nearer to one another than this may belong to one obstacle.
    """
    frames = {frame.index: frame for frame, _ in swarms}
    return [flies for flies in groups if not _misplaced(cloud, groups, flies, frames, distance)]


def _misplaced(
    cloud: FlyCloud, groups: Groups, flies: NDArray[np.int64], frames: dict[int, Frame], distance: float
) -> bool:
    frame = frames.get(int(cloud.stop[flies[0]]))
    if frame is None or np.any(cloud.stop[flies] != frame.index):
        return False
    points = cloud.points[flies]
    shifted = _shifted(points, frame)
    if np.median(np.linalg.norm(shifted[-1] - points, axis=1)) <= distance:
        return False
    low, high = shifted.min(axis=(0, 1)) - distance, shifted.max(axis=(0, 1)) + distance
    for other in groups:
        if len(other) <= len(flies):
            continue
        near = cloud.points[other]
        near = near[np.all((near >= low) & (near <= high), axis=1)]
        if not len(near):
            continue
        gap = KDTree(near).query(shifted.reshape(-1, 3), distance_upper_bound=distance)[0]
        if np.isfinite(gap).reshape(shifted.shape[:2]).mean(axis=1).max() >= MOST:
            return True
    return False


def _shifted(points: Array, frame: Frame) -> Array:
    """`[len(SHIFTS), n, 3]` where points [m, world] would be if the matches they come from were wrong by SHIFTS.

    Side by side that is a disparity's; of two pictures of one camera on its way each pixel has a speed of its own.
    """
    eye, rig = frame.T_world_left[:3, 3], frame.pair.rig
    ray = points - eye
    depth = np.maximum(ray @ frame.T_world_left[:3, 2], 1e-6)
    speed = speeds(rig, rig.left.project(transform(inverse(frame.T_world_left), points)), 1.0 / depth)
    moved = speed / depth
    wrong = np.maximum(moved + SHIFTS[:, None], 1e-3)
    return eye + ray * (moved / wrong)[..., None]
