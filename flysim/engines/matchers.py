"""StereoSGBM and StereoBM as engines: the disparity map's valid pixels, on a regular grid, as points on surfaces.

Of the parameters they read `min_depth`, `max_depth`, and how many flies selection may preserve: the grid is as wide as
leaves that many points. With all pixels the clusterer, whose thresholds count points, would cross gaps on stray ones.
"""

from __future__ import annotations

import math

import numpy as np

from flysim.engines.dense import Method, dense
from flysim.engines.planes import local_planes
from flysim.errors import EngineError
from flysim.flies.parameters import FlyParams
from flysim.flies.threads import lanes
from flysim.geometry.rig import ImagePair
from flysim.products.swarm import Swarm
from flysim.stereo.plane import normals

# [m] as good as infinity. Of a range that ends at `max_depth` SGBM gives what lies beyond some place within: in `yard`,
# with walls behind 4 m, F1 falls from 1 to 0.55. Nobody who uses it would search so.
FAR = 1e4
# [px] standard deviation of a right match; measured on a render of `paper`.
DISPARITY_STD = {"sgbm": 0.25, "bm": 0.15}


def sgbm(pair: ImagePair, params: FlyParams, *, rng: np.random.Generator) -> Swarm:
    """Semi-global matching on the pair's grey images; takes nothing from `rng`.

    Raises:
        EngineError: the rows of the pair do not meet.
    """
    del rng
    return _swarm(pair, params, "sgbm")


def bm(pair: ImagePair, params: FlyParams, *, rng: np.random.Generator) -> Swarm:
    """Block matching on the pair's grey images; takes nothing from `rng`.

    Raises:
        EngineError: the rows of the pair do not meet.
    """
    del rng
    return _swarm(pair, params, "bm")


def grid_step(valid: int, points: int) -> int:
    """Side of square cells [px] of which so many valid pixels fill at least so many."""
    return max(1, math.floor(math.sqrt(valid / points)))


def _swarm(pair: ImagePair, params: FlyParams, method: Method) -> Swarm:
    rig = pair.rig
    if not rig.rectified or rig.T_right_left[0, 3] >= 0.0:
        raise EngineError(
            f"engine '{method}' matches along rows, and those of this pair, as of any two stops, do not meet: "
            "take flies, or another one that does not need it."
        )
    disparity = dense(pair, method, min_depth=params.min_depth, max_depth=FAR, threads=lanes())
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
        spread=(points * (DISPARITY_STD[method] / (gain * genes[:, :1]))).astype(np.float32),
        uv_right=np.stack([pixels[:, 0] - there, pixels[:, 1]], axis=1).astype(np.float32),
        region=np.zeros(n, np.int32),
        age=np.zeros(n, np.int32),
        history=(),
        converged=True,
        reason=f"{method} gave a disparity at {n} of {len(u)} pixels, {step} px apart",
    )
