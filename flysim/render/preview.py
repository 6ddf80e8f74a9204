"""A picture of a world from above one of its corners."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from PIL import Image

from flysim.common.catalogue import find_robot
from flysim.common.whole_file import whole_file
from flysim.errors import RecordError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, Pose2, se3
from flysim.render.choose import RendererName
from flysim.render.studio import drawn
from flysim.robots.robot import read_robot
from flysim.worlds.sdf.reader import read_world

WIDTH, HEIGHT, OVERSAMPLING = 960, 640, 2
FOV = math.radians(50.0)
AZIMUTH, ELEVATION = math.radians(215.0), math.radians(42.0)  # from behind and beside the robot's start
COLOURS = 128  # of the palette, for the size of the file


def draw_preview(world_path: Path, out: Path, renderer: RendererName = "auto") -> None:
    """Writes a PNG of a world with the rover at its origin.

    Raises:
        WorldError: the world cannot be read.
        RecordError: the picture cannot be written.
    """
    if out.is_dir():
        raise RecordError(f"{out} is a folder. Give the name of a PNG with --out.")
    world, robot = read_world(world_path), read_robot(find_robot("rover"))
    with drawn(world, robot, Pose2(0.0, 0.0, 0.0), renderer) as (simulation, eyes):
        camera = Camera.from_fov(WIDTH * OVERSAMPLING, HEIGHT * OVERSAMPLING, FOV)
        view = eyes.view(camera, _overlook(simulation.bounds(), camera))
    picture = Image.fromarray(view.rgb).resize((WIDTH, HEIGHT), Image.Resampling.BOX)
    _write(picture.quantize(COLOURS, dither=Image.Dither.NONE), out)


def _write(picture: Image.Image, out: Path) -> None:
    try:
        with whole_file(out) as part:
            picture.save(part, format="PNG", optimize=True)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise RecordError(f"{out}: cannot write the picture: {reason}. Choose another place with --out.") from error


def _overlook(bounds: Array, camera: Camera) -> Array:
    """`T_world_optical` of a camera that has the whole box in view."""
    center = bounds.mean(axis=0)
    forward = -np.array(
        [
            math.cos(AZIMUTH) * math.cos(ELEVATION),
            math.sin(AZIMUTH) * math.cos(ELEVATION),
            math.sin(ELEVATION),
        ]
    )
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    R = np.stack([right, np.cross(forward, right), forward], axis=1)
    corners = np.stack(np.meshgrid(*bounds.T), axis=-1).reshape(-1, 3) - center
    x, y, z = (corners @ R).T
    margin = 1.06
    distance = max(
        (margin * np.abs(x) * camera.fx / (camera.width / 2.0) - z).max(),
        (margin * np.abs(y) * camera.fy / (camera.height / 2.0) - z).max(),
    )
    return se3(R, center - distance * forward)
