"""Which eye is out of focus, told by the spectra of both pictures; mended by softening the sharper one as much.

Two pictures of one scene have one spectrum, but for what only one eye sees. A blur of deviation s multiplies power at
the frequency f by exp(-4 pi^2 s^2 f^2) (Pentland 1987, two apertures): the logarithm of the spectra's ratio is a line
over f^2, and its slope is the difference of both eyes' s^2. Gain and offset change its height alone. A blurred patch
and a sharp one differ at every edge, and flies and the arms of obstacles take that for depth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.rig import ImagePair

LINES = 80  # of a picture that are looked at, in each direction
BAND = (0.03, 0.35)  # [1/px]: below is the scene's shape, above the pixels' own
LOUD = 6.0  # times the floor of noise that power must have
LEAST = 16  # frequencies
SURE = 6.0  # standard errors
LEAST_PX2 = 0.4  # [px^2]: less does no harm
AGREE = 0.3  # of what is told down the columns must be told along the rows as well
ALONG_PX2 = 1.2  # [px^2] by which the two directions must differ to be no one blur: a motion of 4 px is 1.3


@dataclass(frozen=True, slots=True, kw_only=True)
class Softening:
    """What makes two pictures equally sharp: deviations [px] of the blur each gets, (along rows, along columns)."""

    left_px: tuple[float, float] = (0.0, 0.0)
    right_px: tuple[float, float] = (0.0, 0.0)

    def pair(self, pair: ImagePair) -> ImagePair:
        """A pair whose pictures are equally sharp; itself if they were."""
        if not any((*self.left_px, *self.right_px)):
            return pair
        return replace(pair, left=_softened(pair.left, self.left_px), right=_softened(pair.right, self.right_px))


def softening(left: NDArray[np.uint8], right: NDArray[np.uint8]) -> Softening:
    """What makes a pair equally sharp; nothing where the spectra do not say for sure that it is not.

    Args:
        left, right: `[H, W, 3]` of a pair.
    """
    down, down_error = _difference(_columns(left), _columns(right))
    across, across_error = _difference(_rows(left), _rows(right))
    if abs(across - down) < ALONG_PX2 + 0.6 * abs(down):
        # One blur. What two eyes see side by side differs more along the rows: the other direction is exacter.
        agree = across * down > AGREE * down * down
        across, sure = down, agree and abs(down) > SURE * down_error
    else:  # a motion's
        down, sure = 0.0, abs(across) > max(SURE * across_error, ALONG_PX2)
    if not sure or abs(across) < LEAST_PX2:
        return Softening()
    return Softening(
        left_px=(math.sqrt(max(across, 0.0)), math.sqrt(max(down, 0.0))),
        right_px=(math.sqrt(max(-across, 0.0)), math.sqrt(max(-down, 0.0))),
    )


def _columns(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    step = max(image.shape[1] // LINES, 1)
    return np.ascontiguousarray(_grey(image[:, step // 2 :: step]).T)


def _rows(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    step = max(image.shape[0] // LINES, 1)
    return _grey(image[step // 2 :: step])


def _grey(image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Mean over the colours; numpy's own over so short an axis takes half as long again."""
    red, green, blue = (image[..., colour].astype(np.float32) for colour in range(3))
    return (red + green + blue) / np.float32(3.0)


def _difference(left: NDArray[np.float32], right: NDArray[np.float32]) -> tuple[float, float]:
    """How much larger the right one's squared deviation is along the lines [px^2], and the standard error of that."""
    powers = np.stack([_power(left), _power(right)])
    f = np.fft.rfftfreq(left.shape[1])
    floor = np.median(powers[:, -max(len(f) // 8, 1) :], axis=1)[:, None]  # noise alone, which no lens blurs
    used = (f > BAND[0]) & (f < BAND[1]) & (powers > LOUD * floor.max()).all(axis=0)
    powers = powers - floor
    if used.sum() < LEAST:
        return 0.0, math.inf
    A = np.stack([np.ones(used.sum()), 4.0 * math.pi**2 * f[used] ** 2], axis=1)
    ratio, weights = np.log(powers[0, used] / powers[1, used]), np.ones(used.sum())
    fit, spread = np.zeros(2), 1.0
    for _ in range(5):
        fit = np.linalg.lstsq(A * weights[:, None], ratio * weights, rcond=None)[0]
        error = np.abs(ratio - A @ fit)
        spread = max(1.4826 * float(np.median(error)), 1e-3)
        weights = 1.0 / (1.0 + (error / (2.0 * spread)) ** 2)
    variance = np.linalg.pinv((A * weights[:, None]).T @ (A * weights[:, None]))[1, 1]
    return float(fit[1]), spread * math.sqrt(variance)


def _power(lines: NDArray[np.float32]) -> NDArray[np.float64]:
    """Mean power spectrum of lines, each through a Hann window."""
    window = np.hanning(lines.shape[1]).astype(np.float32)
    spectrum = np.fft.rfft((lines - lines.mean(axis=1, keepdims=True)) * window, axis=1)
    return (np.abs(spectrum) ** 2).mean(axis=0) + 1e-12


def _softened(image: NDArray[np.uint8], sigma: tuple[float, float]) -> NDArray[np.uint8]:
    if not any(sigma):
        return image
    x, y = (max(s, 1e-3) for s in sigma)
    return np.asarray(cv2.GaussianBlur(image, (0, 0), x, sigmaY=y, borderType=cv2.BORDER_REPLICATE), np.uint8)
