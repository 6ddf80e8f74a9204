"""What ROS wants to know of a pair beside its cameras: how each eye is turned until the rows of both meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np

from flysim.geometry.camera_info import CameraInfo
from flysim.geometry.frames import Array


def rectified_infos(raw: Sequence[CameraInfo], T_right_left: Array) -> tuple[CameraInfo, CameraInfo]:
    """The left and the right camera with `R` and `P` of the pair: disparity 0 at infinity, and no border in the image.

    From these two `flysim.geometry.camera_info.stereo_rig` has `T_right_left` again.
    """
    left, right = raw
    R1, R2, P1, P2 = cv2.stereoRectify(
        *(left.K, left.D, right.K, right.D, (left.width, left.height)),
        *(T_right_left[:3, :3], T_right_left[:3, 3].reshape(3, 1)),
        flags=cv2.CALIB_ZERO_DISPARITY,
        alpha=0,
    )[:4]
    return (
        replace(left, R=np.asarray(R1, np.float64), P=np.asarray(P1, np.float64)),
        replace(right, R=np.asarray(R2, np.float64), P=np.asarray(P2, np.float64)),
    )
