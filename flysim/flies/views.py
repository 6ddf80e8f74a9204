"""A pair made ready for evolution: bytes, gradients, and how a fly of the left image falls into the right one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from flysim.geometry.frames import Array, inverse
from flysim.geometry.rig import ImagePair, StereoRig

# Sobel's kernel weighs 8 neighbours' differences over 2 px / 2: its sum over a ramp of 1 level/px is 8.
SOBEL_GAIN = 8.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Views:
    """What the kernels read.

    A fly is a left pixel (u, v) and an inverse depth q [1/m]. Its right projection is, in homogeneous pixels,
    `to_right @ (u, v, 1) + q * shift`: the plane-at-infinity homography and the epipole (Hartley and Zisserman,
    section 9.6).

    Attributes:
        left, right: `[H, W, 3]` uint8.
        grey_left, grey_right: `[H, W]` uint8.
        gradient_left, gradient_right: `[H, W]` float32 [grey levels / px], root mean square over the colours.
        to_right: `[3, 3]` float64.
        shift: `[3]` float64.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
    grey_left: NDArray[np.uint8]
    grey_right: NDArray[np.uint8]
    gradient_left: NDArray[np.float32]
    gradient_right: NDArray[np.float32]
    to_right: Array
    shift: Array


def prepare(pair: ImagePair, fitness: str) -> Views:
    """Gradients of both images, once a pair.

    Args:
        pair: the images and their rig.
        fitness: "paper" takes the norm of the Sobel gradient, "epipolar" its part along the epipolar line.
    """
    rig = pair.rig
    R, t = rig.T_right_left[:3, :3], rig.T_right_left[:3, 3]
    T_left_right = inverse(rig.T_right_left)
    gradient_left, gradient_right = (np.empty(image.shape[:2], np.float32) for image in (pair.left, pair.right))
    # The epipole of an image is the other camera's centre, seen in it.
    _gradients(pair.left, rig.left.K @ T_left_right[:3, 3], fitness == "paper", gradient_left)
    _gradients(pair.right, rig.right.K @ t, fitness == "paper", gradient_right)
    return Views(
        left=pair.left,
        right=pair.right,
        grey_left=np.asarray(cv2.cvtColor(pair.left, cv2.COLOR_RGB2GRAY), np.uint8),
        grey_right=np.asarray(cv2.cvtColor(pair.right, cv2.COLOR_RGB2GRAY), np.uint8),
        gradient_left=gradient_left,
        gradient_right=gradient_right,
        to_right=rig.right.K @ R @ np.linalg.inv(rig.left.K),
        shift=rig.right.K @ t,
    )


def disparity_per_inverse_depth(rig: StereoRig) -> float:
    """Pixels that a projection moves along its epipolar line for 1/m of inverse depth (rectified: f B)."""
    return rig.left.fx * rig.baseline


@njit(cache=True, parallel=True)
def _gradients(image, epipole, norm, out):
    """Fills `out` `[H, W]` with the root mean square over the colours of Sobel's gradient [grey levels / px].

    Along the line to the `epipole` (homogeneous pixel), or its norm in all directions if `norm`.
    """
    height, width = image.shape[:2]
    level = abs(epipole[1]) * 1e9 < abs(epipole[0]) and abs(epipole[2]) * 1e6 < abs(epipole[0])  # along the rows
    for v in prange(height):
        above, below = max(v - 1, 0), min(v + 1, height - 1)
        for u in range(width):
            west, east = max(u - 1, 0), min(u + 1, width - 1)
            du, dv = 1.0, 0.0
            if not level:
                du, dv = epipole[0] - u * epipole[2], epipole[1] - v * epipole[2]
                length = max(math.hypot(du, dv), 1e-12)
                du, dv = du / length, dv / length
            total = 0.0
            for k in range(3):
                nw, ne = float(image[above, west, k]), float(image[above, east, k])
                sw, se = float(image[below, west, k]), float(image[below, east, k])
                gx = ne + se - nw - sw + 2.0 * (float(image[v, east, k]) - float(image[v, west, k]))
                if level and not norm:
                    total += gx * gx
                    continue
                gy = sw + se - nw - ne + 2.0 * (float(image[below, u, k]) - float(image[above, u, k]))
                total += gx * gx + gy * gy if norm else (gx * du + gy * dv) ** 2
            out[v, u] = math.sqrt(total / 3.0) / SOBEL_GAIN
