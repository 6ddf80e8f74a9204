"""What kind of body a cluster is, by which of them its flies lie nearest to."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array
from flysim.obstacles.box import fit_box
from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.round import fit_circle, fit_sphere
from flysim.products.cloud import FlyCloud
from flysim.products.obstacle import Shape

FAR_OFF = 0.03  # [m] a fly further off its body counts no more than this: it may be astray
SURE = 0.003  # [m] of noise: no fly counts for more than one as sure as this
ROUNDER = 1.05  # a round body may fit so much worse than the box: a thin post fits both
NO_BODY = 0.012  # [m] mean distance of the flies above which a cluster is none of the three
DEEP = 0.03  # [m] and twice its own noise: a fly deeper within a body than this lies on no side of it
HOLLOW = 0.03  # share of such flies from which a cluster is none of the three: an L, or a slab on legs


class FittedShape(NamedTuple):
    """The body of a cluster: `center` `[3]`, `size` `[3]` [m] and `yaw` [rad] of its upright box."""

    shape: Shape
    center: Array
    size: Array
    yaw: float


def fit_solid(cloud: FlyCloud, flies: NDArray[np.int64], params: ObstacleParams) -> FittedShape:
    """The box, upright cylinder or sphere that a cluster's flies lie on; "other", with its box, if they lie on none.

    Args:
        cloud: what the flies belong to.
        flies: `[n]` the cluster's.
        params: the share that may lie astray beyond a side, and whether round bodies are looked for.
    """
    points, normals, spread = cloud.points[flies], cloud.normals[flies], cloud.spread[flies]
    box = FittedShape("box", *fit_box(cloud, flies, params.trim))
    if not params.round:
        return box
    noise = np.linalg.norm(spread, axis=1)
    found, off = box, _mean(distance_to(points, box), noise)
    needed = ROUNDER * off
    for body in (_cylinder(points, normals, spread, float(box.size[2])), _sphere(points, spread)):
        if body is not None and (distance := _mean(distance_to(points, body), noise)) < needed:
            found, off, needed = body, distance, distance
    deep = -distance_to(points, found) > DEEP + 2.0 * noise
    return found if off <= NO_BODY and deep.mean() < HOLLOW else box._replace(shape="other")


def _cylinder(points: Array, normals: Array, spread: Array, height: float) -> FittedShape | None:
    circle = fit_circle(points, normals, spread)
    if circle is None:
        return None
    width = 2.0 * circle.radius
    return FittedShape("cylinder", np.array([*circle.center, height / 2.0]), np.array([width, width, height]), 0.0)


def _sphere(points: Array, spread: Array) -> FittedShape | None:
    ball = fit_sphere(points, spread)
    if ball is None:
        return None
    width, height = 2.0 * ball.radius, float(ball.center[2]) + ball.radius
    if height <= 0.0:
        return None
    return FittedShape("sphere", np.array([*ball.center[:2], height / 2.0]), np.array([width, width, height]), 0.0)


def _mean(distance: Array, noise: Array) -> float:
    """Mean distance [m] of flies to a surface, none counted for more than FAR_OFF, the unsure ones for less."""
    return float(np.average(np.minimum(np.abs(distance), FAR_OFF), weights=1.0 / (noise**2 + SURE**2)))


def distance_to(points: Array, body: FittedShape) -> Array:
    """`[N]` distance [m] of flies to the surface of a body, below 0 within it."""
    local = points - body.center
    radius, half = body.size[0] / 2.0, body.size / 2.0
    if body.shape == "sphere":
        middle = np.array([0.0, 0.0, body.size[2] / 2.0 - radius])  # below it, where the sphere is sunk into the floor
        return np.linalg.norm(local - middle, axis=1) - radius
    if body.shape == "cylinder":
        beyond = np.stack([np.linalg.norm(local[:, :2], axis=1) - radius, np.abs(local[:, 2]) - half[2]], axis=1)
    else:
        c, s = np.cos(body.yaw), np.sin(body.yaw)
        local = np.stack([c * local[:, 0] + s * local[:, 1], c * local[:, 1] - s * local[:, 0], local[:, 2]], axis=1)
        beyond = np.abs(local) - half
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return outside + np.minimum(beyond.max(axis=1), 0.0)
