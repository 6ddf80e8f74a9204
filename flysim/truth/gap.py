"""How close two bodies stand: exact distances between convex solids, and groups of bodies that touch."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from flysim.geometry.frames import Array, transform
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Shape, Sphere

STEPS = 100  # the search needs 2-20; round things seen edge-on need most
SETTLED = 1e-7  # [m] between the bounds of a distance


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """The convex hull of points, swept by a ball or by a disc.

    A cuboid, a rectangle and a triangle are their corners; a ball is its centre, swept by a ball; a cylinder
    is the two ends of its axis, swept by a disc across that axis.
    """

    corners: Array  # [n, 3] m, world
    ball: float = 0.0  # [m] radius
    disc: float = 0.0  # [m] radius
    axis: Array | None = None  # [3] unit normal of the disc

    def support(self, direction: Array) -> Array:
        """`[3]` the solid's farthest point in `direction` `[3]`, not zero."""
        point = self.corners[np.argmax(self.corners @ direction)]
        if self.ball:
            point = point + self.ball / np.linalg.norm(direction) * direction
        if self.axis is not None:
            across = direction - (direction @ self.axis) * self.axis
            length = np.linalg.norm(across)
            if length > 1e-12:
                point = point + self.disc / length * across
        return point

    def bounds(self) -> tuple[Array, Array]:
        """`[3]` least and `[3]` greatest coordinates."""
        swept = np.full(3, self.ball)
        if self.axis is not None:
            swept += self.disc * np.sqrt(np.maximum(1.0 - self.axis**2, 0.0))
        return self.corners.min(axis=0) - swept, self.corners.max(axis=0) + swept


def solids(shape: Shape, T_world_shape: Array) -> list[Solid]:
    """The convex solids a shape is made of: one, or a mesh's triangles."""
    T = T_world_shape
    match shape:
        case Sphere():
            return [Solid(T[None, :3, 3], ball=shape.radius)]
        case Cylinder():
            ends = transform(T, [[0.0, 0.0, -shape.length / 2.0], [0.0, 0.0, shape.length / 2.0]])
            return [Solid(ends, disc=shape.radius, axis=T[:3, 2])]
        case Mesh():
            vertices = transform(T, shape.vertices)
            return [Solid(vertices[face]) for face in shape.faces]
        case Box() | Plane():
            return [Solid(transform(T, shape.outline()))]


def closer_than(gap: float, a: Solid, b: Solid) -> bool:
    """Whether two solids overlap, touch, or stand at most `gap` [m] apart.

    Finds the point of the difference of the two (all p_a - p_b) nearest to the origin: Gilbert, Johnson and
    Keerthi, IEEE J. Robotics and Automation 4(2), 1988. Every step bounds the distance from both sides, so it
    ends as soon as either bound decides.
    """
    quick = _round_gap(a, b)
    if quick is not None:
        return quick <= gap
    toward = b.corners.mean(axis=0) - a.corners.mean(axis=0)
    toward = toward if np.linalg.norm(toward) > 1e-12 else np.array([1.0, 0.0, 0.0])
    nearest = a.support(toward) - b.support(-toward)
    hull = nearest[None]
    for _ in range(STEPS):
        above = float(np.linalg.norm(nearest))
        if above <= max(gap, SETTLED):
            return True
        candidate = a.support(-nearest) - b.support(nearest)
        below = float(nearest @ candidate) / above
        if below > gap or above - below < SETTLED:
            return False
        hull = np.concatenate([hull, candidate[None]])
        # Least |sum w_i h_i| with w >= 0 and sum w = 1: the row of ones pulls the sum to 1, and scaling it
        # back to exactly 1 does not change which mixture is the shortest.
        weights = nnls(np.concatenate([hull.T, np.ones((1, len(hull)))]), np.array([0.0, 0.0, 0.0, 1.0]))[0]
        keep = weights > 0.0
        hull, weights = hull[keep], weights[keep] / weights.sum()
        nearest = weights @ hull
    return bool(np.linalg.norm(nearest) <= gap)


def _round_gap(a: Solid, b: Solid) -> float | None:
    """Distance [m] of two balls, or of two cylinders with vertical axes, 0 where they overlap; None for others."""
    off = a.corners[0] - b.corners[0]
    if a.ball and b.ball and len(a.corners) == len(b.corners) == 1:
        return max(float(np.linalg.norm(off)) - a.ball - b.ball, 0.0)
    if a.axis is None or b.axis is None or abs(a.axis[2]) != 1.0 or abs(b.axis[2]) != 1.0:
        return None
    beside = max(math.hypot(off[0], off[1]) - a.disc - b.disc, 0.0)
    low, high = max(a.corners[:, 2].min(), b.corners[:, 2].min()), min(a.corners[:, 2].max(), b.corners[:, 2].max())
    return math.hypot(beside, max(low - high, 0.0))


def touching_groups(bodies: Sequence[Sequence[tuple[Shape, Array]]], gap: float) -> list[list[int]]:
    """Indices of `bodies` that hang together, directly or over others, with gaps of at most `gap` [m].

    Each body is shapes at their poses T_world_shape. Groups and their members are in the order of the bodies.
    """
    whole = np.array([_body_bounds(body) for body in bodies]).reshape(-1, 2, 3)
    low, high = whole[:, 0], whole[:, 1]
    group = list(range(len(bodies)))

    @functools.cache
    def made(i: int) -> tuple[list[Solid], Array]:
        """A body's solids and their boxes, of those alone that stand near another one: a mesh has many."""
        own = [solid for shape, T in bodies[i] for solid in solids(shape, T)]
        return own, np.array([solid.bounds() for solid in own]).reshape(-1, 2, 3)

    def root(i: int) -> int:
        while group[i] != i:
            i = group[i]
        return i

    for i in range(len(bodies)):
        close = np.all((low[i] - gap <= high[i + 1 :]) & (low[i + 1 :] - gap <= high[i]), axis=1)
        for j in (np.flatnonzero(close) + i + 1).tolist():
            if root(i) != root(j) and _bodies_closer_than(gap, made(i), made(j)):
                first, second = sorted((root(i), root(j)))
                group[second] = first
    members: dict[int, list[int]] = {}
    for i in range(len(bodies)):
        members.setdefault(root(i), []).append(i)
    return list(members.values())


def _body_bounds(body: Sequence[tuple[Shape, Array]]) -> Array:
    """`[2, 3]` least and greatest coordinates of a body."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for shape, T in body:
        if isinstance(shape, Mesh):
            points = transform(T, shape.vertices)
            ends = [(points.min(axis=0), points.max(axis=0))]
        else:
            ends = [solid.bounds() for solid in solids(shape, T)]
        for least, most in ends:
            low, high = np.minimum(low, least), np.maximum(high, most)
    return np.array([low, high])


def _bodies_closer_than(gap: float, a: tuple[list[Solid], Array], b: tuple[list[Solid], Array]) -> bool:
    (solids_a, boxes_a), (solids_b, boxes_b) = a, b
    whole_low, whole_high = boxes_b[:, 0].min(axis=0) - gap, boxes_b[:, 1].max(axis=0) + gap
    near = np.all((boxes_a[:, 0] <= whole_high) & (boxes_a[:, 1] >= whole_low), axis=1)
    for i in np.flatnonzero(near).tolist():
        low, high = boxes_a[i, 0] - gap, boxes_a[i, 1] + gap
        for j in np.flatnonzero(np.all((boxes_b[:, 0] <= high) & (boxes_b[:, 1] >= low), axis=1)).tolist():
            if closer_than(gap, solids_a[i], solids_b[j]):
                return True
    return False
