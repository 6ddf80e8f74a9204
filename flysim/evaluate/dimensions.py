"""How far an estimated box is from the true one: place, size axis by axis, heading."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from flysim.geometry.frames import Array
from flysim.products.obstacle import Obstacle
from flysim.truth.obstacles import TrueObstacle

QUARTER = math.pi / 2.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BoxDifference:
    """An estimated box beside the true one. Sizes are along the true box's length, width and height.

    Attributes:
        center_error: distance of the centres on the ground [m] (nuScenes' ATE).
        center_visible_error: the same to the centre of the visible part; None where nothing is visible.
        size_estimated: `[3]` the estimate's size along the true axes.
        size_visible: `[3]` of the visible part; None where nothing is visible.
        yaw_error: [rad] in [0, pi/4], None for what is round.
    """

    center_error: float
    center_visible_error: float | None
    size_estimated: Array
    size_visible: Array | None
    yaw_error: float | None


def compare(true: TrueObstacle, estimate: Obstacle) -> BoxDifference:
    """Brings an estimate into the true box's axes and compares.

    A box turned by a quarter with its length and width exchanged is the same box. Of the estimate's two ways
    to be written, the one whose heading is nearer to the true one is compared; so the yaw error is at most 45
    degrees. Round things have no axes: there the estimate's own are used.
    """
    size = np.asarray(estimate.size, dtype=np.float64)
    yaw_error = None
    if true.symmetry != "round":
        turns = round((estimate.yaw - true.yaw) / QUARTER)
        yaw_error = abs(estimate.yaw - true.yaw - turns * QUARTER)
        if turns % 2:
            size = size[[1, 0, 2]]
    seen = true.visible_extent(estimate.yaw if true.symmetry == "round" else None)
    return BoxDifference(
        center_error=_on_ground(estimate.center, true.center),
        center_visible_error=_on_ground(estimate.center, seen[0]) if seen else None,
        size_estimated=size,
        size_visible=seen[1] if seen else None,
        yaw_error=yaw_error,
    )


def _on_ground(a: Array, b: Array) -> float:
    return math.hypot(a[0] - b[0], a[1] - b[1])
