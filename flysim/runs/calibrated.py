"""What a robot takes its cameras for by a calibration: the files of one, one that it makes of itself, or the truth."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flysim.calibration.board import Board
from flysim.calibration.detect import find_corners
from flysim.calibration.images import Sightings
from flysim.calibration.rectify import rectified_infos
from flysim.calibration.result import BoardCalibration, calibrated
from flysim.common.progress import Progress, silent
from flysim.errors import FlysimError, ScenarioError
from flysim.geometry.camera_info import CameraInfo, read_camera_info
from flysim.geometry.rig import StereoRig
from flysim.plain import shown
from flysim.render.choose import RendererName
from flysim.robots.robot import Robot
from flysim.runs.calibration_source import IMAGES, TRUTH, calibration_files, count_of
from flysim.sensors.parameters import SensorParams
from flysim.sources.shown_board import shown_board

BOARD = Board(columns=11, rows=8, square=0.05)  # what a robot is shown if nothing else is said
STREAM = 0xCA11  # sets the board's places apart from whoever else draws under one seed
Pair = tuple[CameraInfo, CameraInfo]


def believed_pair(
    source: str, robot: Robot, sensors: SensorParams, *, folder: Path | None, seed: int, renderer: RendererName = "auto"
) -> Pair:
    """What `calibration = SOURCE` of a scenario has the robot believe.

    Args:
        source: a file of ROS (its other eye's lies beside it), a folder with left.yaml and right.yaml, "truth", or
            "images:15": what so many pairs of images of a board make of the robot's own cameras.
        robot: whose cameras.
        sensors: what they do to a picture.
        folder: of the scenario; a relative path is taken from there, then from here.
        seed: of the run.
        renderer: who draws the board.

    Raises:
        FlysimError: the files cannot be read, or are of another size than the robot's images.
    """
    if source == TRUTH:
        return true_infos(robot.rig, sensors)
    if source.startswith(IMAGES):
        return _pair(simulated(robot, BOARD, sensors, images=count_of(source), seed=seed, renderer=renderer))
    left, right = (read_camera_info(path) for path in calibration_files(source, folder))
    for info, camera in ((left, robot.rig.left), (right, robot.rig.right)):
        if (info.width, info.height) != (camera.width, camera.height):
            raise ScenarioError(
                f"calibration {shown(source)}: is for {info.width}x{info.height} px, the robot's images have "
                f"{camera.width}x{camera.height} px. Calibrate the camera as it is used."
            )
    return left, right


def true_infos(rig: StereoRig, sensors: SensorParams) -> Pair:
    """The robot's cameras as they are, lenses included."""
    D = np.array([sensors.k1, sensors.k2, sensors.p1, sensors.p2, 0.0])
    raw = [
        CameraInfo(name=f"true/{side}", width=camera.width, height=camera.height, K=camera.K, D=D)
        for side, camera in (("left", rig.left), ("right", rig.right))
    ]
    left, right = rectified_infos(raw, rig.T_right_left)
    return left, right


def simulated(
    robot: Robot,
    board: Board,
    sensors: SensorParams,
    *,
    images: int,
    seed: int = 0,
    renderer: RendererName = "auto",
    progress: Progress = silent,
) -> BoardCalibration:
    """Shows a board to a robot's own cameras, and calibrates them by what they took.

    Raises:
        FlysimError: the board is too small for both eyes, or was found in too few images.
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(STREAM,)))
    names, shots, left_out = [], [], []
    pairs = shown_board(robot, board, sensors, count=images, rng=rng, seed=seed, renderer=renderer)
    for k, pair in enumerate(pairs):
        shot = tuple(find_corners(image, board) for image in (pair.left, pair.right))
        left_out += [f"{side}{k + 1:02d}" for side, one in zip(("left", "right"), shot, strict=True) if one is None]
        if any(one is not None for one in shot):
            names.append(f"{k + 1:02d}")
            shots.append(shot)
        progress(f"image {k + 1} of {images}", (k + 1) / images)
    if not shots:
        raise FlysimError(f"the {board.name} is seen in none of {images} images: are they too noisy?")
    camera = robot.rig.left
    views = Sightings(
        size=(camera.width, camera.height), names=tuple(names), shots=tuple(shots), left_out=tuple(left_out)
    )
    return calibrated(board, views, robot.name)


def _pair(calibration: BoardCalibration) -> Pair:
    left, right = (eye.info for eye in calibration.solved.eyes)
    return left, right
