"""From what the eyes see to points on obstacles: by flies, or by OpenCV's SGBM."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flysim.engines.dense import dense
from flysim.flies.carry import carried
from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.flies.threads import limited
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, Pose2, inverse, transform
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.robots.robot import Robot

NEAR, FAR = 0.3, 5.0  # [m] of depth searched
# Few flies and few generations, ten times a second: flies on what stands outlive the picture, immigrants look for more.
FLIES = FlyParams(
    population=1000,
    operators=(0.3, 0.1, 0.2, 0.4),
    regions=1,
    max_iterations=3,
    min_depth=NEAR,
    max_depth=FAR,
    window=7,
    uniqueness=1.1,
)
ABOVE_FLOOR = 0.05  # [m] lower points are the floor
ABOVE_FLOOR_PER_M = 0.02  # [m/m] and more the farther off, as the errors of depth grow
STRIDE = 3  # [px] of SGBM's pixels one in so many, each way, is kept


class Sense(Protocol):
    """From a pair of images to points on what stands about."""

    def begin(self) -> None:
        """A new episode: nothing has been seen."""
        ...

    def see(self, pair: ImagePair, pose: Pose2, rng: np.random.Generator) -> Array:
        """`[n, 3]` points [m, base_link] on what the robot would hit, surest first; `pose` is of odometry."""
        ...


class FlySense:
    """Flies that outlive the picture: those on what stands are carried along by odometry, and bred from."""

    def __init__(self, robot: Robot, params: FlyParams = FLIES) -> None:
        self._robot, self._params = robot, params
        self.begin()

    def begin(self) -> None:
        """A new episode: no flies."""
        self._last: tuple[Array, Array, Array] | None = None

    def see(self, pair: ImagePair, pose: Pose2, rng: np.random.Generator) -> Array:
        """`[n, 3]` where flies settle [m, base_link], above the floor and no higher than the robot, fittest first."""
        T_world_left = pose.matrix @ self._robot.T_base_left
        before = None
        if self._last is not None:
            points, normals, T_world_before = self._last
            before = carried(points, normals, pair.rig.left, inverse(T_world_left) @ T_world_before)
        with limited(1):
            swarm = evolve(pair, self._params, rng=rng, carried=before)
        points, normals = swarm.points.astype(np.float64), swarm.normals.astype(np.float64)
        base = transform(self._robot.T_base_left, points)
        stands = standing(base, self._robot.height)
        self._last = points[stands], normals[stands], T_world_left
        return base[stands]


class SgbmSense:
    """One in nine of SGBM's pixels."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot

    def begin(self) -> None:
        """Nothing outlives a picture."""

    def see(self, pair: ImagePair, pose: Pose2, rng: np.random.Generator) -> Array:
        """`[n, 3]` points [m, base_link] above the floor and no higher than the robot."""
        disparity = dense(pair, "sgbm", min_depth=NEAR, max_depth=FAR, threads=1)[::STRIDE, ::STRIDE]
        v, u = np.nonzero(disparity > 0.0)
        depth = pair.rig.left.fx * pair.rig.baseline / disparity[v, u]
        points = pair.rig.left.unproject(np.stack([u, v], axis=1) * STRIDE, depth)
        base = transform(self._robot.T_base_left, points[(depth >= NEAR) & (depth <= FAR)])
        return base[standing(base, self._robot.height)]


def standing(base: Array, height: float) -> NDArray[np.bool_]:
    """`[n]` which of `[n, 3]` points [m, base_link] a robot of that height would hit."""
    away = np.hypot(base[:, 0], base[:, 1])
    return (base[:, 2] > ABOVE_FLOOR + ABOVE_FLOOR_PER_M * away) & (base[:, 2] < height)


def small_rig(rig: StereoRig, width: int, height: int) -> StereoRig:
    """The same two cameras with images of that size [px]."""
    return StereoRig(
        left=_small(rig.left, width, height), right=_small(rig.right, width, height), T_right_left=rig.T_right_left
    )


def _small(camera: Camera, width: int, height: int) -> Camera:
    a, b = width / camera.width, height / camera.height
    return Camera(
        width=width,
        height=height,
        fx=camera.fx * a,
        fy=camera.fy * b,
        cx=(camera.cx + 0.5) * a - 0.5,
        cy=(camera.cy + 0.5) * b - 0.5,
    )
