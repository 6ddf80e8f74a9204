"""What a pixel with an inverse depth and its slopes stands for in space: on a plane, inverse depth is affine in it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.camera import Camera


def normals(camera: Camera, pixels: NDArray, genes: NDArray[np.float64]) -> NDArray[np.float32]:
    """`[N, 3]` unit normals towards the camera: a plane n . p = 1 has the inverse depth n . (x / z, y / z, 1).

    Args:
        camera: of the pixels.
        pixels: `[N, 2]` u, v [px].
        genes: `[N, 3]` inverse depth there [1/m] and its slopes along u and v [1/m/px].
    """
    a, b = genes[:, 1] * camera.fx, genes[:, 2] * camera.fy
    c = genes[:, 0] - a * (pixels[:, 0] - camera.cx) / camera.fx - b * (pixels[:, 1] - camera.cy) / camera.fy
    n = -np.stack([a, b, c], axis=1)
    return (n / np.linalg.norm(n, axis=1, keepdims=True)).astype(np.float32)
