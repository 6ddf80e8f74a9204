"""A pair made ready for evolution: bytes, gradients, and how a fly of the left image falls into the right one."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.camera import Camera
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
        gradient_left, gradient_right: `[H, W]` float32 [grey levels / px], root mean square over the colours.
        to_right: `[3, 3]` float64.
        shift: `[3]` float64.
    """

    left: NDArray[np.uint8]
    right: NDArray[np.uint8]
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
    if fitness == "paper":
        gradient_left, gradient_right = _sobel_norm(pair.left), _sobel_norm(pair.right)
    else:
        # The epipole of an image is the other camera's centre, seen in it.
        gradient_left = _sobel_along(pair.left, rig.left.K @ T_left_right[:3, 3], rig.left)
        gradient_right = _sobel_along(pair.right, rig.right.K @ t, rig.right)
    return Views(
        left=pair.left,
        right=pair.right,
        gradient_left=gradient_left,
        gradient_right=gradient_right,
        to_right=rig.right.K @ R @ np.linalg.inv(rig.left.K),
        shift=rig.right.K @ t,
    )


def disparity_per_inverse_depth(rig: StereoRig) -> float:
    """Pixels that a projection moves along its epipolar line for 1/m of inverse depth (rectified: f B)."""
    return rig.left.fx * rig.baseline


def _sobel(image: NDArray[np.uint8]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    gx = cv2.Sobel(image, cv2.CV_16S, 1, 0, ksize=3).astype(np.float32)
    gy = cv2.Sobel(image, cv2.CV_16S, 0, 1, ksize=3).astype(np.float32)
    return gx / np.float32(SOBEL_GAIN), gy / np.float32(SOBEL_GAIN)


def _over_colours(squared: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.sqrt(squared.sum(axis=2) / np.float32(3.0))


def _sobel_norm(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    gx, gy = _sobel(image)
    return _over_colours(gx * gx + gy * gy)


def _sobel_along(image: NDArray[np.uint8], epipole: Array, camera: Camera) -> NDArray[np.float32]:
    gx, gy = _sobel(image)
    if abs(epipole[2]) * 1e6 < np.linalg.norm(epipole[:2]) and abs(epipole[1]) * 1e9 < abs(epipole[0]):
        return _over_colours(gx * gx)  # the epipole is at infinity along the rows
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    du, dv = epipole[0] - u * epipole[2], epipole[1] - v * epipole[2]
    norm = np.maximum(np.hypot(du, dv), 1e-12)
    along = gx * (du / norm)[..., None].astype(np.float32) + gy * (dv / norm)[..., None].astype(np.float32)
    return _over_colours(along * along)
