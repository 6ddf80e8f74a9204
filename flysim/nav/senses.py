"""From what the eyes see to points on obstacles: by flies, or by OpenCV's SGBM."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.flies.threads import limited
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, transform
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.rivals.dense import dense

NEAR, FAR = 0.3, 5.0  # [m] of depth searched
# Few flies and few generations, ten times a second: what one look misses the next one finds.
FLIES = FlyParams(population=400, regions=1, max_iterations=4, min_depth=NEAR, max_depth=FAR, window=7, uniqueness=1.1)
ABOVE_FLOOR = 0.05  # [m] lower points are the floor
ABOVE_FLOOR_PER_M = 0.02  # [m/m] and more the farther off, as the errors of depth grow
STRIDE = 3  # [px] of SGBM's pixels one in so many, each way, is kept

Sense = Callable[[ImagePair, np.random.Generator], Array]


def flies(params: FlyParams = FLIES) -> Sense:
    """A sense: `[n, 3]` points [m, left optical frame], where flies settle, fittest first."""

    def see(pair: ImagePair, rng: np.random.Generator) -> Array:
        with limited(1):
            return evolve(pair, params, rng=rng).points.astype(np.float64)

    return see


def sgbm() -> Sense:
    """A sense: `[n, 3]` points [m, left optical frame] of one in nine of SGBM's pixels."""

    def see(pair: ImagePair, _rng: np.random.Generator) -> Array:
        disparity = dense(pair, "sgbm", min_depth=NEAR, max_depth=FAR, threads=1)[::STRIDE, ::STRIDE]
        v, u = np.nonzero(disparity > 0.0)
        depth = pair.rig.left.fx * pair.rig.baseline / disparity[v, u]
        points = pair.rig.left.unproject(np.stack([u, v], axis=1) * STRIDE, depth)
        return points[(depth >= NEAR) & (depth <= FAR)]

    return see


def standing(points: Array, T_base_left: Array, height: float) -> Array:
    """`[m, 3]` in base_link [m]: those of `[n, 3]` points (left optical frame) that such a robot would hit."""
    base = transform(T_base_left, points)
    away = np.hypot(base[:, 0], base[:, 1])
    return base[(base[:, 2] > ABOVE_FLOOR + ABOVE_FLOOR_PER_M * away) & (base[:, 2] < height)]


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
