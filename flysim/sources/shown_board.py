"""A board held before a robot's own cameras: images as somebody takes them who calibrates it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from flysim.calibration.board import Board
from flysim.common.scratch import Scratch
from flysim.errors import FlysimError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, Pose2, inverse, se3, transform
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.render.choose import RendererName
from flysim.render.studio import Studio
from flysim.robots.robot import Robot
from flysim.sensors.cameras import Cameras
from flysim.sensors.distortion import distorted, rays
from flysim.sensors.parameters import SensorParams
from flysim.worlds.model import Link, Material, Part, World
from flysim.worlds.shapes import Plane
from flysim.worlds.surface.texture import write_png

SQUARE_PX = 40  # of the board's picture; in the image a square has about as many
SMALL, LARGE = (0.4, 0.6), (0.7, 1.0)  # of the image's width that a board takes, if it faced the camera
TILT, ROLL = (15.0, 45.0), 10.0  # [degrees] against the image plane, to any side; about the optical axis
CORNERS = 8  # four of each eye's image: the lens bends them most, and a board in the middle says nothing of them
INSIDE, SLACK = 3.0, 12.0  # [px] that every square keeps from the border, and up to how many more in a corner
TRIES = 2000
T_BOARD_PLANE = np.diag([1.0, -1.0, -1.0, 1.0])  # a board's y runs down and its z away from who looks


def board_poses(
    rig: StereoRig, sensors: SensorParams, board: Board, count: int, rng: np.random.Generator
) -> list[Array]:
    """`T_left_board` of so many places of a board: in the corners of each eye's image, and large before both.

    Raises:
        FlysimError: there are not so many, since the eyes stand too far apart.
    """
    found: list[Array] = []
    places: list[int] = []
    for _ in range(TRIES + 100 * count):
        if len(found) == count:
            return found
        if not places:
            places = rng.permutation(2 * CORNERS).tolist()
        place = places.pop()
        corner, eye = divmod(place, 2)
        pushed = place < CORNERS
        T = _pushed(rig, sensors, board, corner, eye, rng) if pushed else _held(rig, board, rng)
        # A chessboard is found where all its squares are seen, and not before.
        corners = transform(T, np.concatenate([board.corners, board.outline]))
        seen = (
            _inside(corners, rig.left, sensors),
            _inside(transform(rig.T_right_left, corners), rig.right, sensors),
        )
        if seen[eye] if pushed else all(seen):
            found.append(T)
        else:
            places.append(place)
    raise FlysimError(
        f"the two eyes see a {board.name} of {100 * board.square:g} cm squares together in {len(found)} places only, "
        f"{count} are needed: take a larger board."
    )


def shown_board(
    robot: Robot,
    board: Board,
    sensors: SensorParams,
    *,
    count: int,
    rng: np.random.Generator,
    seed: int = 0,
    renderer: RendererName = "auto",
) -> Iterator[ImagePair]:
    """The pairs that a robot's cameras take of a board, place by place, flaws of lens and chip included.

    Args:
        robot: whose cameras; it stands where nothing else is.
        board: that is shown to it.
        sensors: what its cameras do to a picture.
        count: pairs to take.
        rng: where the board is held.
        seed: of the noise.
        renderer: "gl", "tiny", or "auto": gl where an OpenGL context opens.

    Raises:
        FlysimError: as `board_poses`, or nothing draws here.
    """
    cameras = Cameras(robot.rig, sensors, seed=seed)
    poses = board_poses(cameras.true, sensors, board, count, rng)
    scratch = Scratch()
    studio = Studio(robot, renderer, rig=cameras.drawn)
    try:
        texture = Path(scratch.name) / "board.png"
        write_png(board.picture(SQUARE_PX), texture)
        for k, T_left_board in enumerate(poses):
            studio.set_up(_world(robot.T_base_left @ T_left_board, board, texture), Pose2(0.0, 0.0, 0.0))
            yield cameras.take(studio.pair(), k)
    finally:
        studio.close()
        scratch.cleanup()


def _leant(rng: np.random.Generator) -> Array:
    """How a board is held: leant to any side, and a little turned."""
    towards, tilt = rng.uniform(0.0, math.tau), math.radians(rng.uniform(*TILT))
    lean = Rotation.from_rotvec(tilt * np.array([math.cos(towards), math.sin(towards), 0.0]))
    roll = Rotation.from_euler("z", math.radians(rng.uniform(-ROLL, ROLL)))
    return (lean * roll).as_matrix()


def _held(rig: StereoRig, board: Board, rng: np.random.Generator) -> Array:
    """A large view of a board, its middle somewhere in the image."""
    camera, R = rig.left, _leant(rng)
    z = camera.fx * board.size[0] / (rng.uniform(*LARGE) * camera.width)
    uv = rng.random(2) * (camera.width, camera.height)
    # Between the two eyes: what stands in the middle of one is at the side of the other.
    middle = camera.unproject(uv[None], np.array([z]))[0] + 0.5 * inverse(rig.T_right_left)[:3, 3]
    return se3(R, middle - R @ board.corners.mean(axis=0))


def _pushed(
    rig: StereoRig, sensors: SensorParams, board: Board, corner: int, eye: int, rng: np.random.Generator
) -> Array:
    """A small view of a board, pushed into a corner of an eye's image as far as all of it is seen."""
    camera, R = (rig.left, rig.right)[eye], _leant(rng)
    down, across = divmod(corner, 2)
    near = np.round(INSIDE + 1.0 + rng.uniform(0.0, SLACK, 2)).astype(int)
    u, v = (camera.width - 1 - near[0] if across else near[0]), (camera.height - 1 - near[1] if down else near[1])
    x, y = (one[v, u] for one in rays(camera, sensors))
    z = camera.fx * board.size[0] / (rng.uniform(*SMALL) * camera.width)
    at = np.array([x, y, 1.0]) * z
    if eye:
        at = transform(inverse(rig.T_right_left), at)
    return se3(R, at - R @ board.outline[[0, 1, 3, 2][corner]])


def _inside(points: Array, camera: Camera, sensors: SensorParams) -> bool:
    if points[:, 2].min() <= 0.1:
        return False
    x, y = distorted(points[:, 0] / points[:, 2], points[:, 1] / points[:, 2], sensors)
    uv = np.stack([x * camera.fx + camera.cx, y * camera.fy + camera.cy], axis=1)
    return bool(camera.contains(uv, INSIDE).all())


def _world(T_world_board: Array, board: Board, texture: Path) -> World:
    """A board that hangs in the air, and a floor that nobody sees under the robot."""
    width, height = (side + 2.0 * board.square for side in board.size)
    T = T_world_board @ se3(np.eye(3), board.corners.mean(axis=0)) @ T_BOARD_PLANE
    sheet = Part(name="sheet", shape=Plane((width, height)), T_link_part=np.eye(4), material=Material(texture=texture))
    ground = Part(name="ground", shape=Plane((10.0, 10.0)), T_link_part=np.eye(4))
    links = [
        Link(
            name=name,
            model=name,
            T_world_link=T_world_link,
            visuals=visuals,
            collisions=collisions,
            static=True,
            structure=True,
        )
        for name, T_world_link, visuals, collisions in (("floor", np.eye(4), (), (ground,)), ("board", T, (sheet,), ()))
    ]
    return World(name="board", path=texture, links=tuple(links))
