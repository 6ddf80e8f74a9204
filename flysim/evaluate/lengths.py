"""Long structures: a fence or a hedge is no one thing that is found or not. What counts is how much of it was found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from flysim.geometry.frames import Array
from flysim.geometry.plan_view import APART, axes
from flysim.products.cloud import FlyCloud
from flysim.products.obstacle import Obstacle
from flysim.truth.body import surface_distance
from flysim.truth.motion import Motion
from flysim.truth.obstacles import TrueObstacle, one_a_voxel
from flysim.worlds.model import World

LONG = 1.0  # [m] what is longer is a long structure
ON_IT = 0.05  # [m] flies nearer to its surface lie on it
MOSTLY = 0.9  # share of an estimate's flies that lie on a structure, for the estimate to be a piece of it
STEP = 0.05  # [m] of its visible outline, seen from above, of which it is asked whether it was found
WELL_HELD = 0.95  # share of its outline, for a long structure to be found well


@dataclass(frozen=True, slots=True, kw_only=True)
class Pieces:
    """What of a long structure was found.

    Attributes:
        estimates: indices of the estimates that lie on it, the one with most flies first.
        share: of the steps of its visible outline that have a fly of a piece within 9 cm, seen from above: flies that
            far apart still belong together (`APART`).
    """

    estimates: tuple[int, ...]
    share: float


def pieces(
    truth: Sequence[TrueObstacle],
    estimates: Sequence[Obstacle],
    *,
    world: World,
    motion: Motion,
    cloud: FlyCloud,
) -> dict[int, Pieces]:
    """For each visible true obstacle longer than 1 m, the estimates nine tenths of whose flies lie on it.

    An estimate is a piece of one structure at most, that on which most of its flies lie. A structure without pieces is
    left out: it may still be matched as a whole.
    """
    long = [i for i, true in enumerate(truth) if true.visible and true.size[0] > LONG and len(true.visible_points)]
    found: dict[int, list[int]] = {}
    for j, estimate in enumerate(estimates):
        shares = {i: _share_on(truth[i], estimate, world, motion, cloud) for i in long}
        best = max(shares, key=lambda i: shares[i], default=None)
        if best is not None and shares[best] >= MOSTLY:
            found.setdefault(best, []).append(j)
    return {
        i: Pieces(
            estimates=tuple(sorted(of, key=lambda j: (-len(estimates[j].flies), j))),
            share=_held(truth[i], np.concatenate([_flies(truth[i], estimates[j], motion, cloud) for j in of])),
        )
        for i, of in sorted(found.items())
    }


def whole(true: TrueObstacle, parts: Sequence[Obstacle]) -> Obstacle:
    """The pieces of a structure as one estimate: the box round all of theirs, along the true heading."""
    if len(parts) == 1:
        return parts[0]
    turn = axes(true.yaw)
    corners = np.concatenate([_corners(part) for part in parts]) @ turn.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    bottom = min(part.center[2] - part.size[2] / 2.0 for part in parts)
    top = max(part.center[2] + part.size[2] / 2.0 for part in parts)
    return Obstacle(
        shape="other",
        center=np.array([*((low + high) / 2.0 @ turn), (bottom + top) / 2.0]),
        size=np.array([*(high - low), top - bottom]),
        yaw=true.yaw,
        flies=np.sort(np.concatenate([part.flies for part in parts])),
    )


def _corners(part: Obstacle) -> Array:
    """`[4, 2]` of its box, seen from above."""
    signs = np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    return np.asarray(part.center[:2]) + (signs * np.asarray(part.size[:2]) / 2.0) @ axes(part.yaw)


def _flies(true: TrueObstacle, estimate: Obstacle, motion: Motion, cloud: FlyCloud) -> Array:
    """`[N, 3]` flies of an estimate, moved along with the obstacle to where it stood last."""
    flies = np.asarray(cloud.points[estimate.flies], dtype=np.float64).reshape(-1, 3)
    return motion.carry_all(true.links[0], cloud.stop[estimate.flies], flies)


def _share_on(true: TrueObstacle, estimate: Obstacle, world: World, motion: Motion, cloud: FlyCloud) -> float:
    flies = _flies(true, estimate, motion, cloud)
    if not len(flies):
        return 0.0
    offset = np.abs((flies[:, :2] - true.center[:2]) @ axes(true.yaw).T) - true.size[:2] / 2.0
    left = np.flatnonzero(np.all(offset <= ON_IT, axis=1))  # only what is over its box can lie on it
    on = 0
    for i in true.links:
        if not len(left):
            break
        near = surface_distance(world.links[i], motion.last[i], flies[left]) <= ON_IT
        on += int(near.sum())
        left = left[~near]
    return on / len(flies)


def _held(true: TrueObstacle, flies: Array) -> float:
    steps = true.visible_points * (1.0, 1.0, 0.0)
    steps = steps[one_a_voxel(steps, STEP)]
    return float(np.mean(KDTree(flies[:, :2]).query(steps[:, :2])[0] <= APART))
