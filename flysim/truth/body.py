"""A body as the cameras see it: its parts, its distance from points, its box on the ground."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Literal, NamedTuple

import numpy as np

from flysim.geometry.frames import Array, inverse, transform
from flysim.geometry.plan_view import fold_yaw, smallest_rectangle
from flysim.worlds.model import Link, Part
from flysim.worlds.shapes import Box, Cylinder, Mesh, Shape, Sphere

Symmetry = Literal["rectangle", "square", "round"]
Kind = Literal["box", "cylinder", "sphere", "other"]

UPRIGHT = 1e-6  # an axis is vertical when 1 - |cos| is below: 0.08 degrees
SAME = 1e-3  # [m] lengths and places that differ less are one: a square, a common axis


class UprightBox(NamedTuple):
    """The upright box of a body above the ground."""

    center: Array  # [3] m
    size: Array  # [3] length, width, height [m]
    yaw: float
    symmetry: Symmetry
    shape: Kind


def parts_of(link: Link) -> tuple[Part, ...]:
    """What is seen of a link: its visuals, or its collision shapes where it has none."""
    return link.visuals or link.collisions


def surface_distance(link: Link, T_world_link: Array, points: Array) -> Array:
    """`[N]` distance [m] of `[N, 3]` points [m, world] to the link's nearest surface, hidden or not."""
    nearest = np.full(len(points), np.inf)
    for part in parts_of(link):
        local = transform(inverse(T_world_link @ part.T_link_part), points)
        np.minimum(nearest, part.shape.distance(local), out=nearest)
    return nearest


def measure(shapes: Iterable[tuple[Shape, Array]]) -> UprightBox | None:
    """The box of shapes at their poses T_world_shape. What is below the ground, z < 0, does not count.

    An upright cuboid and upright round things are measured exactly; anything else, and every group, by the
    smallest rectangle round its outline seen from above. None where nothing is above the ground.
    """
    shapes = list(shapes)
    if len(shapes) == 1 and isinstance(shapes[0][0], Box):
        box = _upright_box(shapes[0][0], shapes[0][1])
        if box is not None:
            return box if box.size[2] > 0.0 else None
    discs = [disc for disc in (_upright_round(shape, T) for shape, T in shapes) if disc is not None]
    axis_shared = len(discs) == len(shapes) > 0 and np.ptp([d[:2] for d in discs], axis=0).max() < SAME
    if axis_shared:
        radius, low, high = (f(d[i] for d in discs) for i, f in ((2, max), (3, min), (4, max)))
        low = max(low, 0.0)
        center = np.array([discs[0][0], discs[0][1], (low + high) / 2.0])
        size = np.array([2 * radius, 2 * radius, high - low])
        kind: Kind = "other" if len(shapes) > 1 else "sphere" if isinstance(shapes[0][0], Sphere) else "cylinder"
        return UprightBox(center, size, 0.0, "round", kind) if high > 0.0 else None
    outline = np.concatenate([np.empty((0, 3)), *(_above_ground(shape, T) for shape, T in shapes)])
    if not len(outline) or outline[:, 2].max() <= 0.0:
        return None
    plan = smallest_rectangle(outline[:, :2])
    low, high = outline[:, 2].min(), outline[:, 2].max()
    symmetry: Symmetry = "square" if plan.length - plan.width < SAME else "rectangle"
    center = np.array([*plan.center, (low + high) / 2.0])
    return UprightBox(center, np.array([plan.length, plan.width, high - low]), plan.yaw, symmetry, "other")


def _upright_box(box: Box, T: Array) -> UprightBox | None:
    """The exact measure of a cuboid that stands on one of its faces."""
    vertical = int(np.argmax(np.abs(T[2, :3])))
    if 1.0 - abs(T[2, vertical]) > UPRIGHT:
        return None
    flat = sorted((i for i in range(3) if i != vertical), key=lambda i: (-box.size[i], i))
    length, width = (box.size[i] for i in flat)
    yaw = fold_yaw(math.atan2(T[1, flat[0]], T[0, flat[0]]))
    low = max(T[2, 3] - box.size[vertical] / 2.0, 0.0)
    high = T[2, 3] + box.size[vertical] / 2.0
    center = np.array([T[0, 3], T[1, 3], (low + high) / 2.0])
    symmetry: Symmetry = "square" if length - width < SAME else "rectangle"
    return UprightBox(center, np.array([length, width, high - low]), yaw, symmetry, "box")


def _upright_round(shape: Shape, T: Array) -> tuple[float, float, float, float, float] | None:
    """x, y, radius, lowest, highest of a shape that looks round from above; None for others."""
    x, y, z = T[:3, 3].tolist()
    if isinstance(shape, Sphere):
        # Sunk below its middle, the widest circle that shows is the one at the ground.
        shown = math.sqrt(max(shape.radius**2 - min(z, 0.0) ** 2, 0.0))
        return x, y, shown, z - shape.radius, z + shape.radius
    if isinstance(shape, Cylinder) and 1.0 - abs(T[2, 2]) <= UPRIGHT:
        return x, y, shape.radius, z - shape.length / 2.0, z + shape.length / 2.0
    return None


def _above_ground(shape: Shape, T: Array) -> Array:
    """`[M, 3]` outline [m, world] of what is above z = 0 of a shape, cut exactly where edges cross it."""
    points = transform(T, shape.outline())
    above = points[:, 2] >= 0.0
    if above.all() or not above.any():
        return points[above]
    if isinstance(shape, (Box, Cylinder)) and 1.0 - abs(T[2, 2]) <= UPRIGHT:
        return np.concatenate([points[above], points[~above] * (1.0, 1.0, 0.0)])
    if isinstance(shape, Mesh):
        edges = np.concatenate([shape.faces[:, [0, 1]], shape.faces[:, [1, 2]], shape.faces[:, [2, 0]]])
        edges = edges[above[edges[:, 0]] != above[edges[:, 1]]]
    else:  # convex: the cut of the hull lies within the cuts of all lines from above to below
        up, down = np.meshgrid(np.flatnonzero(above), np.flatnonzero(~above))
        edges = np.stack([up.ravel(), down.ravel()], axis=1)
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    share = a[:, 2] / (a[:, 2] - b[:, 2])
    cut = a + share[:, None] * (b - a)
    cut[:, 2] = 0.0
    return np.concatenate([points[above], cut])
