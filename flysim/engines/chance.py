"""Flies that nobody selected: the floor of the scale. What scores no better than these has seen nothing.

As many as the flies could preserve, drawn as their immigrants are: a pixel, an inverse depth and a slant at random.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flysim.flies.parameters import FlyParams
from flysim.geometry.rig import ImagePair
from flysim.products.swarm import Swarm
from flysim.stereo.plane import normals
from flysim.stereo.told import speeds

DISPARITY_STD = 0.1  # [px] as the flies': they claim as much and know nothing
TRIES = 16  # draws before a fly out of the right view is given up; a rig's views overlap at most depths


def chance(pair: ImagePair, params: FlyParams, *, rng: np.random.Generator) -> Swarm:
    """Random flies in the space that both cameras see."""
    rig, half = pair.rig, params.window // 2
    left = rig.left
    n = max(round(params.population * params.shares[0]), 1)
    pixels, genes = np.empty((0, 2), np.int64), np.empty((0, 3))
    gain = left.fx * rig.baseline
    for _ in range(TRIES):
        u = rng.integers(half + 1, left.width - half - 1, n)
        v = rng.integers(half + 1, left.height - half - 1, n)
        q = rng.uniform(1.0 / params.max_depth, 1.0 / params.min_depth, n)  # uniform in disparity
        uv = np.stack([u, v], axis=1)
        seen = rig.right.contains(rig.project(left.unproject(uv, 1.0 / q))[1], margin=half)
        pixels = np.concatenate([pixels, uv[seen]])
        genes = np.concatenate([genes, np.column_stack([q, _slopes(params.slant / gain, rng, n)])[seen]])
        if len(pixels) >= n:
            break
    pixels, genes = pixels[:n], genes[:n]
    points = left.unproject(pixels, 1.0 / genes[:, 0])
    return Swarm(
        points=points.astype(np.float32),
        fitness=np.zeros(len(pixels), np.float32),
        uv=pixels.astype(np.float32),
        normals=normals(left, pixels, genes),
        spread=(points * (DISPARITY_STD / (speeds(rig, pixels, genes[:, 0])[:, None] * genes[:, :1]))).astype(
            np.float32
        ),
        uv_right=rig.project(points)[1].astype(np.float32),
        region=np.zeros(len(pixels), np.int32),
        age=np.zeros(len(pixels), np.int32),
        history=(),
        converged=True,
        reason=f"{len(pixels)} flies at random places: none was selected",
        evaluations=len(pixels),
    )


def _slopes(steepest: float, rng: np.random.Generator, n: int) -> NDArray[np.float64]:
    """`[n, 2]` slopes of inverse depth: a third faces the camera, a third leans sideways, a third back or forth."""
    axis = rng.integers(0, 3, n)
    slope = rng.uniform(-steepest, steepest, n)
    return np.stack([np.where(axis == 1, slope, 0.0), np.where(axis == 2, slope, 0.0)], axis=1)
