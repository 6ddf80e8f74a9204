"""Where frames were taken, as something better than odometry tells: a noun, handed on by whoever found it."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from flysim.geometry.frames import Array, Pose2, frozen, yaw_of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Located:
    """Poses of base_link on the floor, one a frame or glance, world frame; the first one is odometry's.

    Attributes:
        by: who found them, such as "flies".
        times: `[n]` [s] when they were taken, increasing.
        stops: places of those that are no glances, in order.
        numbers: of those, the index of each in its path, counted from 0.
        odometry: `[n, 3]` x, y [m], yaw [rad], as the frames had them.
        poses: `[n, 3]` as they were found.
        covariance: `[n, 3, 3]` of x, y, yaw; 0 for the first one, which the others are held against.
        hops: pairs of frames in which the same things were seen again.
        loops: those of them that are not of two frames in a row.
        lost: stops, counted from 0, on the way to which the place was lost: no chain of hops leads there from the
            first frame or a stop before, and odometry is all that is known of that way.
        seconds: wall-clock time that it took.
    """

    by: str
    times: Array
    stops: tuple[int, ...]
    numbers: tuple[int, ...]
    odometry: Array
    poses: Array
    covariance: Array
    hops: int
    loops: int
    lost: tuple[int, ...]
    seconds: float

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z][a-z0-9_-]{0,31}", self.by):
            raise ValueError(f"by must be a short name of letters, digits, - and _, as files bear it, got {self.by!r}")
        n = len(self.odometry)
        for name, shape in (("times", (n,)), ("odometry", (n, 3)), ("poses", (n, 3)), ("covariance", (n, 3, 3))):
            array = frozen(getattr(self, name), np.float64)
            if array.shape != shape or not np.isfinite(array).all():
                raise ValueError(f"{name} must be finite and {list(shape)}, got {list(array.shape)}")
            object.__setattr__(self, name, array)

    def moved(self, k: int, T_world_base: Array) -> Array:
        """`[4, 4]` a pose by odometry about frame `k`, put where that frame was found to be."""
        return _planar(self.poses[k]) @ np.linalg.inv(_planar(self.odometry[k])) @ T_world_base

    def way(self, times: Array, odometry: Array) -> Array:
        """`[m, 3]` the way by odometry, bent so that it goes through where the frames were found to be.

        What odometry missed between two frames is spread evenly over the way, and over turns on the spot.

        Args:
            times: `[m]` [s], increasing.
            odometry: `[m, 3]` x, y [m], yaw [rad] at those times.
        """
        way, at = np.array(odometry, np.float64), np.round(self.times, 6)  # as those of a recorded way are
        if not len(way) or not len(self.poses):
            return way
        after = np.clip(np.searchsorted(at, times, side="left"), 0, len(at) - 1)
        step = np.hypot(*np.diff(way[:, :2], axis=0).T) + 0.2 * np.abs(_wrapped(np.diff(way[:, 2])))
        gone = np.concatenate([[0.0], np.cumsum(step)])
        here = np.interp(at, times, gone)
        for k in range(len(at)):
            part = np.flatnonzero(after == k)
            before = max(k - 1, 0)
            # By odometry seen from the frame before, and how much of the error that shows at frame k has come by then.
            share = np.clip((gone[part] - here[before]) / max(here[k] - here[before], 1e-9), 0.0, 1.0)
            share = np.where(times[part] >= at[k], 1.0, share)
            way[part] = self._bent(before, k, way[part], share)
        return way

    def _bent(self, before: int, k: int, poses: Array, share: Array) -> Array:
        first, last = (self._at(i, poses) for i in (before, k))
        bent = first + share[:, None] * (last - first)
        bent[:, 2] = first[:, 2] + share * _wrapped(last[:, 2] - first[:, 2])
        return bent

    def _at(self, k: int, poses: Array) -> Array:
        """`[m, 3]` poses by odometry, put as frame `k` was."""
        T = _planar(self.poses[k]) @ np.linalg.inv(_planar(self.odometry[k]))
        xy = poses[:, :2] @ T[:2, :2].T + T[:2, 3]
        return np.column_stack([xy, _wrapped(poses[:, 2] + yaw_of(T))])


def _planar(pose: Array) -> Array:
    return Pose2(*np.asarray(pose).tolist()).matrix


def _wrapped(angles: Array) -> Array:
    return (angles + np.pi) % (2.0 * np.pi) - np.pi
