"""Worlds built by hand, seen through exact cameras: a numpy ray caster stands in for the renderers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from flysim.flies.swarm import Swarm
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Pose2, inverse, pose6, rotation_rpy, se3
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.journey import Journey, Look
from flysim.obstacles.cloud import FlyCloud
from flysim.obstacles.obstacle import Obstacle
from flysim.sim.stop import Stop
from flysim.world.model import Link, Part, World
from flysim.world.shapes import Box, Cylinder, Plane, Shape, Sphere
from flysim.world.view import TrueView

CAMERA = Camera.from_fov(320, 240, 1.2)
BASELINE = 0.12
MAX_RANGE = 6.0


def hit(shape: Shape, origin: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """`[N]` parameter of the first hit of `origin + t rays` in the shape's frame; inf where there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        if isinstance(shape, Box):
            half = np.array(shape.size) / 2
            a, b = (-half - origin) / rays, (half - origin) / rays
            near, far = np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)
            return np.where((near <= far) & (near > 0), near, np.inf)
        if isinstance(shape, Plane):
            t = -origin[2] / rays[:, 2]
            on = np.abs(origin[:2] + t[:, None] * rays[:, :2]) <= np.array(shape.size) / 2
            return np.where((t > 0) & on.all(axis=1), t, np.inf)
        flat = [0, 1] if isinstance(shape, Cylinder) else [0, 1, 2]
        o, d = origin[flat], rays[:, flat]
        a, b, c = (d * d).sum(1), d @ o, o @ o - shape.radius**2
        root = np.sqrt(np.where(b * b >= a * c, b * b - a * c, np.nan))
        t = (-b - root) / a
        if isinstance(shape, Sphere):
            return np.where(t > 0, t, np.inf)
        side = np.where((t > 0) & (np.abs(origin[2] + t * rays[:, 2]) <= shape.length / 2), t, np.inf)
        for z in (-shape.length / 2, shape.length / 2):
            t = (z - origin[2]) / rays[:, 2]
            on = ((origin[:2] + t[:, None] * rays[:, :2]) ** 2).sum(1) <= shape.radius**2
            side = np.minimum(side, np.where((t > 0) & on, t, np.inf))
        return side


def see(world: World, T_world_links: np.ndarray, camera: Camera, T_world_optical: np.ndarray) -> TrueView:
    """The exact view of a world."""
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    uv = np.stack([u.ravel(), v.ravel()], axis=1)
    rays = camera.unproject(uv, np.ones(len(uv)))  # z = 1: the ray parameter is the depth
    depth, link = np.full(len(uv), np.inf), np.full(len(uv), -1, np.int32)
    for i, body in enumerate(world.links):
        for part in body.visuals:
            T = inverse(T_world_links[i] @ part.T_link_part) @ T_world_optical
            t = hit(part.shape, T[:3, 3], rays @ T[:3, :3].T)
            link[t < depth] = i
            depth = np.minimum(depth, t)
    shape = (camera.height, camera.width)
    return TrueView(
        camera=camera,
        rgb=np.zeros((*shape, 3), np.uint8),
        depth=depth.reshape(shape).astype(np.float32),
        link=link.reshape(shape),
        T_world_optical=T_world_optical,
    )


def body(
    name: str,
    shape: Shape,
    x: float = 0.0,
    y: float = 0.0,
    z: float = 0.0,
    yaw: float = 0.0,
    *,
    roll: float = 0.0,
    pitch: float = 0.0,
    structure: bool = False,
    model: str | None = None,
) -> Link:
    """A link of one shape."""
    part = Part(name=name, shape=shape, T_link_part=np.eye(4))
    return Link(
        name=name,
        model=model or name,
        T_world_link=pose6(x, y, z, roll, pitch, yaw),
        visuals=(part,),
        collisions=(part,),
        static=True,
        structure=structure,
    )


def box(name: str, size: tuple[float, float, float], x: float, y: float, yaw: float = 0.0, **other) -> Link:
    """A cuboid that stands on the ground."""
    return body(name, Box(size), x, y, size[2] / 2, yaw, **other)


def world_of(*links: Link) -> World:
    return World(name="test", path=Path("test.sdf"), links=links)


def stop_at(
    world: World,
    x: float,
    y: float,
    yaw: float,
    *,
    index: int = 0,
    camera: Camera = CAMERA,
    height: float = 0.4,
    down: float = 0.2,
    T_world_links: np.ndarray | None = None,
) -> Stop:
    """A stop of a robot whose left camera is above its base, looking ahead and a little down."""
    rig = StereoRig.parallel(camera, BASELINE)
    optical = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    T_base_left = se3(rotation_rpy(0.0, down, 0.0) @ optical, (0.0, BASELINE / 2, height))
    pose = Pose2(x, y, yaw)
    poses = np.array([link.T_world_link for link in world.links]) if T_world_links is None else T_world_links
    T_left = pose.matrix @ T_base_left
    views = see(world, poses, camera, T_left), see(world, poses, camera, T_left @ inverse(rig.T_right_left))
    return Stop(
        index=index,
        commanded=pose,
        odometry=pose,
        true=pose,
        pair=ImagePair(left=views[0].rgb, right=views[1].rgb, rig=rig),
        T_base_left=T_base_left,
        T_world_base=pose.matrix,
        views=views,
        T_world_links=poses,
        sim_time=0.0,
        track=np.zeros((0, 7)),
        drive_s=1.0,
        render_s=0.25,
    )


