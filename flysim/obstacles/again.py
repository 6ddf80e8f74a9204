"""Obstacles looked for again at every stop, where they are known to stand: how far up each goes on, as seen from there.

The stops that stand near an obstacle have most of its flies, and do not see its top; those that do see it are far away,
and of a thin post have a fly or two, or none. But by now its sides are known.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flysim.compute.compiled import kernel
from flysim.compute.vectors import add
from flysim.flies.threads import share
from flysim.geometry.frames import Array, inverse, transform
from flysim.geometry.plan_view import axes
from flysim.geometry.rig import ImagePair
from flysim.obstacles.climb import MISPLACED, TOLD, climb, upright
from flysim.obstacles.flat import compared, right_of
from flysim.obstacles.reach import OWN, allowance
from flysim.obstacles.shape import FittedShape
from flysim.products.cloud import FlyCloud, SeenAgain
from flysim.products.frame import Frame

# Of its height, as known, at which a body is looked for. What stands before it may hide all of that and not the rest.
LEVELS, OVER = np.array([0.35, 0.5, 0.65, 0.8, 0.92]), np.array([1.15, 1.35, 1.6])
MANY = 3  # places that high that a stop must see, to see it there at all
TURNS = np.radians([-40.0, -20.0, 0.0, 20.0, 40.0])  # of a round one, from the side that faces a camera
ACROSS = np.array([-0.4, -0.2, 0.0, 0.2, 0.4])  # of a side of a box
FACING = 0.3  # least cosine between a side's normal and the way to a camera for it to be seen from there
NEAREST, FARTHEST = 0.2, 4.0  # [m] of depth; beyond, what stands behind is too near in disparity
BORDER = OWN + 1  # [px] of the picture in which it is not looked for
ROWS = 5  # that it must be seen to go on
ENOUGH = 200  # flies of a stop that tell what its pixels differ by


def seen_again(
    frames: Sequence[tuple[Frame, ImagePair]], cloud: FlyCloud, bodies: Sequence[tuple[NDArray[np.int64], FittedShape]]
) -> SeenAgain:
    """How far up the sides of some bodies go on, as each stop sees it.

    Args:
        frames: of all stops, each with the pair as its flies saw it.
        cloud: the flies of those frames.
        bodies: flies of a cluster, and what was fitted to them. Spheres have no upright sides and are left out.
    """
    found = [part for frame, pair in frames if (part := _from(frame, pair, cloud, bodies)) is not None]
    if not found:
        return SeenAgain.nothing()
    return SeenAgain(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _from(
    frame: Frame, pair: ImagePair, cloud: FlyCloud, bodies: Sequence[tuple[NDArray[np.int64], FittedShape]]
) -> SeenAgain | None:
    """What one stop sees again; None where it sees nothing."""
    T, camera, eye = inverse(frame.T_world_left), pair.rig.left, frame.T_world_left[:3, 3]
    sides = [_sides(body, eye) for _, body in bodies]
    fly = np.repeat([flies[0] for flies, _ in bodies], [len(points) for points, _ in sides])
    over = np.concatenate([points[:, 2] > body.size[2] for (points, _), (_, body) in zip(sides, bodies, strict=True)])
    points = transform(T, np.concatenate([points for points, _ in sides]))
    normals, up = np.concatenate([normals for _, normals in sides]) @ T[:3, :3].T, T[:3, 2]
    ahead = (points[:, 2] > NEAREST) & (points[:, 2] < FARTHEST)
    fly, over, points, normals = fly[ahead], over[ahead], points[ahead], normals[ahead]
    pixels = np.rint(camera.project(points))
    within = camera.contains(pixels, BORDER)
    fly, over, points, normals = fly[within], over[within], points[within], normals[within]
    pixels = pixels[within].astype(np.int64)
    own = np.flatnonzero(cloud.stop == frame.index)[:ENOUGH]
    if not len(fly) or not len(own):
        return None
    limit = _allowed(T, pair, cloud, own)
    planes, shown = upright(camera, up, points, normals), np.zeros(len(fly), np.bool_)
    taken = np.zeros(1, np.int64)
    share(_shown, taken, pair.left, pair.right, right_of(pair.rig), pixels, planes, limit, shown)
    shown &= ~over | (np.bincount(fly[shown & over], minlength=fly.max() + 1)[fly] >= MANY)
    fly, points, normals, pixels = fly[shown], points[shown], normals[shown], pixels[shown]
    end, step, ended = climb(pair, limit, up, points, normals, pixels)
    went = (end - points) @ up > ROWS * (step @ up)
    R, stop = frame.T_world_left[:3, :3], np.full(went.sum(), frame.index, np.int32)
    return SeenAgain(fly[went], stop, transform(frame.T_world_left, end[went]), step[went] @ R.T, ended[went])


def _sides(body: FittedShape, eye: Array) -> tuple[Array, Array]:
    """`[n, 3]` points on the upright sides of a body that face an eye [m, world], and `[n, 3]` their normals."""
    way = (eye - body.center)[:2]
    if body.shape == "sphere":
        return np.empty((0, 3)), np.empty((0, 3))
    if body.shape == "cylinder":
        turn = np.arctan2(way[1], way[0]) + TURNS
        out = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        plan, normals = body.size[0] / 2.0 * out, out
    else:
        plan, normals = np.empty((0, 2)), np.empty((0, 2))
        for axis, along, deep, wide in zip(
            axes(body.yaw), axes(body.yaw)[::-1], body.size[:2], body.size[1::-1], strict=True
        ):
            out = axis if way @ axis > 0.0 else -axis
            if (way - deep / 2.0 * out) @ out > FACING * np.linalg.norm(way - deep / 2.0 * out):
                plan = np.concatenate([plan, deep / 2.0 * out + wide * ACROSS[:, None] * along])
                normals = np.concatenate([normals, np.tile(out, (len(ACROSS), 1))])
    levels = np.concatenate([LEVELS, OVER])
    points = np.empty((len(levels), len(plan), 3))
    points[..., :2], points[..., 2] = body.center[:2] + plan, body.size[2] * levels[:, None]
    flat = np.concatenate([normals, np.zeros((len(normals), 1))], axis=1)
    return points.reshape(-1, 3), np.tile(flat, (len(levels), 1))


def _allowed(T_left_world: Array, pair: ImagePair, cloud: FlyCloud, own: NDArray[np.int64]) -> float:
    """`reach.allowance` of a stop, by some of its own flies."""
    points, normals = transform(T_left_world, cloud.points[own]), cloud.normals[own] @ T_left_world[:3, :3].T
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
