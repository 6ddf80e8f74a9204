"""How much an estimated body and the visible part of the true one have in common: intersection over union."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flysim.geometry.frames import Array
from flysim.geometry.plan_view import axes
from flysim.products.obstacle import Obstacle
from flysim.truth.obstacles import TrueObstacle

ROUND_CORNERS = 64  # of the polygon that stands for a circle seen from above: 0.2 % of its area is lost on both sides


class Overlap(NamedTuple):
    """Intersection over union, 0 to 1: of the areas seen from above, and of the volumes."""

    plan: float
    volume: float


def overlap(true: TrueObstacle, estimate: Obstacle) -> Overlap | None:
    """What an estimate and the visible part of what it stands for have in common; None where nothing was visible.

    Both are upright: a rectangle seen from above, or the ellipse within it where both are round, between two heights.
    The visible part is the box of what was seen, along the true heading (of round things: the estimate's).
    """
    turned = true.symmetry == "round"
    seen = true.visible_extent(estimate.yaw if turned else None)
    if seen is None:
        return None
    center, size = seen
    both_round = turned and estimate.shape in ("cylinder", "sphere")
    at = np.asarray(center[:2])
    mine = _outline(np.asarray(estimate.center)[:2] - at, np.asarray(estimate.size), estimate.yaw, both_round)
    other = _outline(np.zeros(2), size, estimate.yaw if turned else true.yaw, both_round)
    common, areas = _area(_clipped(mine, other)), (_area(mine), _area(other))
    low, high = (center[2] + sign * size[2] / 2.0 for sign in (-1.0, 1.0))
    bottom, top = (estimate.center[2] + sign * estimate.size[2] / 2.0 for sign in (-1.0, 1.0))
    shared = common * max(min(high, top) - max(low, bottom), 0.0)
    return Overlap(
        plan=_ratio(common, areas[0] + areas[1] - common),
        volume=_ratio(shared, areas[0] * (top - bottom) + areas[1] * (high - low) - shared),
    )


def _outline(center: Array, size: Array, yaw: float, is_round: bool) -> Array:
    """`[K, 2]` corners, seen from above, anticlockwise."""
    if is_round:
        turn = np.arange(ROUND_CORNERS) * (2.0 * np.pi / ROUND_CORNERS)
        corners = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    else:
        corners = np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)])
    return center + (corners * size[:2] / 2.0) @ axes(yaw)


def _clipped(outline: Array, within: Array) -> Array:
    """`[K, 2]` what of a convex outline lies within another (Sutherland and Hodgman, CACM 17, 1974)."""
    for a, b in zip(within, np.roll(within, -1, axis=0), strict=True):
        if not len(outline):
            break
        inside = (b[0] - a[0]) * (outline[:, 1] - a[1]) - (b[1] - a[1]) * (outline[:, 0] - a[0])
        kept: list[Array] = []
        for k, corner in enumerate(outline):
            here, there = inside[k], inside[k - 1]
            if here * there < 0.0:
                kept.append(outline[k - 1] + (corner - outline[k - 1]) * (there / (there - here)))
            if here >= 0.0:
                kept.append(corner)
        outline = np.array(kept).reshape(-1, 2)
    return outline


def _area(outline: Array) -> float:
    x, y = outline.T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2.0


def _ratio(common: float, whole: float) -> float:
    return min(max(common / whole, 0.0), 1.0) if whole > 0.0 else 0.0
