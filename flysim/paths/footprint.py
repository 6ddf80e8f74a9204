"""What a shape covers of the floor between two heights: discs, convex polygons, and the points of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from flysim.geometry.frames import Array, transform
from flysim.geometry.plan_view import plan_hull
from flysim.worlds.cut import between, surface_points
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Shape, Sphere

UPRIGHT = 1e-6  # an axis is vertical when 1 - |cos| is below: 0.08 degrees


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc on the floor: x, y, radius [m]."""

    x: float
    y: float
    radius: float

    def bounds(self) -> tuple[float, float, float, float]:
        """Least x, least y, greatest x, greatest y [m]."""
        return self.x - self.radius, self.y - self.radius, self.x + self.radius, self.y + self.radius

    def covers(self, x: Array, y: Array, slack: float) -> np.ndarray:
        """Which of the points lie in the disc or at most `slack` [m] from it."""
        return np.hypot(x - self.x, y - self.y) <= self.radius + slack


@dataclass(frozen=True, slots=True, eq=False)
class Polygon:
    """A convex polygon on the floor.

    Attributes:
        corners: `[n, 2]` [m].
        edges: `[m, 3]` outward normal and offset of each side: inside is `normal @ p + offset <= 0`.
    """

    corners: Array
    edges: Array

    @classmethod
    def hull(cls, points: Array) -> Polygon:
        """The convex hull of `[n, 2]` points; what has no area gets 1 mm of it."""
        corners = points[plan_hull(points)]
        if len(corners) < 3:  # all on a line, or too few
            fat = np.array([[-5e-4, -5e-4], [5e-4, -5e-4], [5e-4, 5e-4], [-5e-4, 5e-4]])
            corners = (corners[:, None] + fat).reshape(-1, 2)
            corners = corners[plan_hull(corners)]
        sides = np.roll(corners, -1, axis=0) - corners
        outward = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / np.linalg.norm(sides, axis=1)[:, None]
        return cls(corners, np.c_[outward, -(outward * corners).sum(axis=1)])

    @classmethod
    def rectangle(cls, box: Box, T: Array) -> Polygon:
        """What an upright box covers, many times as fast as by its hull."""
        a, b = (box.size[k] / 2.0 * T[:2, k] for k in range(2))
        middle, outward = T[:2, 3], np.array([T[:2, 0], -T[:2, 0], T[:2, 1], -T[:2, 1]])
        reach = np.array([box.size[0], box.size[0], box.size[1], box.size[1]]) / 2.0
        corners = middle + np.array([a + b, b - a, -a - b, a - b])
        return cls(corners, np.c_[outward, -(outward @ middle) - reach])

    def bounds(self) -> tuple[float, float, float, float]:
        """Least x, least y, greatest x, greatest y [m]."""
        (x0, y0), (x1, y1) = self.corners.min(axis=0), self.corners.max(axis=0)
        return float(x0), float(y0), float(x1), float(y1)

    def covers(self, x: Array, y: Array, slack: float) -> np.ndarray:
        """Which of the points lie in the polygon with its sides moved out by `slack` [m]."""
        a, b, c = self.edges.T
        return (x[..., None] * a + y[..., None] * b + c <= slack).all(axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """A surface as points on the floor.

    Attributes:
        xy: `[n, 2]` [m], at most `spacing` [m] apart.
        triangles: `[F, 3, 3]` all of the mesh, world frame: what is within them is solid.
        level: height [m] at which the points lie, or below.
    """

    xy: Array
    spacing: float
    triangles: Array
    level: float

    def bounds(self) -> tuple[float, float, float, float]:
        """Least x, least y, greatest x, greatest y [m]."""
        (x0, y0), (x1, y1) = self.xy.min(axis=0), self.xy.max(axis=0)
        return float(x0), float(y0), float(x1), float(y1)


Footprint = Disc | Polygon | Points


def footprint(shape: Shape, T: Array, low: float, high: float, spacing: float, *, solid: bool) -> Footprint | None:
    """What a shape at its pose `T` = T_world_shape covers of the floor between the heights `low` and `high` [m].

    Args:
        shape: any but a plane, whose half-space has no end.
        T: `[4, 4]`.
        low: [m]
        high: [m]
        spacing: of the points of a mesh [m].
        solid: a mesh counts as its convex hull, as it does on a body that moves.
    """
    assert not isinstance(shape, Plane)
    x, y, z = T[:3, 3].tolist()
    if isinstance(shape, Sphere):
        if z - shape.radius >= high or z + shape.radius <= low:
            return None
        off = max(low - z, z - high, 0.0)
        return Disc(x, y, float(np.sqrt(max(shape.radius**2 - off**2, 0.0))))
    if isinstance(shape, Cylinder) and 1.0 - abs(T[2, 2]) <= UPRIGHT:
        half = shape.length / 2.0
        return Disc(x, y, shape.radius) if z - half < high and z + half > low else None
    if isinstance(shape, Mesh) and not solid:
        triangles = transform(T, shape.vertices)[shape.faces]
        some = between(triangles, low, high)
        if not len(some):
            return None
        points, apart = surface_points(some, spacing)
        points = points[(points[:, 2] > low) & (points[:, 2] < high), :2]
        return Points(points, apart, triangles, low + min(high - low, 0.1) / 2.0) if len(points) else None
    if isinstance(shape, Box) and 1.0 - abs(T[2, 2]) <= UPRIGHT:
        half = shape.size[2] / 2.0
        return Polygon.rectangle(shape, T) if z - half < high and z + half > low else None
    points = transform(T, shape.outline())
    if isinstance(shape, Mesh) and len(points) > 64:
        points = points[ConvexHull(points).vertices]
    cut = _cut(points, low, high)
    return Polygon.hull(cut) if len(cut) else None


def heights(shape: Shape, T: Array) -> tuple[float, float]:
    """Lowest and highest point [m] of a shape at T_world_shape."""
    z = float(T[2, 3])
    if isinstance(shape, Sphere):
        return z - shape.radius, z + shape.radius
    if isinstance(shape, Box | Cylinder) and 1.0 - abs(T[2, 2]) <= UPRIGHT:
        half = (shape.size[2] if isinstance(shape, Box) else shape.length) / 2.0
        return z - half, z + half
    points = transform(T, shape.outline())[:, 2]
    return float(points.min()), float(points.max())


def _cut(points: Array, low: float, high: float) -> Array:
    """`[n, 2]` corners of the part of a convex body between two heights, seen from above."""
    z = points[:, 2]
    kept = [points[(z >= low) & (z <= high), :2]]
    for level in (low, high):
        up, down = np.flatnonzero(z > level), np.flatnonzero(z < level)
        if len(up) and len(down):
            a, b = points[np.repeat(up, len(down))], points[np.tile(down, len(up))]
            share = (a[:, 2] - level) / (a[:, 2] - b[:, 2])
            kept.append((a + share[:, None] * (b - a))[:, :2])
    return np.concatenate(kept)
