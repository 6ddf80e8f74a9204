"""The truth of a drive, made once: what stands, what was visible of it, and what moved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from flysim.geometry.plan_view import APART
from flysim.truth.motion import Motion
from flysim.truth.obstacles import TrueObstacle, true_obstacles
from flysim.truth.sight import Sight, sights
from flysim.truth.stop import Stop
from flysim.worlds.model import World


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Truth:
    """What findings are held against.

    Attributes:
        world: what stands there, as its file says.
        stops: what truly was at each stop, in order.
        max_range: [m] along the left optical axis; what is farther is not asked of anybody.
        motion: where every body stood at every stop.
        sights: which pixels both cameras saw at each stop, within range.
        obstacles: what is to be found, seen or not, at its last place.
        disturbed: what made the images and the rig of the frames other than they should be, by table ("sensors",
            "calibration", "light", "odometry") and name; empty where nothing did.
    """

    world: World
    stops: tuple[Stop, ...]
    max_range: float
    motion: Motion
    sights: tuple[Sight, ...]
    obstacles: tuple[TrueObstacle, ...]
    disturbed: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @property
    def framed(self) -> tuple[Stop, ...]:
        """The stops at which frames were taken, one a frame, in order."""
        return tuple(stop for stop in self.stops if stop.paired)

    @classmethod
    def of(
        cls,
        world: World,
        stops: Sequence[Stop],
        *,
        max_range: float,
        merge_gap: float = APART,
        disturbed: Mapping[str, Mapping[str, Any]] | None = None,
    ) -> Truth:
        """The truth of a drive through `world` with these stops.

        Args:
            world: what stands there.
            stops: what truly was at each of them.
            max_range: [m] along the left optical axis.
            merge_gap: bodies that touch or stand closer than this are one obstacle [m].
            disturbed: as the attribute; None: nothing.
        """
        seen, motion = sights(stops, max_range), Motion.of(world, stops)
        obstacles = true_obstacles(world, seen, motion, merge_gap=merge_gap)
        return cls(
            world=world,
            stops=tuple(stops),
            max_range=max_range,
            motion=motion,
            sights=seen,
            obstacles=obstacles,
            disturbed=disturbed or {},
        )
