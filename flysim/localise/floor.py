"""What one picture brings to be found again in another before any fly is: corners of it, laid on the floor.

The camera's height above the floor is known, so each pixel below the horizon has its place there. Corners that are of
something else are laid where nothing is: no other camera sees them there, and so they are outvoted.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array
from flysim.localise.glimpse import Glimpse

CORNERS, APART_PX, QUALITY = 1500, 5.0, 0.005  # so many at most, how far apart, and of the best one's sharpness
FAR_M = 4.0  # of the camera: what lies farther on the floor is seen too flatly
DOWN = 0.02  # sine of the least angle below the horizon


def laid(picture: NDArray[np.uint8], camera: Camera, T_base_left: Array) -> Glimpse:
    """The corners of a picture that may lie on the floor, as flies that do, the sharpest first.

    Args:
        picture: `[H, W, 3]` RGB.
        camera: that took it.
        T_base_left: `[4, 4]` where it is mounted: its optical frame in base_link, which stands on the floor.
    """
    grey: Any = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)
    corners = cv2.goodFeaturesToTrack(grey, CORNERS, QUALITY, APART_PX)
    uv = np.zeros((0, 2)) if corners is None else np.asarray(corners[:, 0], np.float64)
    rays = camera.unproject(uv, np.ones(len(uv))) @ T_base_left[:3, :3].T
    low = rays[:, 2] < -DOWN * np.linalg.norm(rays, axis=1)
    uv, rays = uv[low], rays[low]
    points = T_base_left[:3, 3] - T_base_left[2, 3] / rays[:, 2, None] * rays
    near = np.linalg.norm(points - T_base_left[:3, 3], axis=1) < FAR_M
    points, uv = points[near], uv[near]
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    return Glimpse.about(
        grey, camera=camera, T_base_left=T_base_left, points=points, normals=up, spread=np.zeros_like(points), uv=uv
    )
