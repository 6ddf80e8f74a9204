"""How the right eye is exposed against the left one, read off what both see of the same surfaces.

Flies that have settled say which pixels belong together. Over them the left level is a gain times the right one and an
offset, colour by colour; under uneven light, or through another lens, the gain changes over the picture, slowly.
"""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.compute.rooms import room
from flysim.geometry.frames import Array

MOST, LEAST = 200, 20  # matches that are read; fewer say nothing
FEW, SURELY = 50, 0.5  # matches that are asked first, and the share of SAME_LEVELS below which no others are
SIDE = 2  # [px] about a match whose levels are averaged
# Steps to the pixels there: columns, and rows.
ABOUT = np.mgrid[-SIDE : SIDE + 1, -SIDE : SIDE + 1][::-1].reshape(2, -1).astype(np.float32)
ROUNDS = 6  # of weighing what does not agree down
# A correction is made where the matches' median difference is more than so many times, and by so many grey levels more,
# than what it leaves of it; the gain changes over the picture where that leaves as much less again.
SAME_LEVELS = 1.2  # [grey levels] of that difference, below which nothing is asked
MUCH, LITTLE = 1.5, 0.5
LEAST_GAIN, MOST_GAIN = 0.2, 5.0
IDENTITY = np.tile([1.0, 0.0, 0.0, 0.0, 0.0, 0.0], (3, 1))


def levels_alike(
    left: NDArray[np.uint8], right: NDArray[np.uint8], uv: NDArray[np.integer], uv_right: NDArray[np.floating]
) -> tuple[NDArray[np.uint8], float]:
    """The right picture `[H, W, 3]` as the left eye would have exposed it, or itself where it is alike already.

    Args:
        left, right: `[H, W, 3]` uint8.
        uv: `[N, 2]` left pixels.
        uv_right: `[N, 2]` their matches [px].

    Returns:
        The picture, and the median difference of matched levels that is left [grey levels]; inf of too few matches.
    """
    every = max(len(uv) // MOST, 1)
    here, there = uv[::every].astype(np.float32), uv_right[::every].astype(np.float32)
    if len(here) < LEAST:
        return right, math.inf
    # Where nothing is wrong, a few of them say so.
    few = slice(None, None, max(len(here) // FEW, 1))
    apart = float(np.median(np.abs(_levels(left, here[few]) - _levels(right, there[few]))))
    if apart < SURELY * SAME_LEVELS:
        return right, apart
    ours, theirs = _levels(left, here), _levels(right, there)
    height, width = right.shape[:2]
    place = there.astype(np.float64) / (width, height) * 2.0 - 1.0
    apart = _apart(ours, theirs, place, IDENTITY)
    if apart < SAME_LEVELS:
        return right, apart
    one, all_over = (np.stack([_fit(theirs[:, c], ours[:, c], place, held) for c in range(3)]) for held in (1e9, 30.0))
    left_over, left_under = (_apart(ours, theirs, place, fits) for fits in (one, all_over))
    if apart < MUCH * min(left_over, left_under) + LITTLE:
        return right, apart
    fits = all_over if left_over > MUCH * left_under + LITTLE else one
    gains, before = fits[:, 0], np.arange(256, dtype=np.uint8)[None, :, None]
    if fits is all_over:
        at = np.stack(np.meshgrid(np.linspace(-1.0, 1.0, width), np.linspace(-1.0, 1.0, height)), axis=-1)
        gains, before = np.stack([_gain(fit, at) for fit in fits], axis=-1), right
    exposed = before * gains.astype(np.float32) + fits[:, 1].astype(np.float32)
    made = np.rint(np.clip(exposed, 0.0, 255.0)).astype(np.uint8)
    # One gain for all: a table of all levels does it.
    made = made if fits is all_over else np.asarray(cv2.LUT(right, made, room(*right.shape)), np.uint8)
    return made, min(left_over, left_under)


def _apart(ours: Array, theirs: Array, place: Array, fits: Array) -> float:
    """Median difference of matched levels once the right eye's are corrected [grey levels]."""
    corrected = np.stack([_gain(fits[c], place) * theirs[:, c] + fits[c, 1] for c in range(3)], axis=1)
    return float(np.median(np.abs(ours - corrected)))


def _levels(image: NDArray[np.uint8], at: NDArray[np.float32]) -> Array:
    """`[N, 3]` mean levels about places."""
    x, y = at[:, :1] + ABOUT[0], at[:, 1:] + ABOUT[1]
    read = np.asarray(cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.float32)
    # Exact: sums of some bytes. numpy's own mean over a short axis in the middle takes four times as long.
    return np.einsum("nkc->nc", read).astype(np.float64) / ABOUT.shape[1]


def _fit(theirs: Array, ours: Array, place: Array, even: float) -> Array:
    """`[6]` the gain at the middle, the offset, and how the gain changes with x, y, x^2, y^2, whose ranges are +-1.

    The changes are held to 0 by `even`.
    """
    x, y = place.T
    A = np.stack([theirs, np.ones_like(theirs), theirs * x, theirs * y, theirs * x * x, theirs * y * y], axis=1)
    weights, fit = np.ones(len(A)), IDENTITY[0]
    held = np.diag([1.0, 1e-3, even, even, even, even])
    for _ in range(ROUNDS):
        known, wanted = (
            np.concatenate([A * weights[:, None], held]),
            np.concatenate([ours * weights, held @ IDENTITY[0]]),
        )
        fit = np.asarray(np.linalg.lstsq(known, wanted, rcond=None)[0], np.float64)
        error = np.abs(ours - A @ fit)
        spread = max(1.4826 * float(np.median(error)), 0.3)
        weights = 1.0 / (1.0 + (error / (2.0 * spread)) ** 2)
    return fit


def _gain(fit: Array, place: Array) -> Any:
    x, y = place[..., 0], place[..., 1]
    return np.clip(fit[0] + fit[2] * x + fit[3] * y + fit[4] * x * x + fit[5] * y * y, LEAST_GAIN, MOST_GAIN)
