"""Outlines of bodies in a plane of the world, for the figures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flysim.geometry.frames import Array, transform
from flysim.geometry.plan_view import plan_hull
from flysim.products.obstacle import Obstacle
from flysim.truth.truth import Truth
from flysim.worlds.model import Link, Part
from flysim.worlds.shapes import Cylinder, Sphere

XY, XZ, YZ = (0, 1), (0, 2), (1, 2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PlacedPart:
    """A convex hull's points of one part of a body, where it stands at the end of the drive.

    Attributes:
        points: `[M, 3]` [m], world frame.
        structure: the body is ground or wall.
    """

    points: Array
    structure: bool

    @property
    def flat(self) -> bool:
        """Whether it lies on the ground like a floor: nothing that an outline from above should show."""
        return bool(np.ptp(self.points[:, 2]) < 0.02 or (self.structure and self.points[:, 2].max() < 0.005))

    def outline(self, axes: tuple[int, int]) -> NDArray[np.float64]:
        """`[K, 2]` outline in the plane of two world axes."""
        return hull(self.points[:, axes])


def placed_parts(truth: Truth | None) -> Iterator[PlacedPart]:
    """Every visible part of the world, at the pose of its link at the last stop; none where no truth is known."""
    if truth is None:
        return
    for link, T_world_link in zip(truth.world.links, truth.motion.last, strict=True):
        for part in visible_parts(link):
            points = transform(T_world_link @ part.T_link_part, part.shape.outline())
            yield PlacedPart(points=points, structure=link.structure)


def visible_parts(link: Link) -> Iterable[Part]:
    """What a camera sees of a link; its collision shapes where the file gives nothing to see."""
    return link.visuals or link.collisions


def believed_points(obstacle: Obstacle) -> Array:
    """`[M, 3]` points [m, world frame] whose convex hull is the body that an obstacle was taken for."""
    radius, height = float(obstacle.size[0]) / 2.0, float(obstacle.size[2])
    if obstacle.shape == "cylinder":
        return Cylinder(radius, height).outline() + obstacle.center
    if obstacle.shape == "sphere":
        top = float(obstacle.center[2]) + height / 2.0
        points = Sphere(radius).outline() + np.append(obstacle.center[:2], top - radius)
        return np.maximum(points, (-np.inf, -np.inf, 0.0))  # what lies below the floor does not show
    return box_corners(obstacle.center, obstacle.size, obstacle.yaw)


def box_corners(center: ArrayLike, size: ArrayLike, yaw: float) -> Array:
    """`[8, 3]` corners [m] of an upright box turned by `yaw` [rad]."""
    signs = np.stack(np.meshgrid((-0.5, 0.5), (-0.5, 0.5), (-0.5, 0.5)), axis=-1).reshape(-1, 3)
    c, s = np.cos(yaw), np.sin(yaw)
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return (signs * np.asarray(size, float)) @ rotation.T + np.asarray(center, float)


def inside_box(points: Array, center: ArrayLike, size: ArrayLike, yaw: float, margin: float) -> NDArray[np.bool_]:
    """`[N]` bool: the point lies in the upright box, or at most `margin` [m] beside it along its axes."""
    c, s = np.cos(yaw), np.sin(yaw)
    d = points - np.asarray(center, float)
    local = np.stack([c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0], d[:, 2]], axis=1)
    return np.all(np.abs(local) <= np.asarray(size, float) / 2.0 + margin, axis=1)


def hull(points: Array) -> NDArray[np.float64]:
    """`[K, 2]` corners of the convex hull of `[M, 2]` points, in turn; a segment for points on a line."""
    return points[plan_hull(points)]
