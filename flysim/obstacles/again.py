"""What one stop's flies lie on, looked for from the other stops: how far up it goes on, as they see it.

The stops that stand near an obstacle have most of its flies, and do not see its top; those that do see it are far away,
and of a thin post have a fly or two, or none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flysim.compute.compiled import kernel
from flysim.compute.vectors import add
from flysim.flies.threads import share
from flysim.geometry.frames import inverse, transform
from flysim.geometry.rig import ImagePair
from flysim.obstacles.climb import MISPLACED, TOLD, climb, upright
from flysim.obstacles.flat import compared, right_of
from flysim.obstacles.reach import OWN, UPRIGHT, allowance
from flysim.products.cloud import FlyCloud, SeenAgain
from flysim.products.frame import Frame

APART = 0.08  # [m] flies nearer to one another than this are asked once
FACING = 0.3  # least cosine between a fly's normal and the way to a camera for its surface to be seen from there
NEAREST, FARTHEST = 0.2, 4.5  # [m] of depth at which it is looked for
BORDER = OWN + 1  # [px] of the picture in which it is not
ROWS = 5  # that it must be seen to go on
ENOUGH = 200  # flies of a stop that tell what its pixels differ by


def seen_again(frames: Sequence[tuple[Frame, ImagePair]], cloud: FlyCloud, floor: float) -> SeenAgain:
    """How far up the surfaces of some flies go on, as the stops see them that are not their own.

    Args:
        frames: of all stops, each with the pair as its flies saw it.
        cloud: the flies of those frames.
        floor: flies lower than this lie on the floor [m].
    """
    asked = _chosen(cloud, floor)
    found = [part for frame, pair in frames if (part := _from(frame, pair, cloud, asked)) is not None]
    if not found:
        return SeenAgain.nothing()
    return SeenAgain(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _chosen(cloud: FlyCloud, floor: float) -> NDArray[np.int64]:
    """The surest upright fly in each cell of space."""
    flies = np.flatnonzero((np.abs(cloud.normals[:, 2]) < UPRIGHT) & (cloud.points[:, 2] > floor))
    flies = flies[np.argsort(np.linalg.norm(cloud.spread[flies], axis=1), kind="stable")]
    cells = np.floor(cloud.points[flies] / APART).astype(np.int64)
    return flies[np.unique(cells, axis=0, return_index=True)[1]] if len(flies) else flies


def _from(frame: Frame, pair: ImagePair, cloud: FlyCloud, asked: NDArray[np.int64]) -> SeenAgain | None:
    """What one stop sees again of the flies asked for; None where it sees none."""
    T, camera = inverse(frame.T_world_left), pair.rig.left
    R, up = T[:3, :3], T[:3, 2]
    flies = asked[cloud.stop[asked] != frame.index]
    points, normals = transform(T, cloud.points[flies]), cloud.normals[flies] @ R.T
    ahead = (points[:, 2] > NEAREST) & (points[:, 2] < FARTHEST)
    ahead &= -(normals * points).sum(axis=1) > FACING * np.linalg.norm(points, axis=1)
    flies, points, normals = flies[ahead], points[ahead], normals[ahead]
    pixels = np.rint(camera.project(points))
    within = camera.contains(pixels, BORDER)
    flies, points, normals, pixels = flies[within], points[within], normals[within], pixels[within].astype(np.int64)
    own = np.flatnonzero(cloud.stop == frame.index)[:ENOUGH]
    if not len(flies) or not len(own):
        return None
    limit = _allowed(frame, pair, cloud, own)
    planes, shown = upright(camera, up, points, normals), np.zeros(len(flies), np.bool_)
    to_right, taken = right_of(pair.rig), np.zeros(1, np.int64)
    share(_shown, taken, pair.left, pair.right, to_right, pixels, planes, limit, shown)
    flies, points, normals, pixels = flies[shown], points[shown], normals[shown], pixels[shown]
    end, step, ended = climb(pair, limit, up, points, normals, pixels)
    went = (end - points) @ up > ROWS * (step @ up)
    T = frame.T_world_left
    stop = np.full(went.sum(), frame.index, np.int32)
    return SeenAgain(flies[went], stop, transform(T, end[went]), step[went] @ T[:3, :3].T, ended[went])


def _allowed(frame: Frame, pair: ImagePair, cloud: FlyCloud, own: NDArray[np.int64]) -> float:
    """`reach.allowance` of a stop, by some of its own flies."""
    T = inverse(frame.T_world_left)
    points, normals = transform(T, cloud.points[own]), cloud.normals[own] @ T[:3, :3].T
    planes = normals / (normals * points).sum(axis=1, keepdims=True) @ np.linalg.inv(pair.rig.left.K)
    return allowance(pair, np.rint(cloud.uv[own]).astype(np.int64), planes)


@kernel
def _shown(lane, taken, left, right, to_right, pixels, planes, allowed, shown):
    """Fills `shown` `[n]`, whether the pixels about a place have contrast and are alike at its depth."""
    while True:
        n = add(taken, 0, 1)
        if n >= len(pixels):
            return
        different = contrast = least = 0.0
        count = 0
        for j in range(-OWN, OWN + 1):
            for i in range(-OWN, OWN + 1):
                e, g = compared(left, right, to_right, planes, n, pixels[n, 0] + i, pixels[n, 1] + j)
                least = min(least, e)
                different += e
                contrast += g
                count += 1
        alike = different <= MISPLACED**2 * contrast + count * allowed
        shown[n] = least >= 0.0 and alike and contrast > count * TOLD * allowed
