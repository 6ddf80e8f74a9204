"""The flies of all stops in one frame."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flysim.geometry.frames import Array


class SeenAgain(NamedTuple):
    """Where upright surfaces under flies end upwards, as other stops than the flies' own saw it.

    Attributes:
        fly: `[M]` int64 the fly's place in the cloud.
        stop: `[M]` int32 index of the stop that saw its surface again.
        end: `[M, 3]` [m] how far up the surface was seen to go on, world frame.
        step: `[M, 3]` [m] from there one pixel further up.
        ended: `[M]` bool, whether it ends there, rather than leaving the view.
    """

    fly: NDArray[np.int64]
    stop: NDArray[np.int32]
    end: Array
    step: Array
    ended: NDArray[np.bool_]

    @classmethod
    def nothing(cls) -> SeenAgain:
        """No fly's."""
        none = np.empty((0, 3))
        return cls(np.empty(0, np.int64), np.empty(0, np.int32), none, none, np.empty(0, np.bool_))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FlyCloud:
    """Flies that settled on a surface, gathered over the stops of a path.

    Attributes:
        points: `[N, 3]` [m], in the world frame as far as odometry knows it.
        normals: `[N, 3]` unit normals of the surface under each fly, towards the camera that saw it.
        spread: `[N, 3]` one standard deviation of each position along its line of sight [m].
        arms: `[N, 4, 3]` [m] how far the surface under a fly goes on to the right, left, down and up in its image; of
            flies that were not asked, on the floor, their own place.
        steps: `[N, 4, 3]` [m] from there one pixel further.
        ended: `[N, 4]` whether the surface ends there, rather than going on beyond the longest arm.
        fitness: `[N]` float32.
        stop: `[N]` int32 index of the stop that saw the fly.
        uv: `[N, 2]` pixel in that stop's left image.
        uv_right: `[N, 2]` pixel in that stop's right image.
        rgb: `[N, 3]` uint8 colour of the left pixel.
        again: how far up the surfaces of some flies go on, as other stops saw it.
    """

    points: Array
    normals: Array
    spread: Array
    arms: Array
    steps: Array
    ended: NDArray[np.bool_]
    fitness: NDArray[np.float32]
    stop: NDArray[np.int32]
    uv: NDArray[np.float32]
    uv_right: NDArray[np.float32]
    rgb: NDArray[np.uint8]
    again: SeenAgain = field(default_factory=SeenAgain.nothing)
