"""OpenCV's dense matchers on a rectified pair: StereoBM and StereoSGBM in its three-way mode.

Hirschmueller, "Stereo processing by semiglobal matching and mutual information", PAMI 30(2), 2008. The figures below
are what OpenCV's documentation calls usual.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.rig import ImagePair, StereoRig

Method = Literal["sgbm", "bm"]

BLOCK = 5  # [px] side of the window; also the least that StereoBM takes
MARGIN = BLOCK // 2  # [px]
P1, P2 = 8 * BLOCK**2, 32 * BLOCK**2  # what a step of one pixel, and a larger one, of disparity costs; for one channel
UNIQUENESS = 10  # [%] by which the best match must beat the second
LEFT_RIGHT = 1  # [px] by which a match may differ from the one found the other way round
SPECKLE_WINDOW, SPECKLE_RANGE = 100, 2  # [px] smaller patches of one disparity are taken out
STEP = 16  # both matchers search a multiple of so many disparities
SUBPIXEL = 16  # their result is in sixteenths of a pixel


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """Disparities [px] that a matcher tries: `first`, and `count` of them in all."""

    first: int
    count: int

    @property
    def padding(self) -> int:
        """Columns [px] that OpenCV never matches at the left border of an image."""
        return self.first + self.count


def search_range(rig: StereoRig, min_depth: float, max_depth: float) -> Search:
    """The least range of disparities that holds every depth between two, both included.

    Args:
        rig: a rectified one.
        min_depth: nearest depth searched [m].
        max_depth: farthest depth searched [m].

    Raises:
        ValueError: the rig is not rectified, has its right camera on the left, or the depths are no range.
    """
    if not rig.rectified or rig.T_right_left[0, 3] >= 0.0:
        raise ValueError("a dense matcher needs a rectified pair with the right camera on the right: rectify it first")
    if not 0.0 < min_depth < max_depth < math.inf:
        raise ValueError(f"depths must be 0 < min_depth < max_depth, got {min_depth} m and {max_depth} m")
    # A disparity u_left - u_right holds what the principal points differ by.
    offset, gain = rig.left.cx - rig.right.cx, rig.left.fx * rig.baseline
    first = math.floor(offset + gain / max_depth)
    last = math.ceil(offset + gain / min_depth)
    if first < 0:
        raise ValueError(f"disparities must be >= 0 px, got {first} px at {max_depth} m: shift the right image")
    return Search(first=first, count=math.ceil((last - first + 1) / STEP) * STEP)


def farthest(rig: StereoRig, wanted: float) -> float:
    """The depth [m] that a dense matcher searches to: no farther than where disparities are 0 px."""
    offset = rig.left.cx - rig.right.cx
    return min(wanted, rig.left.fx * rig.baseline / -offset) if offset < 0.0 else wanted


def dense(
    pair: ImagePair, method: Method, *, min_depth: float, max_depth: float, threads: int | None = None
) -> NDArray[np.float32]:
    """The disparity of each left pixel.

    Args:
        pair: a rectified pair, the right camera on the right.
        method: "sgbm" (StereoSGBM, three-way) or "bm" (StereoBM).
        min_depth: nearest depth searched [m].
        max_depth: farthest depth searched [m].
        threads: that OpenCV may use; None leaves its setting as it is.

    Returns:
        `[H, W]` float32 disparity u_left - u_right [px], NaN where the matcher gives none.

    Raises:
        ValueError: an unknown method, or as `search_range`.
    """
    search = search_range(pair.rig, min_depth, max_depth)
    matcher = _matcher(method, search)
    with _threads(threads):
        # Grey: StereoBM takes nothing else, and it is what people feed SGBM, which is slower on colour.
        grey = [cv2.cvtColor(image, cv2.COLOR_RGB2GRAY) for image in (pair.left, pair.right)]
        # StereoBM gives no pixel whose window leaves the image, neither any whose range of disparities does.
        borders = (MARGIN, MARGIN, search.padding + MARGIN, MARGIN)
        left, right = (cv2.copyMakeBorder(image, *borders, cv2.BORDER_REPLICATE) for image in grey)
        found = matcher.compute(left, right)[MARGIN:-MARGIN, search.padding + MARGIN : -MARGIN]
    none = (search.first - 1) * SUBPIXEL
    return np.where(found > none, found / np.float32(SUBPIXEL), np.float32(np.nan))


def _matcher(method: Method, search: Search) -> cv2.StereoMatcher:
    if method == "sgbm":
        return cv2.StereoSGBM.create(
            minDisparity=search.first,
            numDisparities=search.count,
            blockSize=BLOCK,
            P1=P1,
            P2=P2,
            disp12MaxDiff=LEFT_RIGHT,
            uniquenessRatio=UNIQUENESS,
            speckleWindowSize=SPECKLE_WINDOW,
            speckleRange=SPECKLE_RANGE,
            mode=cv2.StereoSGBM_MODE_SGBM_3WAY,
        )
    if method == "bm":
        bm = cv2.StereoBM.create(numDisparities=search.count, blockSize=BLOCK)
        bm.setMinDisparity(search.first)
        bm.setUniquenessRatio(UNIQUENESS)
        bm.setDisp12MaxDiff(LEFT_RIGHT)
        bm.setSpeckleWindowSize(SPECKLE_WINDOW)
        bm.setSpeckleRange(SPECKLE_RANGE)
        return bm
    raise ValueError(f"method must be 'sgbm' or 'bm', got {method!r}")


@contextmanager
def _threads(count: int | None) -> Iterator[None]:
    """OpenCV's threads for a while: the setting is the whole process's."""
    if count is None:
        yield
        return
    before = cv2.getNumThreads()
    cv2.setNumThreads(count)
    try:
        yield
    finally:
        cv2.setNumThreads(before)
