"""Flies of one pair, taken along to the next: where they are expected once the cameras have moved.

Louchet, Guyon, Lesot and Boumaza, "Dynamic flies: a new pattern recognition tool applied to stereo sequence
processing", 2002: the population outlives the picture, so that few generations a picture are enough.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, transform


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Carried:
    """Flies to begin with, fittest first.

    Attributes:
        pixels: `[N, 2]` int32 left pixels u, v.
        genes: `[N, 3]` float32 inverse depth [1/m] and its slopes along u and v [1/m/px].
    """

    pixels: NDArray[np.int32]
    genes: NDArray[np.float32]


def carried(points: Array, normals: Array, camera: Camera, T_now_before: Array) -> Carried:
    """Where flies of an earlier pair are in the left image of now, those in view.

    Args:
        points: `[N, 3]` [m, left optical frame of then], fittest first.
        normals: `[N, 3]` unit normals of the surfaces they sit on, same frame.
        camera: the left one.
        T_now_before: `[4, 4]` from the left optical frame of then to that of now.
    """
    p, n = transform(T_now_before, points), normals @ T_now_before[:3, :3].T
    away = (n * p).sum(axis=1)  # of the plane; it faces the camera where this is negative
    ahead = (p[:, 2] > 1e-3) & (away < -1e-6)
    p, slope = p[ahead], n[ahead] / away[ahead, None]  # a plane slope . x = 1 has the inverse depth slope . (x / z)
    uv = camera.project(p)
    pixels = np.floor(np.clip(uv, -1.0, max(camera.width, camera.height)) + 0.5).astype(np.int32)
    du, dv = slope[:, 0] / camera.fx, slope[:, 1] / camera.fy
    q = 1.0 / p[:, 2] + du * (pixels[:, 0] - uv[:, 0]) + dv * (pixels[:, 1] - uv[:, 1])
    inside = (pixels >= 0).all(axis=1) & (pixels[:, 0] < camera.width) & (pixels[:, 1] < camera.height)
    genes = np.stack([q, du, dv], axis=1)
    return Carried(pixels=pixels[inside], genes=genes[inside].astype(np.float32))
