"""What flies compare in place of grey levels: how fast the picture changes along its rows, in its own unit.

Two eyes are never exposed alike. A derivative takes away what is added to every level; measured in a unit that is read
off each picture for itself, it takes away what every level is multiplied with, and contrast with it. It is what
OpenCV's StereoBM does (`PREFILTER_XSOBEL`), with the unit added, and in the spirit of eq. (1)'s Sobel norms. The
picture is smoothed as it is derived: by so much that its own noise stays small beside the unit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.compute.rooms import room
from flysim.stereo.derivative import COLOURS, TAPS, count_mask, count_slopes, derive

# A derivative of this share of all pixels is below the unit, twice the unit is as much as is told apart. Measured on
# renders and photographs: 0.7 and 0.85 do equally well.
UNIT_QUANTILE, CLIP = 0.85, 2.0
# Where edges are few, the unit is read off the strongest: else all of them would be more than is told apart.
STRONG_QUANTILE, STRONG = 0.99, 4.0
MIDDLE, REACH = 128.0, 127.0  # grey levels of no change at all, and from there to the most that is told apart
LEAST_UNIT = 0.02  # [grey levels / px] a picture without any contrast is not blown up to one
# [px] of the smoothing. The least is also that of clean pictures: see docs/engine.md.
LEAST_BLUR, MOST_BLUR = 1.0, 4.0
# [px] of the smoothing across the rows of a clean picture, and by how much faster than along them it grows with noise.
UPRIGHT, RISE = 0.6, 2.5
NOISE_SHARE = 0.07  # of the unit that the noise of a derivative may be
SAME = 0.05  # of units of two eyes that are exposed alike
FINE = 16.0  # parts of a grey level a pixel, in which the unit is told
MOST_COUNTED = 4096  # the mask of noise gives at most 16 times a grey level, a derivative in sixteenths no more
GREEN = 1  # of Bayer's pattern every second pixel has it
CELL, PLAIN = 16, 0.1  # [px] and share of the unit: a cell that changes by less shows nothing
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
    return Photometry(noise=_noise(image), unit=_unit(image, LEAST_BLUR))


def units(images: Sequence[NDArray[np.uint8]], told: Sequence[Photometry], blur: float) -> list[float]:
    """The unit of each of two pictures, smoothed; one for both where they are as good as equal.

    Two eyes do not see quite the same: units that differ by less than SAME are taken for those of one exposure.
    """
    each = [one.unit for one in told] if blur == LEAST_BLUR else [_unit(image, blur) for image in images]
    each = [max(unit, LEAST_UNIT) for unit in each]
    return [sum(each) / len(each)] * len(each) if max(each) < (1.0 + SAME) * min(each) else each


def alone(kernel: Callable[..., None], *arguments: Any) -> None:
    """Calls a kernel in one lane."""
    kernel(0, *arguments)


def prefiltered(
    images: Sequence[NDArray[np.uint8]],
    blur: float,
    units: Sequence[float],
    share: Callable[..., None] = alone,
    lanes: int = 1,
) -> list[NDArray[np.uint8]]:
    """`[H, W, 3]` uint8 each: the derivative of each colour along the rows, in the picture's own unit, 128 for none.

    Args:
        images: `[H, W, 3]` uint8, all of one size.
        blur: standard deviation of the smoothing [px].
        units: of `units` [grey levels / px], for each picture.
        share: calls a kernel in several lanes.
        lanes: how many at most.
    """
    found = [room(*image.shape) for image in images]
    along = _kernels(blur)[0]
    alongs = tuple(along * np.float32(REACH / (CLIP * unit)) for unit in units)
    rest = _rest(images[0].shape[:2], blur, MIDDLE, lanes)
    share(derive, np.zeros(1, np.int64), tuple(map(_flat, images)), tuple(map(_flat, found)), alongs, *rest)
    return found


def plain_share(picture: NDArray[np.uint8]) -> float:
    """The share of a prefiltered picture in which nothing changes along the rows: there is nothing to match there.

    Cells of CELL x CELL px are asked, a quarter of their rows, whether they change by less than PLAIN of the unit.
    """
    some = picture[:: CELL // 4]
    change = cv2.absdiff(some, np.full_like(some, MIDDLE))
    rows, columns = max(change.shape[0] // 4, 1), max(change.shape[1] // CELL, 1)
    mean = cv2.resize(change, (columns, rows), interpolation=cv2.INTER_AREA)
    most = cv2.max(cv2.max(mean[..., 0], mean[..., 1]), mean[..., 2])  # of the colours
    return float((most < PLAIN * REACH / CLIP).mean())


def _rest(size: tuple[int, int], blur: float, start: float, lanes: int) -> tuple[NDArray, ...]:
    """The last arguments of `derivative.derive`, for pictures of so many rows and columns."""
    across, (high, wide) = _kernels(blur)[1], size
    lines = np.empty((lanes, 5, COLOURS * (wide + len(across) - 1)), np.float32)
    return *_mirrored(high, wide, len(across) // 2), across, np.full(COLOURS * wide, start, np.float32), lines


def _flat(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """`[H, 3 W]`."""
    return np.ascontiguousarray(image).reshape(image.shape[0], -1)


@lru_cache(maxsize=16)
def _mirrored(high: int, wide: int, n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows from n above a picture to n below it, and its n columns on either side, where mirrored they are read."""
    rows = [cv2.borderInterpolate(y, high, cv2.BORDER_REFLECT_101) for y in range(-n, high + n)]
    beside = [*range(-n, 0), *range(wide, wide + n)]
    columns = [cv2.borderInterpolate(x, wide, cv2.BORDER_REFLECT_101) for x in beside]
    return np.array(rows, np.int64), np.array(columns, np.int64)


