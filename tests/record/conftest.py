"""A made-up drive past two obstacles, drawn with numpy: these tests need no physics and no renderer."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from flysim.geometry.camera import Camera
from flysim.geometry.frames import Pose2, inverse, pose6, se3, transform
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.products.cloud import FlyCloud
from flysim.products.findings import Findings, Seen
from flysim.products.frame import Frame, FrameSequence
from flysim.products.obstacle import Obstacle
from flysim.products.swarm import Generation, Swarm
from flysim.truth.stop import Stop
from flysim.truth.truth import Truth
from flysim.worlds.model import Link, Material, Part, World
from flysim.worlds.shapes import Box, Cylinder, Mesh, Plane, Sphere
from flysim.worlds.view import TrueView

BOX = {"center": np.array([1.6, 0.1, 0.15]), "size": np.array([0.4, 0.25, 0.3]), "yaw": math.radians(25)}
POST = {"center": np.array([2.2, -0.7, 0.25]), "size": np.array([0.2, 0.2, 0.5]), "yaw": 0.0}
CAMERA = Camera.from_fov(320, 240, 1.134)
T_BASE_LEFT = se3([[0, -0.198, 0.98], [-1, 0, 0], [0, -0.98, -0.198]], (0.0, 0.06, 0.5))


@dataclass(frozen=True)
class TrueBox:
    """The fields of `flysim.truth.obstacles.TrueObstacle` that a record reads."""

    name: str
    center: np.ndarray
    size: np.ndarray
    yaw: float


def make_world() -> World:
    def link(name, shape, x=0.0, y=0.0, z=0.0, yaw=0.0, structure=False, static=True, roll=0.0):
        part = Part(name="visual", shape=shape, T_link_part=np.eye(4), material=Material(diffuse=(0.8, 0.75, 0.6)))
        T = pose6(x, y, z, roll, 0.0, yaw)
        return Link(
            name="link",
            model=name,
            T_world_link=T,
            visuals=(part,),
            collisions=(part,),
            static=static,
            structure=structure,
        )

    corner = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.2, 0], [0, 0, 0.2]], float)
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
    links = (
        link("ground", Plane((8.0, 8.0)), x=1.0, structure=True),
        link("wall", Box((0.1, 4.0, 1.0)), x=3.2, z=0.5, structure=True),
        link("box_1", Box(tuple(BOX["size"])), *BOX["center"], yaw=BOX["yaw"]),
        link("post", Cylinder(0.1, 0.5), *POST["center"]),
        link("ball", Sphere(0.1), x=2.6, y=0.9, z=0.1, static=False),
        link("ramp", Mesh(corner, faces, None, Path("ramp.obj")), x=0.6, y=1.0),
    )
    return World(name="made-up", path=Path("world.sdf"), links=links, warnings=("a <light> was skipped",))


def on_box(rng, n, center, size, yaw):
    """`n` points on the four sides and the top of an upright box, 5 mm rough."""
    p = rng.uniform(-0.5, 0.5, (n, 3))
    face = rng.integers(0, 5, n)
    axis = np.array([0, 0, 1, 1, 2])[face]
    p[np.arange(n), axis] = np.array([-0.5, 0.5, -0.5, 0.5, 0.5])[face]
    p = p * size + rng.normal(0.0, 0.005, (n, 3))
    return transform(pose6(*center, 0.0, 0.0, yaw), p)


def make_stop(index: int, rng, world: World) -> tuple[Frame, Stop]:
    x = 0.15 * index - 0.6
    true = Pose2(x, -0.1 * math.sin(x), 0.05 * index)
    odometry = Pose2(x + 0.01 * index, true.y + 0.006 * index, true.yaw + 0.004 * index)
    rig = StereoRig.parallel(CAMERA, 0.12)
    rows = np.linspace(90, 200, 240)[:, None, None] * np.ones((240, 320, 3))
    images = [np.clip(rows + rng.normal(0, 12, rows.shape), 0, 255).astype(np.uint8) for _ in range(2)]
    T_world_left = true.matrix @ T_BASE_LEFT
    poses = (T_world_left, T_world_left @ inverse(rig.T_right_left))
    depth = np.full((240, 320), 2.0, np.float32)
    link = np.zeros((240, 320), np.int32)
    views = [TrueView(camera=CAMERA, rgb=images[i], depth=depth, link=link, T_world_optical=poses[i]) for i in range(2)]
    steps = np.linspace(0.0, 1.0, 50) if index else np.zeros(0)
    before = x - 0.15 + 0.15 * steps
    zero = np.zeros_like(steps)
    track = np.stack(
        [
            2.0 * (index - 1) + 2.0 * steps,
            before + 0.01 * index,
            zero,
            zero,
            before,
            -0.1 * np.sin(before),
            zero,
        ],
        axis=1,
    )
    T_links = np.array([each.T_world_link for each in world.links])
    T_links[4, 0, 3] += 0.05 * index
    frame = Frame(
        index=index,
        time=2.0 * index,
        pair=ImagePair(left=images[0], right=images[1], rig=rig),
        T_world_base=odometry.matrix,
        T_base_left=T_BASE_LEFT,
    )
    return frame, Stop(
        index=index,
        commanded=true,
        odometry=odometry,
        true=true,
        T_world_base=true.matrix,
        views=(views[0], views[1]),
        T_world_links=T_links,
        sim_time=2.0 * index,
        track=track,
        drive_s=0.1,
        render_s=0.02,
    )


def make_swarm(frame: Frame, stop: Stop, rng, n: int = 400) -> tuple[Swarm, np.ndarray]:
    world = np.concatenate([on_box(rng, n, **BOX), on_box(rng, n, **POST)])
    points = transform(inverse(stop.true.matrix @ T_BASE_LEFT), world)
    left, right = frame.pair.rig.project(points)
    seen = CAMERA.contains(left) & CAMERA.contains(right)
    points, left, right, count = points[seen], left[seen], right[seen], int(seen.sum())
    fitness = np.sort(rng.lognormal(0.0, 1.5, count))[::-1]
    history = tuple(
        Generation(best=9.0 - 8.0 / (g + 1), mean=3.0 - 2.5 / (g + 1), settled=1 - 0.9**g, regions=(count,))
        for g in range(12 + stop.index)
    )
    swarm = Swarm(
        points=points.astype(np.float32),
        normals=np.zeros((count, 3), np.float32),
        spread=np.zeros((count, 3), np.float32),
        fitness=fitness.astype(np.float32),
        uv=left.astype(np.float32),
        uv_right=right.astype(np.float32),
        region=np.zeros(count, np.int32),
        age=np.ones(count, np.int32),
        history=history,
        converged=True,
        reason="90 % of the flies have settled",
    )
    return swarm, swarm.to_world(frame.T_world_left)


@dataclass(frozen=True)
class Drive:
    """What was found on a drive that nobody drove, and its truth."""

    findings: Findings
    truth: Truth


def make_drive_of(stops: int = 4, seed: int = 3, blocked: str | None = None) -> Drive:
    rng = np.random.default_rng(seed)
    world = make_world()
    seen, truly, points, fitness, index, uv, uv_right = (
        [],
        [],
        [np.zeros((0, 3))],
        [],
        [],
        [np.zeros((0, 2))],
        [np.zeros((0, 2))],
    )
    for i in range(stops):
        frame, stop = make_stop(i, rng, world)
        swarm, placed = make_swarm(frame, stop, rng)
        seen.append(Seen(frame=frame, swarm=swarm, seconds=0.05))
        truly.append(stop)
        points.append(placed)
        fitness.extend(swarm.fitness)
        index.extend([i] * len(placed))
        uv.append(swarm.uv)
        uv_right.append(swarm.uv_right)
    cloud = FlyCloud(
        points=np.concatenate(points),
        normals=np.zeros((len(index), 3)),
        spread=np.zeros((len(index), 3)),
        arms=np.repeat(np.concatenate(points)[:, None], 4, axis=1),
        steps=np.zeros((len(index), 4, 3)),
        ended=np.zeros((len(index), 4), np.bool_),
        fitness=np.array(fitness, np.float32),
        stop=np.array(index, np.int32),
        uv=np.concatenate(uv).astype(np.float32),
        uv_right=np.concatenate(uv_right).astype(np.float32),
        rgb=rng.integers(0, 256, (len(index), 3)).astype(np.uint8),
    )
    near = np.linalg.norm(cloud.points[:, :2] - BOX["center"][:2], axis=1) < 0.4
    found = [
        Obstacle(center=o["center"] + 0.01, size=o["size"] * 1.05, yaw=o["yaw"] + 0.03, flies=np.flatnonzero(mask))
        for o, mask in ((BOX, near), (POST, ~near))
    ]
    findings = Findings(
        engine="flies",
        sequence=FrameSequence(
            name="made_up",
            seed=seed,
            frames=tuple(one.frame for one in seen),
            planned=stops,
            blocked=blocked,
            seconds=0.9,
        ),
        seen=tuple(seen),
        cloud=cloud,
        obstacles=tuple(found) if stops else (),
        obstacles_s=0.01,
        max_range=5.0,
    )
    known = [TrueBox(name="box_1", **BOX), TrueBox(name="post", **POST)] if stops else []
    made = Truth.of(world, truly, max_range=5.0)
    return Drive(findings, replace(made, obstacles=tuple(known)))


def make_report(drive: Drive) -> dict:
    def pose(p: Pose2) -> list[float]:
        return [p.x, p.y, p.yaw]

    obstacle = {
        "detected": True,
        "center_error_m": 0.0173,
        "size_true_m": [0.4, 0.25, 0.3],
        "size_visible_m": [0.38, 0.25, 0.3],
        "size_estimated_m": [0.42, 0.26, 0.31],
        "size_error_m": [0.02, 0.01, 0.01],
        "size_visible_error_m": [0.04, 0.01, 0.01],
        "yaw_error_deg": 1.7,
    }
    missed = {**dict.fromkeys(obstacle), "detected": False, "size_true_m": [0.2, 0.2, 0.2]}
    return {
        "scenario": drive.findings.sequence.name,
        "seed": drive.findings.sequence.seed,
        "renderer": drive.findings.sequence.renderer,
        "engine": drive.findings.engine,
        "status": "blocked" if drive.findings.sequence.blocked else "ok",
        "stops": [
            {
                "index": stop.index,
                "commanded": pose(stop.commanded),
                "odometry": pose(stop.odometry),
                "true": pose(stop.true),
                "iterations": one.swarm.iterations,
                "converged": one.swarm.converged,
                "time_s": {"render": 0.02, "evolve": 0.05, "obstacles": 0.01},
            }
            for stop, one in zip(drive.truth.stops, drive.findings.seen, strict=True)
        ],
        "obstacles": [
            {"name": "box_1", **obstacle},
            {"name": "post", **obstacle},
            {"name": "ball", **missed},
        ],
        "false_obstacles": 0,
        "precision": 1.0,
        "recall": 0.667,
        "f1": 0.8,
        "center_error_m": {"median": 0.0173, "max": 0.0173},
        "size_error_m": {"median": 0.01, "max": 0.02},
        "surface": {
            "accuracy_median_m": 0.004,
            "accuracy_p90_m": 0.009,
            "precision": {"0.01": 0.9, "0.02": 0.97, "0.05": 0.99},
            "completeness": {"0.01": 0.5, "0.02": 0.7, "0.05": 0.9},
            "f_score": {"0.01": 0.64, "0.02": 0.81, "0.05": 0.94},
        },
        "time_s": {"total": 1.0, "drive": 0.3, "render": 0.1, "evolve": 0.2, "obstacles": 0.01},
        "versions": {"flysim": "0.1.0"},
    }


@pytest.fixture(scope="session")
def drive() -> Drive:
    return make_drive_of()


@pytest.fixture(scope="session")
def findings(drive) -> Findings:
    return drive.findings


@pytest.fixture(scope="session")
def truth(drive) -> Truth:
    return drive.truth


@pytest.fixture(scope="session")
def make_drive():
    return make_drive_of


@pytest.fixture(scope="session")
def report(drive) -> dict:
    return make_report(drive)
