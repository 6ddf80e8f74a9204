"""Pairs whose truth is exact: planes with a smooth texture, sampled at each pixel's own point of the surface."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from flysim.flies.evolution import evolve
from flysim.flies.parameters import FlyParams
from flysim.flies.swarm import Swarm
from flysim.geometry.camera import Camera
from flysim.geometry.frames import inverse, transform
from flysim.geometry.rig import ImagePair, StereoRig

CAMERA = Camera(width=200, height=150, fx=180.0, fy=180.0, cx=99.5, cy=74.5)
RIG = StereoRig.parallel(CAMERA, 0.12)


@dataclass(frozen=True)
class Plane:
    """Points p of the left optical frame with normal . p = offset; `u_max`: the left column at which it ends."""

    normal: tuple[float, float, float]
    offset: float
    seed: int = 1
    right_of: float | None = None  # x / z from which it is there; None: endless


def texture(points: np.ndarray, wavelength: float, seed: int) -> np.ndarray:
    """`[N, 3]` colours in [0, 255] of points [m]: a sum of waves in space, the shortest `wavelength` metres long."""
    rng = np.random.default_rng(seed)
    directions = rng.normal(size=(24, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    waves = directions * (2 * np.pi / wavelength / rng.uniform(1.0, 4.0, size=(24, 1)))
    colour = np.empty((len(points), 3))
    for k in range(3):
        colour[:, k] = np.sin(points @ waves.T + rng.uniform(0, 2 * np.pi, 24)).sum(axis=1)
    return np.clip(127.5 + 14.0 * colour, 0.0, 255.0)


def seen(rig: StereoRig, planes: list[Plane], side: str, wavelength: float) -> tuple[np.ndarray, np.ndarray]:
    """(colours `[H, W, 3]` float, depth in the left frame `[H, W]`) of one camera of the rig."""
    camera = rig.left if side == "left" else rig.right
    T_left_eye = np.eye(4) if side == "left" else inverse(rig.T_right_left)
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = camera.unproject(np.stack([u.ravel(), v.ravel()], 1), np.ones(u.size)) @ T_left_eye[:3, :3].T
    eye = T_left_eye[:3, 3]
    colours, nearest, depth = np.zeros((u.size, 3)), np.full(u.size, np.inf), np.full(u.size, np.nan)
    for plane in planes:
        n = np.array(plane.normal)
        with np.errstate(divide="ignore"):
            t = (plane.offset - n @ eye) / (rays @ n)
        p = eye + np.where(np.isfinite(t), t, 0.0)[:, None] * rays
        hit = np.isfinite(t) & (t > 0) & (t < nearest) & (p[:, 2] > 0)
        if plane.right_of is not None:
            hit &= p[:, 0] >= plane.right_of * p[:, 2]
        colours[hit] = texture(p[hit], wavelength, plane.seed)
        nearest[hit], depth[hit] = t[hit], p[hit, 2]
    return colours.reshape(*u.shape, 3), depth.reshape(u.shape)


def photograph(
    rig: StereoRig, planes: list[Plane], *, wavelength: float = 0.08, noise: float = 0.0, seed: int = 0
) -> ImagePair:
    """The pair that the rig takes of planes, with `noise` grey levels of Gaussian noise."""
    rng = np.random.default_rng(seed)
    images = []
    for side in ("left", "right"):
        colours, _ = seen(rig, planes, side, wavelength)
        images.append((colours + noise * rng.normal(size=colours.shape)).round().clip(0, 255).astype(np.uint8))
    return ImagePair(left=images[0], right=images[1], rig=rig)


def disparity_error(swarm: Swarm, rig: StereoRig, planes: list[Plane]) -> np.ndarray:
    """`[N]` distance [px] from each fly's right pixel to where the surface under its left pixel really is seen.

    NaN where the surface at the fly's left pixel is hidden from the right camera.
    """
    _, depth = seen(rig, planes, "left", 1.0)
    u, v = swarm.uv.round().astype(int).T
    truth = rig.left.unproject(np.stack([u, v], 1), depth[v, u])
    uv = rig.project(truth)[1]
    error = np.linalg.norm(swarm.uv_right - uv, axis=1)
    _, right_depth = seen(rig, planes, "right", 1.0)
    inside = rig.right.contains(uv)
    ur, vr = np.where(inside[:, None], uv, 0).round().astype(int).T
    nearer = right_depth[vr, ur] < truth[:, 2] - 0.05
    return np.where(inside & ~nearer, error, np.nan)


def run(pair: ImagePair, seed: int = 1, **params) -> Swarm:
    return evolve(pair, FlyParams(**{"population": 1000, "min_depth": 0.6, "max_depth": 4.0, **params}),
                  rng=np.random.default_rng(seed))


@pytest.fixture(scope="session")
def stage():
    """The tools of this file."""
    return SimpleNamespace(
        CAMERA=CAMERA, RIG=RIG, Plane=Plane, texture=texture, seen=seen, photograph=photograph,
        disparity_error=disparity_error, run=run, transform=transform,
    )


def same_bytes(a: Swarm, b: Swarm) -> bool:
    names = ("points", "normals", "spread", "patches", "fitness", "uv", "uv_right", "region", "age")
    same = all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in names)
    return same and a.history == b.history and a.reason == b.reason


@pytest.fixture(scope="session")
def facing(stage):
    """A wall at 1.5 m that faces the rig, its pair and a swarm on it."""
    planes = [Plane((0.0, 0.0, 1.0), 1.5)]
    pair = photograph(RIG, planes)
    return SimpleNamespace(planes=planes, pair=pair, swarm=run(pair))
