"""A known floor, as an image has it: on a plane, inverse depth is affine in the pixel."""

from __future__ import annotations

import numpy as np

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array

Ground = tuple[float, float, float]  # inverse depth [1/m] at pixel (0, 0), and what it grows by along u and v [1/m/px]


def ground_of(camera: Camera, T_base_camera: Array) -> Ground:
    """The plane z = 0 of base_link in a camera's image.

    Args:
        camera: the left one.
        T_base_camera: `[4, 4]` its optical frame in base_link; it is above the plane.
    """
    # z of a point at depth 1 / q on the ray (x, y, 1) is height + up . (x, y, 1) / q.
    up, height = T_base_camera[2, :3], float(T_base_camera[2, 3])
    if not height > 0.0:
        raise ValueError(f"the camera must be above the floor, got a height of {height} m")
    a, b, c = np.asarray(-up / height, np.float64)
    gu, gv = float(a / camera.fx), float(b / camera.fy)
    return float(c - gu * camera.cx - gv * camera.cy), gu, gv
