"""A disparity map's valid pixels, on a regular grid, as points on surfaces: whoever made the map.

Of the parameters it reads `min_depth`, `max_depth`, and how many flies selection may preserve: the grid is as wide as
leaves that many points. With all pixels the clusterer, whose thresholds count points, would cross gaps on stray ones.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flysim.engines.planes import local_planes
from flysim.errors import EngineError
from flysim.flies.parameters import FlyParams
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.swarm import Swarm
from flysim.stereo.plane import normals

DISPARITY_STD = 0.2  # [px] standard deviation that a match of unknown make is taken to have; SGBM's is 0.25, BM's 0.15


def grid_step(valid: int, points: int) -> int:
    """Side of square cells [px] of which so many valid pixels fill at least so many."""
    return max(1, math.floor(math.sqrt(valid / points)))


def check_disparities(rig: StereoRig, name: str) -> None:
    """Refuses a rig whose matches are no disparities along the rows.

    Raises:
        EngineError: it is not rectified, or its right camera stands on the left.
    """
    if not rig.rectified or rig.T_right_left[0, 3] >= 0.0:
        raise EngineError(
            f"engine {name} gives disparities, which need a rectified pair with the right camera on the right. "
            "Rectify it first."
        )


def disparity_swarm(
    pair: ImagePair,
    params: FlyParams,
    disparity: NDArray[np.float32],
    *,
    std_px: float = DISPARITY_STD,
    name: str,
) -> Swarm:
    """The points that a disparity map stands for.

    Args:
        pair: that it is of, a rectified one.
        params: depths that are asked for, and how many points.
        disparity: `[H, W]` u_left - u_right of each left pixel [px]; NaN where there is none.
        std_px: standard deviation of a right match [px].
        name: of who made it.
    """
    rig = pair.rig
    disparity = np.array(disparity, np.float32)
    gain, offset = rig.left.fx * rig.baseline, rig.left.cx - rig.right.cx
    # What lies nearer or farther than asked is not asked of anybody.
    with np.errstate(invalid="ignore"):
        searched = (disparity - offset >= gain / params.max_depth) & (disparity - offset <= gain / params.min_depth)
    disparity[~searched] = np.nan
    step = grid_step(np.isfinite(disparity).sum(), max(round(params.population * params.shares[0]), 1))
    v, u = (at.ravel() for at in np.mgrid[step // 2 : rig.left.height : step, step // 2 : rig.left.width : step])
    valid = np.isfinite(disparity[v, u])
    pixels = np.stack([u[valid], v[valid]], axis=1)
    slopes, support = local_planes(disparity, pixels)
    there = disparity[pixels[:, 1], pixels[:, 0]].astype(np.float64)
    genes = np.column_stack([there - offset, slopes]) / gain
    order = np.argsort(-support, kind="stable")
    pixels, genes, support, there = pixels[order], genes[order], support[order], there[order]
    points = rig.left.unproject(pixels, 1.0 / genes[:, 0])
    n = len(pixels)
    return Swarm(
        points=points.astype(np.float32),
        fitness=support.astype(np.float32),
        uv=pixels.astype(np.float32),
        normals=normals(rig.left, pixels, genes),
        spread=(points * (std_px / (gain * genes[:, :1]))).astype(np.float32),
        uv_right=np.stack([pixels[:, 0] - there, pixels[:, 1]], axis=1).astype(np.float32),
        region=np.zeros(n, np.int32),
        age=np.zeros(n, np.int32),
        history=(),
        converged=True,
        reason=f"{name} gave a disparity at {n} of {len(u)} pixels, {step} px apart",
    )
