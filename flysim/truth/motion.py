"""Where every body stood at every stop: bodies that can be pushed are compared at their last place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array, frozen, inverse, transform
from flysim.truth.stop import Stop
from flysim.worlds.model import World

STILL = 1e-4  # [m, rad] a body that moved less is said not to have moved: physics engines jitter


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """Poses of `World.links` over a drive.

    Attributes:
        last: `[n, 4, 4]` T_world_link at the last stop; the world file's where no stop was reached.
        moved: `[n]` bool, the body stood elsewhere at some stop.
        T_world_links: by stop index, `[n, 4, 4]`.
    """

    last: Array
    moved: NDArray[np.bool_]
    T_world_links: dict[int, Array]

    @classmethod
    def of(cls, world: World, stops: Sequence[Stop]) -> Motion:
        """The motion of the bodies of `world` over `stops`."""
        poses = {stop.index: np.asarray(stop.T_world_links, float).reshape(-1, 4, 4) for stop in stops}
        filed = np.array([link.T_world_link for link in world.links]).reshape(-1, 4, 4)
        last = poses[stops[-1].index] if stops else filed
        moved = np.zeros(len(world.links), dtype=bool)
        for T in poses.values():
            moved |= np.abs(T - last).max(axis=(1, 2), initial=0.0) > STILL
        return cls(last=frozen(last), moved=frozen(moved), T_world_links=poses)

    def carry(self, link: int, stop: int, points: Array) -> Array:
        """`[N, 3]` points fixed to `link` at `stop` [m, world], moved to where the link is last."""
        T = self.T_world_links.get(stop)
        if T is None or not self.moved[link]:
            return points
        return transform(self.last[link] @ inverse(T[link]), points)

    def carry_all(self, link: int, stops: NDArray[np.int32], points: Array) -> Array:
        """The same for points that belong to different stops, `[N]` their indices."""
        if not self.moved[link]:
            return points
        carried = points.copy()
        for stop in np.unique(stops).tolist():
            carried[stops == stop] = self.carry(link, stop, points[stops == stop])
        return carried
