"""One lens: the light that falls on the chip, from the picture that a pinhole draws."""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array
from flysim.sensors.distortion import Margin, rays, turned
from flysim.sensors.parameters import SensorParams

Levels = NDArray[np.float32]
MICRO = 1e-6


class Lens:
    """Distortion and rolling shutter by one map, then what is lost towards the borders, defocus, motion."""

    def __init__(self, camera: Camera, params: SensorParams, *, right: bool, margin: Margin) -> None:
        """What does not change from picture to picture is made here.

        Args:
            camera: true pinhole of the image, without a margin.
            params: of both eyes.
            right: whether it is the right one.
            margin: by which the drawn picture is larger than the image.

        Raises:
            FlysimError: as `distortion.rays`.
        """
        self._camera, self._drawn, self._distorts = camera, margin.round(camera), params.distorts
        self._row_time = params.row_time_us * MICRO
        self._rays = rays(camera, params) if self._distorts or self._row_time else None
        self._map = self._mapped(*self._rays) if self._rays is not None and self._distorts else None
        self._falloff = _falloff(camera, params.vignetting, params.uneven_right if right else 0.0)
        self._sigma = params.defocus_right if right else params.defocus_left
        self._smear = smear(params.motion_px)

    def light(self, drawn: NDArray[np.uint8], turn_rate: float) -> Levels:
        """`[H, W, 3]` levels on the chip, not rounded.

        Args:
            drawn: `[H, W, 3]` picture of the pinhole, with the margin.
            turn_rate: [rad/s] of the robot, counter-clockwise.
        """
        levels = drawn.astype(np.float32)
        maps = self._map
        if self._rays is not None and self._row_time * turn_rate:
            maps = self._mapped(*turned(*self._rays, self._camera, self._row_time, turn_rate))
        if maps is not None:
            levels = np.asarray(cv2.remap(levels, *maps, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE), np.float32)
            np.clip(levels, 0.0, 255.0, out=levels)  # a cubic overshoots, light does not
        if self._falloff is not None:
            levels *= self._falloff
        if self._sigma:
            levels = np.asarray(
                cv2.GaussianBlur(levels, (0, 0), self._sigma, borderType=cv2.BORDER_REFLECT_101), np.float32
            )
        if self._smear is not None:
            levels = np.asarray(cv2.filter2D(levels, -1, self._smear, borderType=cv2.BORDER_REFLECT_101), np.float32)
        return levels

    def _mapped(self, x: Array, y: Array) -> tuple[Levels, Levels]:
        drawn = self._drawn
        return (x * drawn.fx + drawn.cx).astype(np.float32), (y * drawn.fy + drawn.cy).astype(np.float32)


def _falloff(camera: Camera, vignetting: float, uneven: float) -> Levels | None:
    """`[H, W, 1]` share of the light that arrives; None for all of it."""
    if not (vignetting or uneven):
        return None
    u, v = np.arange(camera.width), np.arange(camera.height)[:, None]
    r2 = (u - camera.cx) ** 2 + (v - camera.cy) ** 2
    arrives = (1.0 - vignetting * r2 / r2.max()) * (1.0 - uneven * u / max(camera.width - 1, 1))
    return arrives[..., None].astype(np.float32)


def smear(length: float) -> Levels | None:
    """`[1, n]` weights of a smear so long [px] along the row, middle in the middle; None where it is within a pixel."""
    if length <= 1.0:
        return None
    half = math.ceil((length - 1.0) / 2.0)
    places = np.arange(-half, half + 1)
    covered = np.minimum(places + 0.5, length / 2.0) - np.maximum(places - 0.5, -length / 2.0)
    return (np.maximum(covered, 0.0) / length)[None].astype(np.float32)
