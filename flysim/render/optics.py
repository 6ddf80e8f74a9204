"""What all renderers share: one range of depths, one sky, one projection."""

from __future__ import annotations

import numpy as np

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array

NEAR, FAR = 0.05, 60.0  # [m]
SKY = (178, 200, 220)  # RGB where nothing is


def clip_optical(camera: Camera, half_pixel: tuple[float, float] = (0.5, 0.5)) -> Array:
    """`[4, 4]` projection from the optical frame to OpenGL's clip space, for any K.

    Args:
        camera: its calibration.
        half_pixel: where the renderer has the centre of the first pixel, from its corner [px].
    """
    ox, oy = half_pixel
    left, right = -(camera.cx + ox) / camera.fx, (camera.width - camera.cx - ox) / camera.fx
    top, bottom = (camera.cy + oy) / camera.fy, -(camera.height - camera.cy - oy) / camera.fy
    P = np.zeros((4, 4))
    P[0, 0], P[0, 2] = 2.0 / (right - left), (right + left) / (right - left)
    P[1, 1], P[1, 2] = 2.0 / (top - bottom), (top + bottom) / (top - bottom)
    P[2, 2], P[2, 3] = -(FAR + NEAR) / (FAR - NEAR), -2.0 * FAR * NEAR / (FAR - NEAR)
    P[3, 2] = -1.0
    return P @ np.diag([1.0, -1.0, -1.0, 1.0])  # optical y down, z forward -> OpenGL y up, z backward
