"""The flies of every stop brought into one frame, as far as odometry knows it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from flysim.geometry.frames import transform
from flysim.geometry.rig import ImagePair
from flysim.obstacles.box import UP
from flysim.obstacles.parameters import ObstacleParams
from flysim.obstacles.reach import reach
from flysim.products.cloud import FlyCloud
from flysim.products.frame import Frame
from flysim.products.swarm import Swarm
from flysim.stereo.alignment import Misalignment
from flysim.stereo.sharpness import Softening


def gather(swarms: Sequence[tuple[Frame, Swarm]], params: ObstacleParams) -> FlyCloud:
    """One cloud of the swarm that was seen in each frame; flies on the floor get no arms."""
    floor = params.ground_clearance if params.silhouettes else np.inf
    parts = [_placed(frame, swarm, floor, climb=params.climb) for frame, swarm in swarms]
    if not parts:
        return _empty()
    joined: dict[str, Any] = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return FlyCloud(**joined)


def as_seen(pair: ImagePair, swarm: Swarm) -> ImagePair:
    """A pair with what its flies found to be wrong with it put right: rows that do not meet, an eye out of focus."""
    if swarm.rows_px or swarm.roll_deg:
        off = Misalignment(rows_px=swarm.rows_px or 0.0, roll_deg=swarm.roll_deg or 0.0)
        pair = replace(pair, rig=off.corrected(pair.rig))
    return Softening(left_px=swarm.softened_left_px, right_px=swarm.softened_right_px).pair(pair)


def _placed(frame: Frame, swarm: Swarm, floor: float, *, climb: bool) -> dict[str, Any]:
    pair, T_world_left = as_seen(frame.pair, swarm), frame.T_world_left
    points, R = transform(T_world_left, swarm.points), T_world_left[:3, :3]
    arms, steps = np.repeat(points[:, None], 4, axis=1), np.zeros((len(points), 4, 3))
    ended = np.zeros((len(points), 4), np.bool_)
    above = np.flatnonzero(points[:, 2] > floor)
    if len(above):
        ends, step, ended[above] = reach(pair, swarm, above, R.T @ UP if climb else None)
        arms[above], steps[above] = transform(T_world_left, ends.reshape(-1, 3)).reshape(-1, 4, 3), step @ R.T
    return {
        "points": points,
        "normals": swarm.normals @ R.T,
        "spread": swarm.spread @ R.T,
        "arms": arms,
        "steps": steps,
        "ended": ended,
        "fitness": swarm.fitness,
        "stop": np.full(len(points), frame.index, np.int32),
        "uv": swarm.uv,
        "uv_right": swarm.uv_right,
        "rgb": pair.left[swarm.uv[:, 1].astype(int), swarm.uv[:, 0].astype(int)],
    }


def _empty() -> FlyCloud:
    return FlyCloud(
        points=np.empty((0, 3)),
        normals=np.empty((0, 3)),
        spread=np.empty((0, 3)),
        arms=np.empty((0, 4, 3)),
        steps=np.empty((0, 4, 3)),
        ended=np.empty((0, 4), np.bool_),
        fitness=np.empty(0, np.float32),
        stop=np.empty(0, np.int32),
        uv=np.empty((0, 2), np.float32),
        uv_right=np.empty((0, 2), np.float32),
        rgb=np.empty((0, 3), np.uint8),
    )