def around(world: World, n: int = 4, radius: float = 2.0, center: tuple[float, float] = (0.0, 0.0), **other) -> list:
    """Stops on a circle, all looking at its centre; the first from -x."""
    angles = np.arange(n) * 2 * np.pi / n
    return [
        stop_at(world, center[0] - radius * np.cos(a), center[1] - radius * np.sin(a), float(a), index=i, **other)
        for i, a in enumerate(angles)
    ]


def estimate(x: float, y: float, size: tuple[float, float, float], yaw: float = 0.0, flies=()) -> Obstacle:
    return Obstacle(
        center=np.array([x, y, size[2] / 2]),
        size=np.array(size),
        yaw=yaw,
        flies=np.array(flies, dtype=np.int64),
    )


def cloud_of(points=(), stop=0) -> FlyCloud:
    points = np.asarray(points, dtype=float).reshape(-1, 3)
    n = len(points)
    return FlyCloud(
        points=points,
        normals=np.zeros((n, 3)),
        spread=np.zeros((n, 3)),
        arms=np.repeat(points[:, None], 4, axis=1),
        steps=np.zeros((n, 4, 3)),
        ended=np.zeros((n, 4), np.bool_),
        fitness=np.ones(n, np.float32),
        stop=np.broadcast_to(np.asarray(stop, np.int32), n).copy(),
        uv=np.zeros((n, 2), np.float32),
        uv_right=np.zeros((n, 2), np.float32),
        rgb=np.zeros((n, 3), np.uint8),
    )


def journey_of(world: World, stops, obstacles=(), cloud: FlyCloud | None = None, **other) -> Journey:
    empty = np.zeros((0, 3), np.float32)
    swarm = Swarm(
        points=empty,
        normals=empty,
        spread=empty,
        fitness=empty[:, 0],
        uv=empty[:, :2],
        uv_right=empty[:, :2],
        region=np.zeros(0, np.int32),
        age=np.zeros(0, np.int32),
        history=(),
        converged=True,
        reason="",
    )
    known = {
        "scenario": "test",
        "seed": 7,
        "renderer": "cast",
        "engine": "none",
        "world": world,
        "looks": tuple(Look(stop=stop, swarm=swarm, evolve_s=0.5) for stop in stops),
        "cloud": cloud_of() if cloud is None else cloud,
        "obstacles": tuple(obstacles),
        "planned": len(stops),
        "blocked": None,
        "obstacles_s": 0.125,
        "total_s": 10.0,
        "max_range": MAX_RANGE,
    }
    return Journey(**(known | other))


@dataclass(frozen=True)
class Yard:
    """Two boxes and a pole on a floor before a wall, seen from four sides."""

    world: World
    stops: list
    exact: tuple[Obstacle, ...]  # what a perfect estimator would say

    def journey(self, obstacles=None, cloud=None, **other) -> Journey:
        return journey_of(self.world, self.stops, self.exact if obstacles is None else obstacles, cloud, **other)

    def changed(self, index: int, **changes) -> tuple[Obstacle, ...]:
        """The perfect estimates with one of them changed."""
        return tuple(replace(o, **changes) if i == index else o for i, o in enumerate(self.exact))


@pytest.fixture(scope="session")
def yard() -> Yard:
    world = world_of(
        body("floor", Plane((20.0, 20.0)), structure=True),
        body("wall", Box((0.1, 8.0, 1.0)), 3.5, 0.0, 0.5, structure=True),
        box("box_1", (0.5, 0.3, 0.4), 0.0, 0.6, yaw=0.5),
        box("box_2", (0.4, 0.4, 0.3), 0.2, -0.7),
        body("pole", Cylinder(0.06, 0.6), 0.6, 0.0, 0.3),
    )
    exact = (
        estimate(0.0, 0.6, (0.5, 0.3, 0.4), 0.5),
        estimate(0.2, -0.7, (0.4, 0.4, 0.3)),
        estimate(0.6, 0.0, (0.12, 0.12, 0.6), 0.3),
    )
    return Yard(world, around(world, 4, 2.2), exact)


@pytest.fixture(scope="session")
def by_hand() -> SimpleNamespace:
    """The builders of this file, for tests that make a world of their own."""
    return SimpleNamespace(
        CAMERA=CAMERA,
        BASELINE=BASELINE,
        MAX_RANGE=MAX_RANGE,
        body=body,
        box=box,
        world=world_of,
        stop=stop_at,
        around=around,
        estimate=estimate,
        cloud=cloud_of,
        journey=journey_of,
        see=see,
    )
