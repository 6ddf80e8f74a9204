"""What one frame brings to be found again in another: flies about the robot, and the picture with their windows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, transform
from flysim.products.frame import Frame
from flysim.products.swarm import Swarm

COARSE_PX = 320  # a picture is halved until it is at most so wide: there windows are looked for first


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Glimpse:
    """The flies of one frame and its left picture, grey.

    Attributes:
        camera: the left one.
        T_base_left: `[4, 4]` where it is mounted.
        points: `[n, 3]` flies [m, base_link].
        normals: `[n, 3]` of the surfaces under them, base_link.
        spread: `[n, 3]` one standard deviation of each point along its line of sight [m, base_link].
        uv: `[n, 2]` their pixels.
        grey: the picture, 8 bits.
        coarse: the same, halved `halvings` times.
        halvings: so often.
    """

    camera: Camera
    T_base_left: Array
    points: Array
    normals: Array
    spread: Array
    uv: Array
    grey: NDArray[np.uint8]
    coarse: NDArray[np.uint8]
    halvings: int

    @classmethod
    def of(cls, frame: Frame, swarm: Swarm) -> Glimpse:
        """What a frame and its swarm have."""
        T = frame.T_base_left
        return cls.about(
            cv2.cvtColor(frame.pair.left, cv2.COLOR_RGB2GRAY),
            camera=frame.pair.rig.left,
            T_base_left=T,
            points=transform(T, swarm.points),
            normals=np.asarray(swarm.normals, np.float64) @ T[:3, :3].T,
            spread=np.asarray(swarm.spread, np.float64) @ T[:3, :3].T,
            uv=np.asarray(swarm.uv, np.float64),
        )

    @classmethod
    def about(
        cls, grey: Any, *, camera: Camera, T_base_left: Array, points: Array, normals: Array, spread: Array, uv: Array
    ) -> Glimpse:
        """What a grey picture shows of points, the arguments as the attributes."""
        coarse, halvings = grey, 0
        while coarse.shape[1] > COARSE_PX:
            coarse, halvings = cv2.pyrDown(coarse), halvings + 1
        return cls(
            camera=camera,
            T_base_left=T_base_left,
            points=points,
            normals=normals,
            spread=spread,
            uv=uv,
            grey=np.asarray(grey, np.uint8),
            coarse=np.asarray(coarse, np.uint8),
            halvings=halvings,
        )
