"""One picture of one camera, and where the robot believes that it was taken: half of a pair to be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, frozen


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shot:
    """What a robot with one camera believes it saw at a stop.

    Attributes:
        index: of the stop in its path, from 0.
        time: [s] since the drive began.
        image: `[H, W, 3]` uint8 RGB.
        camera: as the robot believes it.
        T_world_base: `[4, 4]` pose of base_link, by odometry or whatever tells it.
        T_base_left: `[4, 4]` where the camera is mounted: its optical frame in base_link.
    """

    index: int
    time: float
    image: NDArray[np.uint8]
    camera: Camera
    T_world_base: Array
    T_base_left: Array

    def __post_init__(self) -> None:
        for name in ("T_world_base", "T_base_left"):
            object.__setattr__(self, name, frozen(getattr(self, name), np.float64))

    @property
    def T_world_left(self) -> Array:
        """`[4, 4]` optical frame in the world, as believed."""
        return self.T_world_base @ self.T_base_left
