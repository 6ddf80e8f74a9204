"""Pixels of a surface that is taken to be flat: where they are in the right image, and whether they are alike there."""

from __future__ import annotations

import numpy as np

from flysim.compute.compiled import compiled
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array
from flysim.geometry.rig import StereoRig

MISPLACED = 0.5  # [px] shift that would explain the difference of pixels that are still alike
MISSES = 2  # pixels in a row that are not alike end the surface before the first of them


def right_of(rig: StereoRig) -> Array:
    """`[3, 4]`: of a left pixel p = (u, v, 1) with inverse depth q [1/m], `right_of(rig) @ (p, q)` is its right one."""
    found = np.empty((3, 4))
    found[:, :3] = rig.right.K @ rig.T_right_left[:3, :3] @ np.linalg.inv(rig.left.K)
    found[:, 3] = rig.right.K @ rig.T_right_left[:3, 3]
    return found


def on_planes(camera: Camera, planes: Array, pixels: Array) -> Array:
    """`[n, 4, 3]` points of the planes at `[n, 4, 2]` left pixels."""
    q = (planes[:, None, :2] * pixels).sum(axis=-1) + planes[:, 2:]
    return camera.unproject(pixels.reshape(-1, 2), 1.0 / np.maximum(q, 1e-9).ravel()).reshape(*q.shape, 3)


@compiled
def compared(left, right, to_right, planes, n, u, v):
    """(squared difference, squared gradient) summed over the colours of a left pixel; -1 where a view lacks it."""
    if not (1 <= u < left.shape[1] - 1 and 0 <= v < left.shape[0]):
        return -1.0, 0.0
    q = planes[n, 0] * u + planes[n, 1] * v + planes[n, 2]
    z = to_right[2, 0] * u + to_right[2, 1] * v + to_right[2, 2] + to_right[2, 3] * q
    if q <= 0.0 or z <= 0.0:
        return -1.0, 0.0
    x = (to_right[0, 0] * u + to_right[0, 1] * v + to_right[0, 2] + to_right[0, 3] * q) / z
    y = (to_right[1, 0] * u + to_right[1, 1] * v + to_right[1, 2] + to_right[1, 3] * q) / z
    if not (0.0 <= x < right.shape[1] - 1 and 0.0 <= y <= right.shape[0] - 1):
        return -1.0, 0.0
    i, j = int(x), min(int(y), right.shape[0] - 2)
    a, b = x - i, y - j
    different = contrast = 0.0
    for c in range(3):
        upper = (1.0 - a) * right[j, i, c] + a * right[j, i + 1, c]
        lower = (1.0 - a) * right[j + 1, i, c] + a * right[j + 1, i + 1, c]
        e = left[v, u, c] - ((1.0 - b) * upper + b * lower)
        g = (float(left[v, u + 1, c]) - float(left[v, u - 1, c])) / 2.0
        different += e * e
        contrast += g * g
    return different, contrast
