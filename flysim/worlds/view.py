"""What is truly seen from a camera: exact depth and which body each pixel shows. For the truth side alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrueView:
    """A rendered frame with its truth.

    Attributes:
        rgb: `[H, W, 3]` uint8.
        depth: `[H, W]` float32 depth along the optical axis [m]; inf where nothing is.
        link: `[H, W]` int32 index into `World.links`; -1 where nothing of the world is (sky, or the robot itself).
        T_world_optical: `[4, 4]` the camera's true pose.
    """

    camera: Camera
    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    link: NDArray[np.int32]
    T_world_optical: Array
