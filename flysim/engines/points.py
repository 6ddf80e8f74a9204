"""Points without normals, such as another program gives, as a swarm: thinned like a disparity map, a plane at each."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import KDTree

from flysim.engines.disparity import DISPARITY_STD, grid_step
from flysim.flies.parameters import FlyParams
from flysim.geometry.rig import ImagePair
from flysim.products.swarm import Swarm

NEIGHBOURS = 12  # that a point's plane goes through


def points_swarm(pair: ImagePair, params: FlyParams, points: ArrayLike, *, name: str) -> Swarm:
    """The points that both cameras can see in the range of depths that is asked for, one a cell of the image.

    Args:
        pair: in which they were seen.
        params: depths that are asked for, and how many points; see `disparity.grid_step`.
        points: `[N, 3]` [m], left optical frame.
        name: of who gave them.
    """
    places, rig = np.asarray(points, np.float64).reshape(-1, 3), pair.rig
    given = len(places)
    places = places[(places[:, 2] >= params.min_depth) & (places[:, 2] <= params.max_depth)]
    uv, uv_right = rig.project(places)
    seen = rig.left.contains(uv) & rig.right.contains(uv_right)
    places, uv, uv_right = places[seen], uv[seen], uv_right[seen]
    step = grid_step(len(places), max(round(params.population * params.shares[0]), 1))
    cells = np.floor(uv / step).astype(np.int64) @ (1, rig.left.width)
    one = np.sort(np.unique(cells, return_index=True)[1])
    toward = _normals(places, one)
    places, uv, uv_right = places[one], uv[one], uv_right[one]
    n = len(places)
    gain = rig.left.fx * rig.baseline
    return Swarm(
        points=places.astype(np.float32),
        fitness=np.ones(n, np.float32),
        uv=uv.astype(np.float32),
        normals=toward.astype(np.float32),
        spread=(places * (DISPARITY_STD * places[:, 2:] / gain)).astype(np.float32),
        uv_right=uv_right.astype(np.float32),
        region=np.zeros(n, np.int32),
        age=np.zeros(n, np.int32),
        history=(),
        converged=True,
        reason=f"{name} gave {given} points, {len(seen)} of them in range; one a cell of {step} px stays",
    )


def _normals(places: np.ndarray, of: np.ndarray) -> np.ndarray:
    """`[n, 3]` unit normals of the planes through each point of `of` and its neighbours, towards the camera."""
    if not len(of):
        return np.empty((0, 3))
    _, near = KDTree(places).query(places[of], k=min(NEIGHBOURS, len(places)), workers=1)
    around = places[near.reshape(len(of), -1)]
    around = around - around.mean(axis=1, keepdims=True)
    found = np.linalg.svd(around, full_matrices=True)[2][:, 2] if around.shape[1] >= 3 else -places[of]
    found = found / np.linalg.norm(found, axis=1, keepdims=True)
    return np.where((found * places[of]).sum(axis=1, keepdims=True) > 0.0, -found, found)
