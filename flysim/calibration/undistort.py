"""Images as pinholes would have taken them: the lens taken out once, so that whoever matches them knows straight rays.

The two images stay as their cameras stand: nothing is turned until rows meet.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flysim.calibration.lens import SLACK, projected, through
from flysim.errors import FlysimError
from flysim.geometry.calibration.ros import raw_camera
from flysim.geometry.camera import Camera
from flysim.geometry.camera_info import CameraInfo, stereo_rig
from flysim.geometry.frames import Array
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.plain import shown

MOST_ZOOM, STEPS = 3.0, 24


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
        self._lookups = [
            through(raw_camera(info), np.eye(3), camera.K, (camera.width, camera.height)) if info.distorts else None
            for info, camera in eyes
        ]

    def images(self, left: NDArray[np.uint8], right: NDArray[np.uint8]) -> list[NDArray[np.uint8]]:
        """The straight images of two as they were taken, `[H, W, 3]` each."""
        both = zip((left, right), self._lookups, strict=True)
        return [image if lookup is None else lookup(image) for image, lookup in both]

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
    return projected(raw_camera(info), rays)


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
