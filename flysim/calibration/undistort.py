"""Images as pinholes would have taken them: the lens taken out once, so that whoever matches them knows straight rays.

The two images stay as their cameras stand: nothing is turned until rows meet.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.geometry.camera import Camera
from flysim.geometry.camera_info import CameraInfo, stereo_rig
from flysim.geometry.frames import Array
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.plain import shown

MOST_ZOOM, STEPS = 3.0, 24
# Reads between pixels. Windows of 7x7 px at 12,000 true places of `paper_a` and `yard` (k1 -0.18, noise 1) are matched
# 0.025 px off the truth, in the median, in images made straight by a cubic; 0.038 by a line, 0.034 by Lanczos; 0.036
# where each window is read by the lens's model out of the raw images, by a line, in 30 to 70 times the time.
BETWEEN = cv2.INTER_CUBIC
SLACK = 0.5  # [px] that a pixel's own edge lies beyond its centre


class Straight:
    """A calibrated pair whose lenses are taken out.

    Attributes:
        rig: of the straight images: pinholes, as they stand.
    """

    def __init__(self, left: CameraInfo, right: CameraInfo) -> None:
        """What does not change from pair to pair is made here.

        Raises:
            FlysimError: the files are of no pair, or a lens bends too much to be straightened.
        """
        try:
            rig = stereo_rig(left, right)
        except ValueError as error:
            raise FlysimError(f"calibration: {error}.") from error
        eyes = [(one, straight_camera(one)) for one in (left, right)]
        self.rig: StereoRig = replace(rig, left=eyes[0][1], right=eyes[1][1])
        self._maps = [_map(info, camera) if info.distorts else None for info, camera in eyes]

    def images(self, left: NDArray[np.uint8], right: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
        """The straight images of two as they were taken, `[H, W, 3]` each."""
        return [
            image
            if maps is None
            else np.asarray(cv2.remap(image, *maps, BETWEEN, borderMode=cv2.BORDER_REPLICATE), np.uint8)
            for image, maps in zip((left, right), self._maps, strict=True)
        ]

    def pair(self, left: NDArray[np.uint8], right: NDArray[np.uint8]) -> ImagePair:
        """The straight pair of two images as they were taken."""
        straight = self.images(left, right)
        return ImagePair(left=straight[0], right=straight[1], rig=self.rig)


def straight_camera(info: CameraInfo) -> Camera:
    """The pinhole of a straight image: the camera's own, with a longer focal length where its image would not fill it.

    Raises:
        FlysimError: its image would not fill one three times as long.
    """
    camera = info.camera
    if not info.distorts or _filled(info, camera):
        return camera
    low, high = 1.0, MOST_ZOOM
    if not _filled(info, _zoomed(camera, high)):
        raise FlysimError(
            f"calibration: the lens of {shown(info.name)} bends too much to be straightened. Is it the right file?"
        )
    for _ in range(STEPS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _filled(info, _zoomed(camera, middle)) else (middle, high)
    return _zoomed(camera, high)


def lens(info: CameraInfo, rays: Array) -> Array:
    """`[N, 2]` pixels of the raw image that show `[N, 2]` rays x / z, y / z."""
    points = np.concatenate([rays, np.ones((len(rays), 1))], axis=1).reshape(-1, 1, 3)
    zero = np.zeros(3)
    if info.model == "equidistant":
        found, _ = cv2.fisheye.projectPoints(points, zero, zero, info.K, info.D)
    else:
        found, _ = cv2.projectPoints(points, zero, zero, info.K, info.D)
    return np.asarray(found, np.float64).reshape(-1, 2)


def _rays(camera: Camera, uv: Array) -> Array:
    return (uv - (camera.cx, camera.cy)) / (camera.fx, camera.fy)


def _zoomed(camera: Camera, zoom: float) -> Camera:
    return replace(camera, fx=camera.fx * zoom, fy=camera.fy * zoom)


def _filled(info: CameraInfo, camera: Camera) -> bool:
    """Whether the raw image shows all that the border of a pinhole's image would."""
    u, v = np.arange(camera.width), np.arange(camera.height)
    border = np.concatenate(
        [
            *(np.stack([u, np.full(len(u), at)], axis=1) for at in (0, camera.height - 1)),
            *(np.stack([np.full(len(v), at), v], axis=1) for at in (0, camera.width - 1)),
        ]
    ).astype(np.float64)
    return bool(info.camera.contains(lens(info, _rays(camera, border)), -SLACK).all())


def _map(info: CameraInfo, camera: Camera) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    v, u = np.indices((camera.height, camera.width)).astype(np.float64)
    at = lens(info, _rays(camera, np.stack([u.ravel(), v.ravel()], axis=1))).astype(np.float32)
    x, y = at.T.reshape(2, camera.height, camera.width)
    return np.ascontiguousarray(x), np.ascontiguousarray(y)
