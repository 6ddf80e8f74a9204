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


def patches(camera: Camera, pixels: NDArray, genes: NDArray[np.float64], offsets: NDArray) -> NDArray[np.float32]:
    """`[N, 4, 3]` where the corners of a piece of the image lie on each plane [m, the camera's optical frame].

    Args:
        camera: of the pixels.
        pixels: `[N, 2]` u, v [px].
        genes: as `normals`.
        offsets: `[4, 2]` or `[N, 4, 2]` corners from the pixel on [px].
    """
    offsets = np.broadcast_to(offsets, (len(pixels), 4, 2))
    q = genes[:, :1] + genes[:, 1:2] * offsets[:, :, 0] + genes[:, 2:] * offsets[:, :, 1]
    # A plane that runs to infinity within the piece has no patch: its corners stay at the pixel's depth.
    q = np.where(q > 0.5 * genes[:, :1], q, genes[:, :1])
    return camera.unproject(pixels[:, None, :] + offsets, 1.0 / q).astype(np.float32)
