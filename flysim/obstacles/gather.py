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
        {
            "points": transform(T_world_left, swarm.points),
            "normals": swarm.normals @ T_world_left[:3, :3].T,
            "spread": swarm.spread @ T_world_left[:3, :3].T,
            "patches": transform(T_world_left, swarm.patches),
            "fitness": swarm.fitness,
            "stop": np.full(len(swarm.points), index, np.int32),
            "uv": swarm.uv,
            "uv_right": swarm.uv_right,
            "rgb": pair.left[swarm.uv[:, 1].astype(int), swarm.uv[:, 0].astype(int)],
        }
        for index, swarm, pair, T_world_left in swarms
    ]
    if not parts:
        return _empty()
    return FlyCloud(**{name: np.concatenate([part[name] for part in parts]) for name in parts[0]})


def _empty() -> FlyCloud:
    return FlyCloud(
        points=np.empty((0, 3)),
        normals=np.empty((0, 3)),
        spread=np.empty((0, 3)),
        patches=np.empty((0, 4, 3)),
        fitness=np.empty(0, np.float32),
        stop=np.empty(0, np.int32),
        uv=np.empty((0, 2), np.float32),
        uv_right=np.empty((0, 2), np.float32),
        rgb=np.empty((0, 3), np.uint8),
    )
