"""What flies compare in place of grey levels: how fast the picture changes along its rows, in its own unit.

Two eyes are never exposed alike. A derivative takes away what is added to every level; measured in a unit that is read
off each picture for itself, it takes away what every level is multiplied with, and contrast with it. It is what
OpenCV's StereoBM does (`PREFILTER_XSOBEL`), with the unit added, and in the spirit of eq. (1)'s Sobel norms. The
picture is smoothed as it is derived: by so much that its own noise stays small beside the unit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.compute.rooms import room

# A derivative of this share of all pixels is below the unit, twice the unit is as much as is told apart. Measured on
# renders and photographs: 0.7 and 0.85 do equally well.
UNIT_QUANTILE, CLIP = 0.85, 2.0
# Where edges are few, the unit is read off the strongest: else all of them would be more than is told apart.
STRONG_QUANTILE, STRONG = 0.99, 4.0
MIDDLE, REACH = 128.0, 127.0  # grey levels of no change at all, and from there to the most that is told apart
LEAST_UNIT = 0.02  # [grey levels / px] a picture without any contrast is not blown up to one
# [px] of the smoothing. The least is also that of clean pictures: see docs/engine.md.
LEAST_BLUR, MOST_BLUR = 1.0, 4.0
NOISE_SHARE = 0.07  # of the unit that the noise of a derivative may be
SAME = 0.05  # of units of two eyes that are exposed alike
MOST_COUNTED = 4096  # the mask of noise gives at most 16 times a grey level, a derivative in sixteenths no more
BAND, APART = 12, 64  # rows in which the unit is read off, and from one such band to the next


@dataclass(frozen=True, slots=True, kw_only=True)
class Photometry:
    """What was read off one picture.

    Attributes:
        noise: standard deviation of the noise of a pixel [grey levels].
        unit: of the derivative that is smoothed by LEAST_BLUR [grey levels / px].
    """

    noise: float
    unit: float

    @property
    def blur(self) -> float:
        """Standard deviation of the smoothing that leaves NOISE_SHARE of the unit as noise [px]."""
        # White noise that is smoothed by a Gaussian s and derived has 0.2 / s^2 of its deviation left; 1.44 deviations
        # of a normal distribution hold as many as the quantile.
        added = 1.44 * 0.2 * self.noise / LEAST_BLUR**2
        own = max(math.sqrt(max(self.unit**2 - added**2, 0.0)), 0.2 * self.unit, LEAST_UNIT)
        return min(max(math.sqrt(0.2 * self.noise / (NOISE_SHARE * own)), LEAST_BLUR), MOST_BLUR)


def read_off(image: NDArray[np.uint8]) -> Photometry:
    """Noise and unit of a picture `[H, W, 3]`, from bands of its rows.

    Noise is the median answer to a mask that neither slopes nor edges along rows or columns excite (Immerkaer, 1996).
    """
    bands = _bands(image)
    return Photometry(noise=_noise(bands), unit=_unit(bands, LEAST_BLUR))


def units(images: Sequence[NDArray[np.uint8]], told: Sequence[Photometry], blur: float) -> list[float]:
    """The unit of each of two pictures, smoothed; one for both where they are as good as equal.

    Two eyes do not see quite the same: units that differ by less than SAME are taken for those of one exposure.
    """
    each = [one.unit for one in told] if blur == LEAST_BLUR else [_unit(_bands(image), blur) for image in images]
    each = [max(unit, LEAST_UNIT) for unit in each]
    return [sum(each) / len(each)] * len(each) if max(each) < (1.0 + SAME) * min(each) else each


def prefiltered(image: NDArray[np.uint8], blur: float, unit: float) -> NDArray[np.uint8]:
    """`[H, W, 3]` uint8: the derivative of each colour along the rows, in the picture's own unit, 128 for none.

    Args:
        image: `[H, W, 3]` uint8.
        blur: standard deviation of the smoothing [px].
        unit: of `units` [grey levels / px].
    """
    along, across = _kernels(blur)
    scale, to = REACH / (CLIP * unit), room(*image.shape)
    return np.asarray(cv2.sepFilter2D(image, cv2.CV_8U, along * scale, across, to, delta=MIDDLE), np.uint8)


def _bands(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """`[n, BAND, W, 3]` some rows of a picture; all of a low one."""
    count = image.shape[0] // APART
    if count < 4:
        return image[None]
    return np.ascontiguousarray(image[: count * APART].reshape(count, APART, *image.shape[1:])[:, :BAND])


def _noise(bands: NDArray[np.uint8]) -> float:
    green = bands[..., 1].astype(np.int16)  # of Bayer's pattern every second pixel has it
    down = green[:, :-2] - 2 * green[:, 1:-1] + green[:, 2:]
    mask = down[:, :, :-2] - 2 * down[:, :, 1:-1] + down[:, :, 2:]
    return _quantiles(np.abs(mask), (0.5,))[0] / (6.0 * 0.6745)


def _unit(bands: NDArray[np.uint8], blur: float) -> float:
    """The quantile of the derivative's absolute value [grey levels / px], along rows, to a sixteenth."""
    along, across = _kernels(blur)
    reach, edge = len(along) // 2, (bands.shape[1] - 1) // 2
    # All bands as one picture, where what is smoothed from one into another can be left out.
    pictures = bands.reshape(1, -1, *bands.shape[2:]) if reach <= edge else bands
    slopes = [cv2.sepFilter2D(picture, cv2.CV_16S, along * 16.0, across) for picture in pictures]
    edge = min(reach, edge)
    inner = np.stack(slopes).reshape(bands.shape)[:, edge : bands.shape[1] - edge]
    usual, strong = _quantiles(np.abs(inner), (UNIT_QUANTILE, STRONG_QUANTILE))
    return max(usual, strong / STRONG) / 16.0


def _quantiles(values: NDArray[np.int16], shares: Sequence[float]) -> list[float]:
    """Of whole numbers that stand for all between half below and half above; by counting, which takes no sorting.

    Args:
        values: from 0 to less than MOST_COUNTED, along rows in the last axis.
        shares: of all of them that are below a quantile.
    """
    rows = np.ascontiguousarray(values.reshape(-1, values.shape[-1])).view(np.uint16)
    # numpy counts after it has made whole numbers of 64 bits of them, which takes three times as long.
    counts = cv2.calcHist([rows], [0], None, [MOST_COUNTED], [0, MOST_COUNTED]).ravel().astype(np.int64)
    below = np.cumsum(counts)
    found = []
    for share in shares:
        wanted = share * float(below[-1])
        at = int(np.searchsorted(below, wanted))
        before = float(below[at - 1]) if at else 0.0
        found.append(max(at - 0.5 + (wanted - before) / max(float(counts[at]), 1.0), 0.0))
    return found


@lru_cache(maxsize=16)
def _kernels(blur: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The derivative of a Gaussian and the Gaussian; a ramp of 1 a pixel has the derivative 1."""
    n = max(math.ceil(3.0 * blur), 1)
    x = np.arange(-n, n + 1, dtype=np.float64)
    smooth = np.exp(-0.5 * (x / blur) ** 2)
    smooth /= smooth.sum()
    slope = x * smooth
    return (slope / (slope * x).sum()).astype(np.float32), smooth.astype(np.float32)
