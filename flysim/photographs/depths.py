"""The depths of a pair that are worth a search: as its calibration tells, or as what both pictures show tells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flysim.geometry.rig import StereoRig
from flysim.photographs.matches import LEAST, Matches

NEAREST, WIDEST = 0.35, 0.6  # [widths] disparities where nothing tells, and at most
SURE = 0.02  # of the matches at either end may be false
# Of the range, and pixels at least, that are searched beyond the farthest and the nearest match: what is near is large,
# and has few corners.
ROOM, NEAR_ROOM, ROOM_PX = 0.25, 0.5, 4.0
FARTHEST_PX = 0.5  # [px] of disparity: farther off depth means nothing
MOST_DEPTH = 1e4  # [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Depths:
    """What is searched.

    Attributes:
        nearest, farthest: [m] along the left optical axis.
        disparities: [px] the same, least and largest.
        told_by: "calibration", "pictures", or "nothing".
    """

    nearest: float
    farthest: float
    disparities: tuple[float, float]
    told_by: str


def depths(
    rig: StereoRig,
    width: int,
    told: tuple[float, float] | None,
    seen: Matches,
    given: tuple[float, float] | None = None,
) -> Depths:
    """The range of depths to search.

    Args:
        rig: of the pair.
        width: of its left picture [px].
        told: least and largest disparity of the calibration [px], or None.
        seen: what both pictures show.
        given: nearest and farthest depth that the user asks for [m], or None.
    """
    offset, gain = rig.left.cx - rig.right.cx, rig.left.fx * rig.baseline
    by = "calibration"
    if given is not None:
        low, high, by = gain / given[1] + offset, gain / given[0] + offset, "you"
    elif told is not None:
        low, high = told
    else:
        low, high, by = _of_matches(width, seen)
    # As depths: of infinity and what lies behind it there is nothing to be seen.
    near = gain / max(high - offset, FARTHEST_PX)
    far = min(gain / max(low - offset, FARTHEST_PX), MOST_DEPTH)
    if not near < far:
        far = near * 2.0
    near = max(near, 1e-3)
    near, far = float(near), float(far)
    return Depths(nearest=near, farthest=far, disparities=(gain / far + offset, gain / near + offset), told_by=by)


def _of_matches(width: int, seen: Matches) -> tuple[float, float, str]:
    good = seen.agreeing().disparity
    if len(good) < LEAST:
        return 0.0, NEAREST * width, "nothing"
    low, high = np.quantile(good, (SURE, 1.0 - SURE))
    below, above = (max(room * (high - low), ROOM_PX) for room in (ROOM, NEAR_ROOM))
    return float(low - below), float(min(high + above, WIDEST * width)), "pictures"
