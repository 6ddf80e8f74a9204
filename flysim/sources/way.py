"""The way to a stop of a path: over the points before it, in the frame that the wheels count in."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

import numpy as np

from flysim.geometry.frames import Array, Pose2, transform, wrap_angle, yaw_of
from flysim.sim.driving import SMOOTH, DriveParams, Leg, drive_to
from flysim.sim.simulation import Simulation


class Halt(Protocol):
    """Where a path stops, and how to get there."""

    @property
    def pose(self) -> Pose2:
        """Where to stop [m, rad, world frame]."""
        ...

    @property
    def via(self) -> Sequence[tuple[float, float]]:
        """Points x, y [m] that are driven through on the way there."""
        ...


def drive(
    simulation: Simulation,
    halt: Halt,
    params: DriveParams = SMOOTH,
    T_odometry_world: Array | None = None,
    *,
    near: float = 0.0,
    watch: Callable[[], None] | None = None,
) -> Leg:
    """Drives to a stop over the points on the way; their tracks are one.

    Args:
        simulation: whose robot.
        halt: the stop, in the world.
        params: how it drives.
        T_odometry_world: `[4, 4]` where the wheels' frame has the world by now; None: the two are one.
        near: a robot that stands so near the stop [m] only turns.
        watch: `drive_to`'s.
    """
    tracks, go = [], drive_to if watch is None else partial(drive_to, watch=watch)
    for point in halt.via:
        x, y = point if T_odometry_world is None else transform(T_odometry_world, (*point, 0.0))[:2].tolist()
        here = simulation.odometry.pose
        leg = go(simulation, Pose2(x, y, math.atan2(y - here.y, x - here.x)), params)
        tracks.append(leg.track)
        if leg.blocked is not None:
            return Leg(blocked=leg.blocked, track=np.concatenate(tracks))
    goal, here = _in_odometry(T_odometry_world, halt.pose), simulation.odometry.pose
    if here.distance(goal) < near:
        goal = Pose2(here.x, here.y, goal.yaw)
    leg = go(simulation, goal, params)
    return leg if not tracks else Leg(blocked=leg.blocked, track=np.concatenate([*tracks, leg.track]))


def _in_odometry(T_odometry_world: Array | None, pose: Pose2) -> Pose2:
    if T_odometry_world is None:
        return pose
    x, y, _ = transform(T_odometry_world, (pose.x, pose.y, 0.0)).tolist()
    return Pose2(x, y, wrap_angle(pose.yaw + yaw_of(T_odometry_world)))
