"""From levels to the 8-bit image of a file: noise, the colour filter, the bounds of a byte, JPEG."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.sensors.exposure import WHITE
from flysim.sensors.optics import Levels
from flysim.sensors.parameters import SensorParams

STREAM = 0x5E45  # sets the random numbers of cameras apart from those of whoever sees, under one seed


def stream(seed: int, index: int, eye: int) -> np.random.Generator:
    """The random numbers of one image: they depend on the run's seed, its frame and its eye (0 left), and no more."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM, index, eye)))


def read_out(levels: Levels, params: SensorParams, rng: np.random.Generator) -> NDArray[np.uint8]:
    """`[H, W, 3]` RGB as it comes out of the camera.

    Args:
        levels: `[H, W, 3]`, not rounded; may be changed.
        params: of the camera.
        rng: of this image. Shot noise and reading draw from a child each: one does not change the other.
    """
    arrival, reading = rng.spawn(2)
    if params.shot_noise:
        levels = arrived(levels, params.shot_noise, arrival)
    if params.noise:
        levels += np.float32(params.noise) * reading.standard_normal(levels.shape, dtype=np.float32)
    image = np.clip(np.rint(levels), 0.0, WHITE).astype(np.uint8)
    if params.bayer:
        image = through_bayer(image)
    return compressed(image, params.jpeg_quality) if params.jpeg_quality else image


def arrived(levels: Levels, electrons: float, rng: np.random.Generator) -> Levels:
    """Levels of light that comes in single electrons, so many at level 255. Below 0 there is no light to count."""
    lit = np.maximum(levels, 0.0)
    counted = rng.poisson(lit.astype(np.float64) * (electrons / WHITE)) * (WHITE / electrons)
    return (counted + (levels - lit)).astype(np.float32)


def through_bayer(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The image of a chip behind red, green, green and blue filters in squares of 2 x 2, filled in bilinearly."""
    mosaic = image[..., 1].copy()
    mosaic[::2, ::2], mosaic[1::2, 1::2] = image[::2, ::2, 0], image[1::2, 1::2, 2]
    if min(mosaic.shape) < 4:
        return image  # OpenCV has nothing to fill in from
    return np.asarray(cv2.cvtColor(mosaic, cv2.COLOR_BayerRGGB2RGB), np.uint8)


def compressed(image: NDArray[np.uint8], quality: int) -> NDArray[np.uint8]:
    """The image after a JPEG of that quality, its colours at half the resolution as in most files."""
    _, data = cv2.imencode(".jpg", image[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])
    read = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), np.uint8)
    return np.ascontiguousarray(read[..., ::-1])
