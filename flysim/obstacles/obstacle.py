"""An obstacle as the robot believes it to be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Obstacle:
    """An upright oriented box round a cluster of flies.

    Attributes:
        center: `[3]` [m], world frame.
        size: `[3]` length, width, height [m]; length along the box's own x axis, at heading `yaw`.
        yaw: heading of the box's x axis [rad], in [-pi/2, pi/2): a box turned by half a turn is the same box.
        flies: `[n]` indices of its flies in the cloud it was found in.
    """

    center: Array
    size: Array
    yaw: float
    flies: NDArray[np.int64]
