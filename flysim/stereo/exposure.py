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
HELD = np.array([1.0, 1e-6, 900.0, 900.0, 900.0, 900.0])  # squared weights with which a fit is held to it


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
    one, all_over = (_fits(theirs, ours, place, even=even) for even in (True, False))
    left_over, left_under = (_apart(ours, theirs, place, fits) for fits in (one, all_over))
    if apart < MUCH * min(left_over, left_under) + LITTLE:
        return right, apart
    fits = all_over if left_over > MUCH * left_under + LITTLE else one
    left_over = min(left_over, left_under)
    if fits is all_over:
        return _exposed(right, fits), left_over
    # One gain for all: a table of all levels does it.
    levels = np.arange(256, dtype=np.float32)[None, :, None] * fits[:, 0].astype(np.float32)
    table = np.rint(np.clip(levels + fits[:, 1].astype(np.float32), 0.0, 255.0)).astype(np.uint8)
    return np.asarray(cv2.LUT(right, table, room(*right.shape)), np.uint8), left_over


def _exposed(image: NDArray[np.uint8], fits: Array) -> NDArray[np.uint8]:
    """A picture with gains that change over it: `fits` `[3, 6]` of its colours, as `_fits` has them."""
    height, width = image.shape[:2]
    x, y = np.linspace(-1.0, 1.0, width)[:, None], np.linspace(-1.0, 1.0, height)[:, None]
    along, down = fits[:, 0] + x * fits[:, 2] + x * x * fits[:, 4], y * fits[:, 3] + y * y * fits[:, 5]
    gains = down.astype(np.float32)[:, None] + along.astype(np.float32)
    np.clip(gains, LEAST_GAIN, MOST_GAIN, out=gains)
    levels = cv2.multiply(image, gains, dtype=cv2.CV_32F)
    offsets: Any = (*fits[:, 1].tolist(), 0.0)
    return np.asarray(cv2.add(levels, offsets, room(*image.shape), dtype=cv2.CV_8U), np.uint8)


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


def _fits(theirs: Array, ours: Array, place: Array, *, even: bool) -> Array:
    """`[3, 6]` of each colour the gain at the middle, the offset, and how the gain changes with x, y, x^2, y^2.

    The ranges of x and y are +-1. The changes are 0 where the gain is `even`, and else held to it.
    """
    held = HELD[: 2 if even else 6]
    x, y = place.T
    bends = np.stack([np.ones_like(x), x, y, x * x, y * y])[: len(held) - 1]
    A = np.insert(theirs.T[:, None] * bends, 1, 1.0, axis=1)  # [3, n, N]
    wanted, weights, fits = ours.T[:, None], np.ones((3, 1, len(x))), IDENTITY[:, : len(held), None]
    start = np.diag(held) @ fits
    for _ in range(ROUNDS):
        weighted = A * weights**2
        left, right = weighted @ A.transpose(0, 2, 1), weighted @ wanted.transpose(0, 2, 1)
        fits = np.linalg.solve(left + np.diag(held), right + start)
        error = np.abs(wanted - fits.transpose(0, 2, 1) @ A)
        spread = np.maximum(1.4826 * np.median(error, axis=2, keepdims=True), 0.3)
        weights = 1.0 / (1.0 + (error / (2.0 * spread)) ** 2)
    found = IDENTITY.copy()
    found[:, : len(held)] = fits[..., 0]
    return found


def _gain(fit: Array, place: Array) -> Any:
    x, y = place[..., 0], place[..., 1]
    return np.clip(fit[0] + fit[2] * x + fit[3] * y + fit[4] * x * x + fit[5] * y * y, LEAST_GAIN, MOST_GAIN)
