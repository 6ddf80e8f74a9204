"""The flies as an engine: a swarm evolved on each frame, which may begin with flies of the frame before."""

from __future__ import annotations

import numpy as np

from flysim.engines.standing import standing
from flysim.flies.carry import carried
from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.geometry.frames import Array, inverse, transform
from flysim.geometry.rig import StereoRig
from flysim.products.frame import Frame
from flysim.products.swarm import Swarm


class Flies:
    """The fly algorithm, frame by frame.

    With `FlyParams.carry_below` above 0 flies outlive the picture (Louchet's dynamic flies): those that sit on what
    stands are carried along by the believed motion of the camera, and the next frame's first generation breeds from
    them. With 0 each frame is seen for itself.
    """

    def begin(self, rig: StereoRig, params: FlyParams) -> None:
        """A new sequence: no flies."""
        self._params = params
        self._last: tuple[Array, Array, Array] | None = None  # points, normals, and the T_world_left they belong to

    def see(self, frame: Frame, *, rng: np.random.Generator) -> Swarm:
        """The flies that settled in a frame, fittest first."""
        T_world_left, before = frame.T_world_left, None
        if self._last is not None:
            points, normals, T_world_before = self._last
            before = carried(points, normals, frame.pair.rig.left, inverse(T_world_left) @ T_world_before)
        swarm = evolve(frame.pair, self._params, rng=rng, carried=before)
        if self._params.carry_below > 0.0:
            points, normals = swarm.points.astype(np.float64), swarm.normals.astype(np.float64)
            stands = standing(transform(frame.T_base_left, points), self._params.carry_below)
            self._last = points[stands], normals[stands], T_world_left
        return swarm
