"""What is wrong with a pair, in words: before flies evolve on it, and by what they made of it."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.photographs.depths import Depths
from flysim.photographs.level import Photograph
from flysim.photographs.matches import LEAST, Matches
from flysim.products.swarm import Swarm

BLACK = 2.0  # [grey levels] deviation of a picture that shows nothing
SAME = 0.5  # [grey levels] mean difference of two pictures that are one
SWAPPED = 0.8  # share of the matches that lie on the wrong side
ROWS_PX, TOLD_PX = 4.0, 0.3  # rows that lie further apart were never rectified; nearer than this nobody need know
EXPOSED, LEVELS = 1.15, 6.0  # times, and grey levels, by which one eye is brighter than the other
# Curvature over slope at the strongest edges of a picture that is nowhere sharp: of four photographs and two of a
# chessboard it is 0.48 to 0.73, blurred by 2 px 0.30 to 0.38, by 3 px 0.21 to 0.28.
SOFT, STRONG = 0.27, 0.995
PLAIN = 0.5  # share of a picture in which nothing changes along the rows
CUT, AT_END = 0.05, 0.02  # share of matches beyond the range; of the flies at an end of it
FEW = 100  # flies


def refuse_unfit(photograph: Photograph, seen: Matches) -> None:
    """Refuses a pair that nobody can make depth of.

    Raises:
        FlysimError: it is black, the same picture twice, swapped, or was never rectified.
    """
    name, pair = photograph.name, photograph.pair
    for side, image in (("left", pair.left), ("right", pair.right)):
        if float(image[::4, ::4].std()) < BLACK:
            raise FlysimError(f"{name}: the {side} picture is of one colour: was the lens covered, or the file empty?")
    if pair.left.shape == pair.right.shape:
        apart = np.abs(pair.left[::4, ::4].astype(np.int16) - pair.right[::4, ::4])
        if float(apart.mean()) < SAME:
            raise FlysimError(f"{name}: both pictures are the same: give the left and the right one.")
    good = seen.agreeing()
    if not pair.rig.rectified or len(good) < LEAST:
        return
    # Of principal points that differ the farthest things lie beyond 0.
    offset = pair.rig.left.cx - pair.rig.right.cx
    wrong = float((good.disparity < offset - 1.0).mean())
    if wrong > SWAPPED:
        raise FlysimError(
            f"{name}: left and right are swapped: {100.0 * wrong:.0f} % of what both show lies further right in the "
            "right picture. Swap them."
        )
    lower = float(np.median(np.abs(good.lower)))
    if lower > ROWS_PX:
        raise FlysimError(
            f"{name}: its rows are {lower:.1f} px apart: it is not rectified. Give a calibration of its lenses, or "
            "rectify it."
        )


def remarks(photograph: Photograph, depths: Depths, seen: Matches, swarm: Swarm) -> tuple[str, ...]:
    """What a user should know of a pair, one sentence each, by what flies made of it.

    Args:
        photograph: the pair.
        depths: that were searched.
        seen: what both pictures show.
        swarm: of the pair; where it is not the flies' own, less is told.
    """
    pair, told = photograph.pair, list(photograph.notes)
    if not photograph.metric:
        told.append("no calibration: disparities are in pixels, and nothing is in metres")
    if swarm.rows_px is not None and abs(swarm.rows_px) > TOLD_PX:
        side = "lower" if swarm.rows_px > 0.0 else "higher"
        told.append(f"the right picture lies {abs(swarm.rows_px):.1f} px {side} than its calibration says; mended")
    if swarm.roll_deg is not None and abs(swarm.roll_deg) > 0.05:
        told.append(f"the right picture is turned by {swarm.roll_deg:+.2f} degrees; mended")
    told += _exposure(pair.left, pair.right, swarm)
    softer = max(swarm.softened_right_px), max(swarm.softened_left_px)
    if max(softer) > 0.0:
        which = "left" if softer[0] > softer[1] else "right"
        told.append(f"the {which} eye is out of focus by {max(softer):.1f} px more than the other; mended")
    told += [f"the {side} picture is nowhere sharp" for side, image in (("left", pair.left), ("right", pair.right))
             if _soft(image)]  # fmt: skip
    if swarm.plain is not None and swarm.plain > PLAIN:
        told.append(f"{100.0 * swarm.plain:.0f} % of the left picture shows no texture: nothing can be seen there")
    if len(swarm.points) < FEW:
        told.append(f"only {len(swarm.points)} flies settled: {swarm.reason}")
    return (*told, *_cut_off(depths, seen, swarm))


def _exposure(left: NDArray[np.uint8], right: NDArray[np.uint8], swarm: Swarm) -> list[str]:
    if len(swarm.uv) < LEAST:
        return []
    levels = []
    for image, uv in ((left, swarm.uv), (right, swarm.uv_right)):
        u, v = np.rint(uv).astype(int).T
        u, v = np.clip(u, 0, image.shape[1] - 1), np.clip(v, 0, image.shape[0] - 1)
        levels.append(image[v, u].mean(axis=1))
    one, other = (float(np.median(level)) for level in levels)
    if abs(one - other) < LEVELS or max(one, other) < EXPOSED * max(min(one, other), 1.0):
        return []
    darker = "right" if other < one else "left"
    return [f"the {darker} eye is darker: {min(one, other):.0f} grey levels where the other has {max(one, other):.0f}"]


def _soft(image: NDArray[np.uint8]) -> bool:
    """Whether even the strongest edges of a picture are wide; looked at a little smoothed, so that noise is no edge."""
    grey = cv2.GaussianBlur(image[::2, :, 1].astype(np.float32), (0, 0), 1.0)
    slope, bend = (np.quantile(np.abs(np.diff(grey, n=n, axis=1)), STRONG) for n in (1, 2))
    return bool(slope > 1.0 and bend < SOFT * slope)


def _cut_off(depths: Depths, seen: Matches, swarm: Swarm) -> list[str]:
    """Whether the range that was searched ends before what is there does."""
    low, high = depths.disparities
    good, told = seen.agreeing().disparity, []
    flies = swarm.uv[:, 0] - swarm.uv_right[:, 0] if len(swarm.uv) else np.empty(0)
    room = max(0.01 * (high - low), 0.5)
    for end, beyond, there in (
        ("near", good > high + 1.0, flies > high - room),
        ("far", good < low - 1.0, flies < low + room),
    ):
        share = float(beyond.mean()) if len(good) >= LEAST else 0.0
        if share > CUT or (len(there) >= FEW and there.mean() > AT_END):
            told.append(
                f"the range of {low:.0f} to {high:.0f} px may cut off what is {end}: "
                f"{100.0 * max(share, float(there.mean()) if len(there) else 0.0):.0f} % lies at or beyond its end"
            )
    return told
