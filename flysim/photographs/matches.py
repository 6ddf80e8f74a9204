"""A few hundred points that both pictures of a pair show, found anywhere in them: what is asked before flies evolve.

ORB (Rublee, Rabaud, Konolige and Bradski, ICCV 2011): corners that look alike, each the other's best. They tell which
depths there are, whether rows meet, and whether left and right are swapped.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array

MOST = 1500  # corners of a picture
WIDEST = 1000  # [px] pictures wider than this are looked at in a smaller copy
LEAST = 30  # matches that agree, to say anything
NEAR_PX, MOSTLY = 2.0, 0.5  # [px] rows that lie so alike are one distance; share of the most frequent one's votes
DISTANCE = 48  # bits of 256 by which two corners that are one may differ


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Matches:
    """Points that both pictures show.

    Attributes:
        left, right: `[N, 2]` u, v [px].
    """

    left: Array
    right: Array

    @property
    def lower(self) -> Array:
        """`[N]` how much lower each is in the right picture [px]."""
        return self.right[:, 1] - self.left[:, 1]

    @property
    def disparity(self) -> Array:
        """`[N]` how much further left each is in the right picture [px]."""
        return self.left[:, 0] - self.right[:, 0]

    def agreeing(self) -> Matches:
        """Those whose rows lie as far apart as those of most of the others: a match by chance lies anywhere.

        Of two such distances the smaller one counts where enough speaks for it: on a chessboard a corner looks like the
        one above it.
        """
        if len(self.left) < LEAST:
            return self
        lower = self.lower
        steps = np.arange(np.floor(lower.min()), np.ceil(lower.max()) + 1.0)
        votes = np.array([(np.abs(lower - step) <= NEAR_PX).sum() for step in steps])
        able = steps[votes >= MOSTLY * votes.max()]
        middle = float(able[np.argmin(np.abs(able))])
        near = lower[np.abs(lower - middle) <= NEAR_PX]
        middle = float(np.median(near))
        spread = max(1.4826 * float(np.median(np.abs(near - middle))), 0.5)
        keep = np.abs(lower - middle) <= 3.0 * spread
        return Matches(left=self.left[keep], right=self.right[keep])

    def __len__(self) -> int:
        return len(self.left)


def matches(left: NDArray[np.uint8], right: NDArray[np.uint8]) -> Matches:
    """What both pictures show.

    Args:
        left, right: `[H, W, 3]` uint8.
    """
    scale = min(1.0, WIDEST / max(left.shape[1], right.shape[1]))
    found = [_corners(image, scale) for image in (left, right)]
    if any(words is None or len(words) < LEAST for _, words in found):
        return Matches(left=np.empty((0, 2)), right=np.empty((0, 2)))
    pairs = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True).match(found[0][1], found[1][1])
    pairs = [pair for pair in pairs if pair.distance <= DISTANCE]
    one = np.array([found[0][0][pair.queryIdx].pt for pair in pairs], np.float64).reshape(-1, 2)
    other = np.array([found[1][0][pair.trainIdx].pt for pair in pairs], np.float64).reshape(-1, 2)
    return Matches(left=one / scale, right=other / scale)


def _corners(image: NDArray[np.uint8], scale: float):
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    if scale < 1.0:
        grey = cv2.resize(grey, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    orb = cv2.ORB.create(nfeatures=MOST, scaleFactor=1.3, nlevels=4, edgeThreshold=15, fastThreshold=10)
    return orb.detectAndCompute(grey, None)