def _bands(high: int) -> tuple[NDArray[np.int64], int]:
    """First rows of the bands of a picture, and how many rows each has; all of a low one."""
    count = high // APART
    return (np.arange(count) * APART, BAND) if count >= 4 else (np.zeros(1, np.int64), high)


def _noise(image: NDArray[np.uint8]) -> float:
    counts = np.zeros(MOST_COUNTED, np.int64)
    count_mask(_flat(image), *_bands(image.shape[0]), GREEN, counts)
    return _quantiles(counts, (0.5,))[0] / (6.0 * 0.6745)


def _unit(image: NDArray[np.uint8], blur: float) -> float:
    """The quantile of the derivative's absolute value [grey levels / px], along rows, to a sixteenth."""
    counts = np.zeros(MOST_COUNTED, np.int64)
    tops, high = _bands(image.shape[0])
    edge = min(_reach(blur), (high - 1) // 2)  # the rows that a band's border is smoothed into
    along, *rest, lines = _kernels(blur)[0] * np.float32(FINE), *_rest((high, image.shape[1]), blur, 0.0, 1)
    count_slopes(_flat(image), tops, high, edge, along, *rest, lines[0], counts)
    usual, strong = _quantiles(counts, (UNIT_QUANTILE, STRONG_QUANTILE))
    return max(usual, strong / STRONG) / FINE


def _reach(blur: float) -> int:
    """How far the kernels reach [px]."""
    return max(math.ceil(3.0 * blur), 1)


def _quantiles(counts: NDArray[np.int64], shares: Sequence[float]) -> list[float]:
    """Of whole numbers that stand for all between half below and half above, of which there are so many each."""
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
    """The derivative of a Gaussian and the Gaussian; a ramp of 1 a pixel has the derivative 1.

    Beyond three deviations they are 0, up to a multiple of what is added up in one go.
    """
    reach = _reach(blur)
    n = -(-reach // TAPS) * TAPS
    x = np.arange(-n, n + 1, dtype=np.float64)
    smooth, upright = (
        np.where(np.abs(x) <= reach, np.exp(-0.5 * (x / sigma) ** 2), 0.0) for sigma in (blur, _upright(blur))
    )
    slope = x * smooth
    return (slope / (slope * x).sum()).astype(np.float32), (upright / upright.sum()).astype(np.float32)


def _upright(blur: float) -> float:
    """How much is smoothed across the rows [px]: less than along them where the noise allows it.

    On a floor or a top seen at a low angle each row is shifted against the next. A blend of rows that are shifted
    differently in both eyes is not alike in them.
    """
    return min(UPRIGHT + RISE * max(blur - LEAST_BLUR, 0.0), blur)
