"""From two pixels to a point: the linear (DLT) triangulation."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flysim.geometry.frames import Array
from flysim.geometry.rig import StereoRig


def triangulate(rig: StereoRig, uv_left: ArrayLike, uv_right: ArrayLike) -> Array:
    """`[N, 3]` points [m, left optical frame] seen at `[N, 2]` pixels in both images.

    Solves the homogeneous system of Hartley and Zisserman, Multiple View Geometry, section 12.2, by SVD,
    in normalised image coordinates so that it is well conditioned.
    """
    ul, ur = np.asarray(uv_left, dtype=np.float64), np.asarray(uv_right, dtype=np.float64)
    P_left = np.eye(4)[:3]
    P_right = rig.T_right_left[:3]
    rows = []
    for uv, camera, P in ((ul, rig.left, P_left), (ur, rig.right, P_right)):
        x = (uv[:, 0] - camera.cx) / camera.fx
        y = (uv[:, 1] - camera.cy) / camera.fy
        rows += [x[:, None] * P[2] - P[0], y[:, None] * P[2] - P[1]]
    A = np.stack(rows, axis=1)  # [N, 4, 4]
    X = np.linalg.svd(A)[2][:, -1]
    return X[:, :3] / X[:, 3:]
