"""Which flies of one stop have landed: on the object, on anything that both cameras saw, or nowhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flysim.evaluate.surface import VisibleSurface, distances_to, visible_surface
from flysim.geometry.frames import transform
from flysim.truth.motion import Motion
from flysim.truth.sight import sights
from flysim.truth.stop import Stop
from flysim.worlds.model import World

LANDED = 0.02  # [m] from the visible surface: a fly nearer than this sits on it


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Landing:
    """What was there to land on at a stop.

    Attributes:
        world: whose bodies they are.
        stop: from where they were seen.
        motion: where they stood.
        seen: samples of all that both cameras saw.
        objects: the same samples, those of bodies that are no structure: neither floor nor wall.
    """

    world: World
    stop: Stop
    motion: Motion
    seen: VisibleSurface
    objects: VisibleSurface

    @classmethod
    def of(cls, world: World, stop: Stop, max_range: float) -> Landing:
        """The ground at `stop`, as far as `max_range` [m] along the left optical axis."""
        motion = Motion.of(world, [stop])
        seen = visible_surface(sights([stop], max_range), motion)
        starts = {link: rows for link, rows in seen.starts.items() if not world.links[link].structure}
        return cls(world=world, stop=stop, motion=motion, seen=seen, objects=replace(seen, starts=starts))

    def on_object(self, points: ArrayLike) -> NDArray[np.bool_]:
        """`[N]` whether each fly sits within 2 cm of an object's visible surface.

        A fly on the floor less than that from the object's foot counts.

        Args:
            points: `[N, 3]` flies [m], left optical frame.
        """
        return self._landed(points, self.objects)

    def on_anything(self, points: ArrayLike) -> NDArray[np.bool_]:
        """`[N]` the same for whatever both cameras saw, floor and walls included."""
        return self._landed(points, self.seen)

    def _landed(self, points: ArrayLike, surface: VisibleSurface) -> NDArray[np.bool_]:
        # From where the camera truly stood: odometry has no say in what an engine saw.
        placed = transform(self.stop.views[0].T_world_optical, np.asarray(points, np.float64).reshape(-1, 3))
        stops = np.full(len(placed), self.stop.index, np.int32)
        return distances_to(self.world, self.motion, surface, placed, stops) < LANDED
