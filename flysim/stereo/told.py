"""How well a pair tells depth at a pixel: how far things move between its pictures, near the epipole hardly at all.

Side by side, a pixel moves by the focal length times the baseline for each 1/m of inverse depth, wherever it is. Where
a camera moved ahead the epipole lies in the image, and about it nothing moves; where it turned, one side moves faster.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.compute.compiled import by_rows
from flysim.geometry.rig import StereoRig
from flysim.stereo.windows import parallax

# Share of the speed of a pair side by side with which things move; where they are slower, a fly's fitness is lowered.
# Where a camera moved ahead that is the angle to the epipole: 0.25 are 14 degrees.
SLOW = 0.25
COARSEST = 4.0  # times the steps of a pair side by side that steps in inverse depth may have near the epipole


def _trust_by_rows(views, w):
    return 1.0


def _trust_of_any(views, w):
    du, dv, slow = views.s0 - w.u * views.s2, views.s1 - w.v * views.s2, SLOW * views.gain
    moves, least = du * du + dv * dv, slow * slow
    return moves / least if moves < least else 1.0


# What of a fly's fitness counts, in [0, 1], by its warp: eq. (1) is 1 / e^2 of a misplacement by e px, and what that is
# in inverse depth goes with the parallax.
trust = by_rows(_trust_by_rows, _trust_of_any)


def _coarser_by_rows(views, u, v, q):
    return 1.0


def _coarser_of_any(views, u, v, q):
    here = parallax(views, u, v, q)[2]
    coarser = views.gain / here if here > 0.0 else COARSEST
    return min(coarser, COARSEST)


# Times a step in inverse depth of a pair side by side is worth as many pixels here.
coarser = by_rows(_coarser_by_rows, _coarser_of_any)


def speeds(rig: StereoRig, pixels: NDArray, q: NDArray[np.floating]) -> NDArray[np.float64]:
    """`[N]` how fast the right projections of left pixels move with inverse depth [px m], as `windows.parallax`.

    Args:
        rig: of the pair.
        pixels: `[N, 2]` u, v [px].
        q: `[N]` inverse depth there [1/m].
    """
    if rig.rectified:
        return np.full(len(pixels), rig.left.fx * rig.baseline)
    ahead = rig.right.K @ rig.T_right_left[:3, 3]
    rays = np.column_stack([pixels, np.ones(len(pixels))]) @ np.linalg.inv(rig.left.K).T
    x, y, z = (rays @ (rig.right.K @ rig.T_right_left[:3, :3]).T + np.asarray(q)[:, None] * ahead).T
    return np.hypot((ahead[0] - x / z * ahead[2]) / z, (ahead[1] - y / z * ahead[2]) / z)
