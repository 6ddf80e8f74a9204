"""An obstacle as the robot believes it to be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array

Shape = Literal["box", "cylinder", "sphere", "other"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacle:
    """The body that a cluster of flies lies on, by its upright oriented box.

    Attributes:
        shape: "box", "cylinder", "sphere", or "other" where the flies lie on none of them.
        center: `[3]` [m], world frame.
        size: `[3]` length, width, height [m]; length along the box's own x axis, at heading `yaw`.
        yaw: heading of the box's x axis [rad], in [-pi/2, pi/2): a box turned by half a turn is the same box.
        flies: `[n]` indices of its flies in the cloud it was found in.
    """

    shape: Shape = "box"
    center: Array
    size: Array
    yaw: float
    flies: NDArray[np.int64]

    @property
    def diameter(self) -> float | None:
        """Of a cylinder or a sphere [m]; None for others."""
        return float(self.size[0]) if self.shape in ("cylinder", "sphere") else None
