"""StereoSGBM and StereoBM as engines: the disparity map's valid pixels, on a regular grid, as points on surfaces."""

from __future__ import annotations

import numpy as np

from flysim.engines.dense import Method, dense, farthest
from flysim.engines.disparity import disparity_swarm
from flysim.flies.parameters import FlyParams
from flysim.flies.threads import lanes
from flysim.geometry.rig import ImagePair
from flysim.products.swarm import Swarm

# [m] as good as infinity. Of a range that ends at `max_depth` SGBM gives what lies beyond some place within: in `yard`,
# with walls behind 4 m, F1 falls from 1 to 0.55. Nobody who uses it would search so.
FAR = 1e4
# [px] standard deviation of a right match; measured on a render of `paper`.
DISPARITY_STD = {"sgbm": 0.25, "bm": 0.15}


def sgbm(pair: ImagePair, params: FlyParams, *, rng: np.random.Generator) -> Swarm:
    """Semi-global matching on the pair's grey images; takes nothing from `rng`.

    Raises:
        ValueError: the pair is not rectified.
    """
    del rng
    return _swarm(pair, params, "sgbm")


def bm(pair: ImagePair, params: FlyParams, *, rng: np.random.Generator) -> Swarm:
    """Block matching on the pair's grey images; takes nothing from `rng`.

    Raises:
        ValueError: the pair is not rectified.
    """
    del rng
    return _swarm(pair, params, "bm")


def _swarm(pair: ImagePair, params: FlyParams, method: Method) -> Swarm:
    disparity = dense(pair, method, min_depth=params.min_depth, max_depth=farthest(pair.rig, FAR), threads=lanes())
    return disparity_swarm(pair, params, disparity, std_px=DISPARITY_STD[method], name=method)
