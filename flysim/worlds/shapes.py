"""The shapes a world is made of, each with its exact distance and its outline."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from flysim.geometry.frames import Array, frozen


def _positive(what: str, *values: float) -> None:
    for value in values:
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{what} must be > 0 m, got {value}")


@dataclass(frozen=True, slots=True)
class Box:
    """A cuboid about its centre."""

    size: tuple[float, float, float]  # [m] along x, y, z

    def __post_init__(self) -> None:
        _positive("a box's size", *self.size)

    def distance(self, points: Array) -> Array:
        """`[N]` distance [m] of `[N, 3]` points (shape's frame) to the surface, from inside or outside."""
        q = np.abs(points) - np.array(self.size) / 2.0
        outside = np.linalg.norm(np.maximum(q, 0.0), axis=1)
        inside = np.minimum(q.max(axis=1), 0.0)
        return np.abs(outside + inside)

    def outline(self) -> Array:
        """`[M, 3]` points whose convex hull is the shape's."""
        corners = np.stack(np.meshgrid((-0.5, 0.5), (-0.5, 0.5), (-0.5, 0.5)), axis=-1).reshape(-1, 3)
        return corners * np.array(self.size)


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A cylinder about its centre, its axis along z."""

    radius: float  # [m]
    length: float  # [m]

    def __post_init__(self) -> None:
        _positive("a cylinder's radius", self.radius)
        _positive("a cylinder's length", self.length)

    def distance(self, points: Array) -> Array:
        """`[N]` distance [m] of `[N, 3]` points (shape's frame) to the surface, from inside or outside."""
        q = np.stack(
            [np.hypot(points[:, 0], points[:, 1]) - self.radius, np.abs(points[:, 2]) - self.length / 2.0],
            axis=1,
        )
        return np.abs(np.linalg.norm(np.maximum(q, 0.0), axis=1) + np.minimum(q.max(axis=1), 0.0))

    def outline(self) -> Array:
        """`[M, 3]` points whose convex hull is the shape's, to 0.1 % of the radius (72 sides)."""
        angle = np.arange(72) * (2.0 * np.pi / 72)
        ring = np.stack([np.cos(angle), np.sin(angle)], axis=1) * self.radius
        return np.concatenate([np.c_[ring, np.full(72, z)] for z in (-self.length / 2.0, self.length / 2.0)])


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere about its centre."""

    radius: float  # [m]

    def __post_init__(self) -> None:
        _positive("a sphere's radius", self.radius)

    def distance(self, points: Array) -> Array:
        """`[N]` distance [m] of `[N, 3]` points (shape's frame) to the surface, from inside or outside."""
        return np.abs(np.linalg.norm(points, axis=1) - self.radius)

    def outline(self) -> Array:
        """`[M, 3]` points on the surface: rings every 5 degrees, the poles and the equator exact."""
        latitude = np.radians(np.arange(-90, 91, 5))
        angle = np.radians(np.arange(0, 360, 5))
        lat, lon = np.meshgrid(latitude, angle)
        unit = np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1)
        return unit.reshape(-1, 3) * self.radius


@dataclass(frozen=True, slots=True)
class Plane:
    """A flat rectangle about its centre, seen from its +z side."""

    size: tuple[float, float]  # [m] along x, y

    def __post_init__(self) -> None:
        _positive("a plane's size", *self.size)

    def distance(self, points: Array) -> Array:
        """`[N]` distance [m] of `[N, 3]` points in the shape's frame to the rectangle."""
        over = np.maximum(np.abs(points[:, :2]) - np.array(self.size) / 2.0, 0.0)
        return np.linalg.norm(np.c_[over, points[:, 2]], axis=1)

    def outline(self) -> Array:
        """`[4, 3]` corners."""
        x, y = self.size[0] / 2.0, self.size[1] / 2.0
        return np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A triangle mesh, already scaled.

    Attributes:
        vertices: `[V, 3]` [m].
        faces: `[F, 3]` indices.
        uv: `[V, 2]` texture coordinates, or None where the file has none.
        path: the file it came from, for messages.
    """

    vertices: Array
    faces: NDArray[np.int32]
    uv: Array | None
    path: Path

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen(self.vertices, np.float64))
        object.__setattr__(self, "faces", frozen(self.faces, np.int32))

    def distance(self, points: Array) -> Array:
        """`[N]` distance [m] of `[N, 3]` points in the shape's frame to the nearest triangle."""
        import trimesh

        triangles = self.vertices[self.faces]
        centers = triangles.mean(axis=1)
        reach = np.linalg.norm(triangles - centers[:, None], axis=2).max(axis=1)
        tree = KDTree(centers)
        # No triangle beyond the nearest corner can be nearest: few are left to measure.
        bound = KDTree(triangles.reshape(-1, 3)).query(points)[0] + 1e-9
        nearest = np.empty(len(points))
        chunk = max(1, 2_000_000 // len(triangles))  # pairs held in memory at once
        for i in range(0, len(points), chunk):
            some, limit = points[i : i + chunk], bound[i : i + chunk]
            near = tree.query_ball_point(some, limit + reach.max())
            row = np.repeat(np.arange(len(some)), [len(faces) for faces in near])
            face = np.concatenate([np.asarray(faces, dtype=np.intp) for faces in near])
            keep = np.linalg.norm(centers[face] - some[row], axis=1) <= limit[row] + reach[face]
            row, face = row[keep], face[keep]
            on = trimesh.triangles.closest_point(triangles[face], some[row])
            distance = np.full(len(some), np.inf)
            np.minimum.at(distance, row, np.linalg.norm(on - some[row], axis=1))
            nearest[i : i + chunk] = distance
        return nearest

    def outline(self) -> Array:
        """`[V, 3]` the vertices."""
        return self.vertices


Shape = Box | Cylinder | Sphere | Plane | Mesh
