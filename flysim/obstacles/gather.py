"""The flies of every stop brought into one frame, as far as odometry knows it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flysim.flies.swarm import Swarm
from flysim.geometry.frames import Array, transform
from flysim.geometry.rig import ImagePair
from flysim.obstacles.cloud import FlyCloud


def gather(swarms: Sequence[tuple[int, Swarm, ImagePair, Array]]) -> FlyCloud:
    """One cloud from (stop index, swarm, pair, T_world_left) of each stop."""
    parts = [
        (
            transform(T_world_left, swarm.points),
            transform(T_world_left, swarm.patches),
            swarm.fitness,
            np.full(len(swarm.points), index, np.int32),
            swarm.uv,
            swarm.uv_right,
            pair.left[swarm.uv[:, 1].astype(int), swarm.uv[:, 0].astype(int)],
        )
        for index, swarm, pair, T_world_left in swarms
    ]
    empty = (
        np.empty((0, 3)),
        np.empty((0, 4, 3)),
        np.empty(0, np.float32),
        np.empty(0, np.int32),
        np.empty((0, 2), np.float32),
        np.empty((0, 2), np.float32),
        np.empty((0, 3), np.uint8),
    )
    points, patches, fitness, stop, uv, uv_right, rgb = (
        np.concatenate(column) for column in zip(empty, *parts, strict=True)
    )
    return FlyCloud(points=points, patches=patches, fitness=fitness, stop=stop, uv=uv, uv_right=uv_right, rgb=rgb)
