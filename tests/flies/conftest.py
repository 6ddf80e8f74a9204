"""Pairs whose truth is exact: planes with a smooth texture, sampled at each pixel's own point of the surface."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.geometry.camera import Camera
from flysim.geometry.frames import inverse
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.swarm import Swarm

CAMERA = Camera(width=200, height=150, fx=180.0, fy=180.0, cx=99.5, cy=74.5)
RIG = StereoRig.parallel(CAMERA, 0.12)
WAVES = 12


@dataclass(frozen=True)
class Plane:
    """The points p [m, left optical frame] with normal . p = offset."""

    normal: tuple[float, float, float]
    offset: float
    seed: int = 1
    right_of: float | None = None  # x / z from which it is there; None: endless


def texture(points: np.ndarray, wavelength: float, seed: int) -> np.ndarray:
    """`[N, 3]` colours in [0, 255] of points [m]: a sum of waves in space, the shortest `wavelength` metres long."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(WAVES, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    waves = directions * (2 * np.pi / wavelength / rng.uniform(1.0, 4.0, size=(WAVES, 1)))
    angles = (points @ waves.T).astype(np.float32)  # good to 1e-5 rad, and four times as fast
    phases = rng.uniform(0, 2 * np.pi, size=(3, WAVES)).astype(np.float32)
    colour = np.stack([np.sin(angles + phase).sum(axis=1) for phase in phases], axis=1)
    return np.clip(127.5 + 20.0 * colour, 0.0, 255.0)


def hits(rig: StereoRig, planes: list[Plane], side: str) -> tuple[np.ndarray, np.ndarray]:
    """What one camera's pixels see: `[H, W, 3]` points in the left frame and `[H, W]` planes; NaN and -1: nothing."""
    camera = rig.left if side == "left" else rig.right
    T_left_eye = np.eye(4) if side == "left" else inverse(rig.T_right_left)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = camera.unproject(np.stack([u, v], -1), np.ones(u.shape)) @ T_left_eye[:3, :3].T
    eye = T_left_eye[:3, 3]
    points, index, nearest = np.full(rays.shape, np.nan), np.full(u.shape, -1), np.full(u.shape, np.inf)
    for k, plane in enumerate(planes):
        n = np.array(plane.normal)
        t = (plane.offset - n @ eye) / (rays @ n)
        p = eye + t[..., None] * rays
        hit = (t > 0) & (t < nearest) & (p[..., 2] > 0)
        if plane.right_of is not None:
            hit &= p[..., 0] >= plane.right_of * p[..., 2]
        points[hit], index[hit], nearest[hit] = p[hit], k, t[hit]
    return points, index


def photograph(
    rig: StereoRig, planes: list[Plane], *, wavelength: float = 0.08, noise: float = 0.0, seed: int = 0
) -> ImagePair:
    """The pair that the rig takes of planes, with `noise` grey levels of Gaussian noise."""
    rng = np.random.default_rng(seed)
    images = []
    for side in ("left", "right"):
        points, index = hits(rig, planes, side)
        colours = np.zeros(points.shape)
        for k, plane in enumerate(planes):
            colours[index == k] = texture(points[index == k], wavelength, plane.seed)
        images.append((colours + noise * rng.normal(size=colours.shape)).round().clip(0, 255).astype(np.uint8))
    return ImagePair(left=images[0], right=images[1], rig=rig)


def disparity_error(swarm: Swarm, rig: StereoRig, planes: list[Plane]) -> np.ndarray:
    """`[N]` distance [px] from each fly's right pixel to where the surface under its left pixel really is seen.

    NaN where the surface at the fly's left pixel is hidden from the right camera.
    """
    u, v = swarm.uv.round().astype(int).T
    truth = hits(rig, planes, "left")[0][v, u]
    uv = rig.project(truth)[1]
    error = np.linalg.norm(swarm.uv_right - uv, axis=1)
    inside = rig.right.contains(uv)
    ur, vr = np.where(inside[:, None], uv, 0).round().astype(int).T
    hidden = hits(rig, planes, "right")[0][vr, ur, 2] < truth[:, 2] - 0.05
    return np.where(inside & ~hidden, error, np.nan)


def run(pair: ImagePair, seed: int = 1, **params) -> Swarm:
    return evolve(
        pair,
        FlyParams(**{"population": 1000, "min_depth": 0.6, "max_depth": 4.0, **params}),
        rng=np.random.default_rng(seed),
    )


def ramp(rig: StereoRig) -> ImagePair:
    """Grey levels that grow by one a row and are equal along it: every depth matches exactly, every fly is as fit."""
    rows = np.arange(rig.left.height, dtype=np.uint8)[:, None, None]
    image = np.broadcast_to(rows, (rig.left.height, rig.left.width, 3))
    return ImagePair(left=image, right=image, rig=rig)


# Every fly in view settles and none is moved or dropped, so that what is bred can be counted.
COUNTED = {
    "fitness": "paper",
    "settled_fitness": 1e-6,
    "sharing_strength": 0.0,
    "slant": 0.0,
    "polish": 0,
    "misfit": 0.0,
    "uniqueness": 0.0,
    "stop": 1.0,
}


def angle_deg(normals: np.ndarray, plane: Plane) -> np.ndarray:
    """`[N]` angle between normals and the one of a plane that faces the camera [deg]."""
    return np.degrees(np.arccos(np.clip(-normals @ np.array(plane.normal), -1.0, 1.0)))


@pytest.fixture(scope="session")
def stage():
    """The tools of this file."""
    return SimpleNamespace(
        CAMERA=CAMERA,
        RIG=RIG,
        COUNTED=COUNTED,
        Plane=Plane,
        texture=texture,
        photograph=photograph,
        ramp=ramp,
        disparity_error=disparity_error,
        angle_deg=angle_deg,
        run=run,
    )


@pytest.fixture(scope="session")
def facing():
    """A wall at 1.5 m that faces the rig, the pair taken of it, and a swarm on it."""
    planes = [Plane((0.0, 0.0, 1.0), 1.5)]
    pair = photograph(RIG, planes)
    return SimpleNamespace(planes=planes, pair=pair, swarm=run(pair))


@pytest.fixture(scope="session")
def step():
    """A wall at 1.13 m that ends in the middle of the image, before one at 2.3 m."""
    planes = [Plane((0.0, 0.0, 1.0), 2.3, seed=3), Plane((0.0, 0.0, 1.0), 1.13, seed=4, right_of=0.05)]
    pair = photograph(RIG, planes)
    return SimpleNamespace(planes=planes, pair=pair, swarm=run(pair))
