"""A world seen from above: how far its bodies stand apart, and where a robot can go between them.

Only what rounds alike on every machine is used (sums, products, square roots), so that a generated world does not
hang on whose processor drew it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from flysim.geometry.frames import Array
from flysim.worlds.random.recipe import Body, Model
from flysim.worlds.shapes import Box, Cylinder, Sphere

CELL = 0.05  # [m] of the grid of places


@dataclass(frozen=True, slots=True, kw_only=True)
class Outline:
    """What a body covers in plan: a turned rectangle, or a disc (a rectangle without size) of some radius."""

    x: float  # [m] of its middle
    y: float
    cos: float  # of its heading
    sin: float
    half: tuple[float, float]  # [m] along and across the heading
    radius: float = 0.0  # [m]

    def distance(self, points: Array) -> Array:
        """`[...]` distance [m] of `[..., 2]` points; 0 inside."""
        dx, dy = points[..., 0] - self.x, points[..., 1] - self.y
        along = np.maximum(np.abs(dx * self.cos + dy * self.sin) - self.half[0], 0.0)
        across = np.maximum(np.abs(dy * self.cos - dx * self.sin) - self.half[1], 0.0)
        return np.maximum(np.sqrt(along * along + across * across) - self.radius, 0.0)

    def crossed(self, points: Array, target: Array) -> NDArray[np.bool_]:
        """`[...]` whether the lines from `[..., 2]` points to `target` `[2]` go through it; a disc as its square."""
        enter, leave = np.zeros(points.shape[:-1]), np.ones(points.shape[:-1])
        dx, dy = points[..., 0] - self.x, points[..., 1] - self.y
        tx, ty = target[0] - self.x, target[1] - self.y
        local = (dx * self.cos + dy * self.sin, dy * self.cos - dx * self.sin)
        aim = (tx * self.cos + ty * self.sin, ty * self.cos - tx * self.sin)
        for start, end, half in zip(local, aim, self.half, strict=True):
            step = end - start
            step = np.where(step == 0.0, 1e-12, step)
            one, two = (-half - self.radius - start) / step, (half + self.radius - start) / step
            enter, leave = np.maximum(enter, np.minimum(one, two)), np.minimum(leave, np.maximum(one, two))
        return enter <= leave

    def corners(self) -> Array:
        """`[4, 2]` of the rectangle; four times the middle of a disc."""
        a, b = self.half
        along = np.array([a, a, -a, -a])
        across = np.array([b, -b, -b, b])
        x, y = along * self.cos - across * self.sin, along * self.sin + across * self.cos
        return np.stack([self.x + x, self.y + y], axis=-1)


def turn(yaw_deg: float) -> tuple[float, float]:
    """Cosine and sine of a heading, to nine digits: the last bits are the platform's own."""
    yaw = math.radians(yaw_deg)
    return round(math.cos(yaw), 9), round(math.sin(yaw), 9)


def outlines(model: Model) -> tuple[Outline, ...]:
    """What each of a model's boxes, cylinders and spheres covers. All stand upright; flat ones cover nothing."""
    return tuple(_outline(model, body) for body in model.bodies if isinstance(body.shape, Box | Cylinder | Sphere))


def gap(a: Outline, b: Outline) -> float:
    """Distance [m] between two outlines; 0 where they touch or lie one over the other."""
    corners_a, corners_b = a.corners(), b.corners()
    if _overlap(a, corners_b) and _overlap(b, corners_a):
        return 0.0
    # Two convex polygons that are apart are nearest at a corner of one of them.
    nearest = min(_bare(a).distance(corners_b).min(), _bare(b).distance(corners_a).min())
    return max(float(nearest) - a.radius - b.radius, 0.0)


def apart(some: Iterable[Outline], others: Iterable[Outline], least: float) -> bool:
    """Whether each of some outlines stands at least that far [m] from each of others."""
    others = tuple(others)
    return all(_far(a, b, least) or gap(a, b) >= least for a in some for b in others)


def sees(points: Array, target: Array, others: Iterable[Outline]) -> NDArray[np.bool_]:
    """`[N]` whether the straight lines from `[N, 2]` points to `target` `[2]` are clear of other bodies."""
    clear = np.ones(len(points), dtype=bool)
    for body in others:
        clear[clear] = ~body.crossed(points[clear], target)
    return clear


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Places:
    """A grid of places in a room and how much room there is at each.

    Attributes:
        points: `[R, C, 2]` [m, world].
        clearance: `[R, C]` distance to the nearest body [m].
    """

    points: Array
    clearance: Array

    @classmethod
    def of(cls, low: tuple[float, float], high: tuple[float, float], bodies: Iterable[Outline]) -> Places:
        """The places between two corners [m], `CELL` apart, among bodies."""
        columns, rows = (round((h - w) / CELL) for w, h in zip(low, high, strict=True))
        x, y = low[0] + (np.arange(columns) + 0.5) * CELL, low[1] + (np.arange(rows) + 0.5) * CELL
        points = np.stack(np.meshgrid(x, y), axis=-1).astype(np.float64)
        clearance = np.full(points.shape[:2], np.inf)
        for body in bodies:
            np.minimum(clearance, body.distance(points), out=clearance)
        return cls(points=points, clearance=clearance)

    def parts(self, radius: float) -> tuple[NDArray[np.int32], int]:
        """`[R, C]` the number, from 1, of the connected part that a disc of that radius can stand in, and how many."""
        labels = np.zeros(self.clearance.shape, np.int32)
        count = ndimage.label(self.clearance >= radius, output=labels)
        return labels, int(count)  # pyright: ignore[reportArgumentType]


def _outline(model: Model, body: Body) -> Outline:
    (x, y, _, roll, pitch, yaw), (bx, by, _, body_roll, body_pitch, body_yaw) = model.pose, body.pose
    assert not (roll or pitch or body_roll or body_pitch), f"{model.name} does not stand upright"
    c, s = turn(yaw)
    cos, sin = turn(yaw + body_yaw)
    half, radius = (0.0, 0.0), 0.0
    if isinstance(body.shape, Box):
        half = (body.shape.size[0] / 2.0, body.shape.size[1] / 2.0)
    elif isinstance(body.shape, Cylinder | Sphere):
        radius = body.shape.radius
    return Outline(x=x + c * bx - s * by, y=y + s * bx + c * by, cos=cos, sin=sin, half=half, radius=radius)


def _far(a: Outline, b: Outline, least: float) -> bool:
    """Whether the circles round two outlines are that far apart: quick to say."""
    reach = least + a.radius + a.half[0] + a.half[1] + b.radius + b.half[0] + b.half[1]
    return (a.x - b.x) ** 2 + (a.y - b.y) ** 2 >= reach * reach


def _bare(outline: Outline) -> Outline:
    """The rectangle alone."""
    return Outline(x=outline.x, y=outline.y, cos=outline.cos, sin=outline.sin, half=outline.half)


def _overlap(a: Outline, corners: Array) -> bool:
    """Whether the corners' spans along both axes of `a` reach into it: no side of `a` parts the two."""
    dx, dy = corners[:, 0] - a.x, corners[:, 1] - a.y
    for along, half in ((dx * a.cos + dy * a.sin, a.half[0]), (dy * a.cos - dx * a.sin, a.half[1])):
        if along.min() > half or along.max() < -half:
            return False
    return True
