"""Whether the rows of both eyes meet: how far the right camera is shifted and rolled against what the rig says.

A stereo pair that is believed to be level is matched along its rows alone. Where rows lie apart by a pixel, or the
right camera is rolled by a tenth of a degree, half of the matches are wrong. Matches that were found all the same,
followed in both directions (Lucas and Kanade's tracker, Bouguet's pyramids), tell by how much.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import se3
from flysim.geometry.rig import StereoRig

MOST = 160  # matches that are followed; more tell no more
LEAST = 25  # without so many that agree nothing is said
WINDOW, LEVELS = 17, 2  # [px] of the tracker, and pyramid levels above the image itself
OUTLIER = 3.0  # deviations
WORTH_PX = 0.08  # [px] of misplacement in the image that is worth a correction


@dataclass(frozen=True, slots=True, kw_only=True)
class Misalignment:
    """How the right picture lies against where the rig says that it does.

    Attributes:
        rows_px: how much lower the right picture is, at its middle [px].
        roll_deg: how far it is turned about its middle, clockwise as it is seen [degrees].
        matches: by how many it is told.
    """

    rows_px: float = 0.0
    roll_deg: float = 0.0
    matches: int = 0

    def misplaced(self, width: int) -> float:
        """By how much it misplaces what a picture of that width [px] shows, half-way to its border [px]."""
        return abs(self.rows_px) + abs(math.radians(self.roll_deg)) * width / 4.0

    def after(self, first: Misalignment) -> Misalignment:
        """This one as it was measured on a picture from which `first` had been taken already."""
        return Misalignment(
            rows_px=self.rows_px + first.rows_px, roll_deg=self.roll_deg + first.roll_deg, matches=self.matches
        )

    def corrected(self, rig: StereoRig) -> StereoRig:
        """The rig that such pictures are of: its right camera is rolled, and its principal point lower."""
        right = replace(rig.right, cy=rig.right.cy + self.rows_px)
        angle = math.radians(self.roll_deg)
        roll = np.array([[math.cos(angle), -math.sin(angle), 0.0], [math.sin(angle), math.cos(angle), 0.0], [0, 0, 1]])
        return StereoRig(left=rig.left, right=right, T_right_left=se3(roll, (0.0, 0.0, 0.0)) @ rig.T_right_left)

    def levelled(self, image: NDArray[np.uint8], rig: StereoRig) -> NDArray[np.uint8]:
        """The right picture as it would be if the rig were true."""
        angle, camera = math.radians(self.roll_deg), rig.right
        c, s = math.cos(angle), math.sin(angle)
        back = np.array(
            [
                [c, -s, camera.cx - c * camera.cx + s * camera.cy],
                [s, c, camera.cy - s * camera.cx - c * camera.cy + self.rows_px],
            ]
        )
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        size = (camera.width, camera.height)
        return np.asarray(cv2.warpAffine(image, back, size, flags=flags, borderMode=cv2.BORDER_REPLICATE), np.uint8)


def misalignment(
    left: NDArray[np.uint8],
    right: NDArray[np.uint8],
    uv: NDArray[np.float32],
    uv_right: NDArray[np.float32],
    rig: StereoRig,
) -> Misalignment | None:
    """By how much rows do not meet, told by matches; None where too few agree.

    Args:
        left, right: `[H, W]` uint8 of a pair whose rig says that rows meet.
        uv, uv_right: `[N, 2]` where the matches are believed to be [px].
        rig: theirs.
    """
    if len(uv) < LEAST:
        return None
    every = max(len(uv) // MOST, 1)
    before = np.ascontiguousarray(uv[::every], np.float32)
    guess = np.ascontiguousarray(uv_right[::every], np.float32)
    there, seen = _followed(left, right, before, guess)
    again, back = _followed(right, left, there, before)
    sure = seen & back & (np.abs(again - before).max(axis=1) < 0.5)
    u, lower = there[sure, 0] - rig.right.cx, there[sure, 1] - before[sure, 1]
    if len(u) < LEAST:
        return None
    A, weights = np.stack([np.ones_like(u), u], axis=1).astype(np.float64), np.ones(len(u))
    fit, spread = np.zeros(2), 0.0
    for _ in range(10):
        fit = np.linalg.lstsq(A * weights[:, None], lower * weights, rcond=None)[0]
        error = np.abs(lower - A @ fit)
        spread = max(1.4826 * float(np.median(error)), 0.02)
        weights = np.maximum(1.0 - (error / (OUTLIER * spread)) ** 2, 0.0)  # Tukey's, its square root
    agree = int((weights > 0.0).sum())
    if agree < max(LEAST, len(u) // 3) or abs(fit[1]) > 0.2:
        return None
    return Misalignment(rows_px=float(fit[0]), roll_deg=math.degrees(math.asin(fit[1])), matches=agree)


def _followed(
    one: NDArray[np.uint8], other: NDArray[np.uint8], points: NDArray[np.float32], guess: NDArray[np.float32]
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    found, status, _ = cv2.calcOpticalFlowPyrLK(  # type: ignore[call-overload]
        one,
        other,
        points[:, None],
        guess[:, None].copy(),
        winSize=(WINDOW, WINDOW),
        maxLevel=LEVELS,
        criteria=(cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 20, 0.01),
        flags=cv2.OPTFLOW_USE_INITIAL_FLOW,
    )
    return np.asarray(found[:, 0], np.float32), np.asarray(status[:, 0] > 0)
