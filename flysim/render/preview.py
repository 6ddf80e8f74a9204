"""A picture of a world from above one of its corners."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from PIL import Image

from flysim.common.catalogue import find_robot
from flysim.common.whole_file import whole_file
from flysim.errors import RecordError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import Array, Pose2, inverse, se3, transform
from flysim.render.choose import RendererName
from flysim.render.studio import drawn
from flysim.robots.robot import read_robot
from flysim.worlds.ground import grounded, middle_of
from flysim.worlds.sdf.reader import read_world

WIDTH, HEIGHT, OVERSAMPLING = 960, 640, 2
FOV = math.radians(50.0)
ELEVATION = math.radians(55.0)
# From behind the robot's start, or from its right where the world is longer ahead than across; askew: two sides show.
BEHIND, BESIDE, ASKEW = math.radians(180.0), math.radians(270.0), math.radians(12.0)
MARGIN = 1.04
ROOM = np.array([0.3, 0.3, 0.0])  # [m] the robot's
COLOURS = 128  # of the palette, for the size of the file


def draw_preview(
    world_path: Path, out: Path, renderer: RendererName = "auto", models: Iterable[str] = ()
) -> tuple[str, ...]:
    """Writes a PNG of a world with the rover where a path would begin; gives what was left out of it.

    Args:
        world_path: of its file.
        out: the PNG to write.
        renderer: who draws.
        models: folders with models, as of `read_world`.

    Raises:
        WorldError: the world cannot be read.
        RecordError: the picture cannot be written.
    """
    if out.is_dir():
        raise RecordError(f"{out} is a folder. Give the name of a PNG with --out.")
    world, robot = grounded(read_world(world_path, models)), read_robot(find_robot("rover"))
    stand = np.append(middle_of(world.links), 0.0)
    with drawn(world, robot, Pose2(float(stand[0]), float(stand[1]), 0.0), renderer) as (simulation, eyes):
        camera = Camera.from_fov(WIDTH * OVERSAMPLING, HEIGHT * OVERSAMPLING, FOV)
        low, high = simulation.bounds()
        bounds = np.stack([np.minimum(low, stand - ROOM), np.maximum(high, stand + ROOM)])
        T_world_optical = _overlook(bounds, camera)
        view = eyes.view(camera, T_world_optical)
    rows = _rows(bounds, camera, T_world_optical)
    picture = Image.fromarray(view.rgb[rows])
    picture = picture.resize((WIDTH, picture.height // OVERSAMPLING), Image.Resampling.BOX)
    _write(picture.quantize(COLOURS, dither=Image.Dither.NONE), out)
    return world.warnings


def _write(picture: Image.Image, out: Path) -> None:
    try:
        with whole_file(out) as part:
            picture.save(part, format="PNG", optimize=True)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise RecordError(f"{out}: cannot write the picture: {reason}. Choose another place with --out.") from error


def _overlook(bounds: Array, camera: Camera) -> Array:
    """`T_world_optical` of a camera that the whole box fills: its long side across, as near as it can be."""
    center = bounds.mean(axis=0)
    length, width, _ = bounds[1] - bounds[0]
    azimuth = (BESIDE if length > width else BEHIND) + ASKEW
    forward = -np.array(
        [
            math.cos(azimuth) * math.cos(ELEVATION),
            math.sin(azimuth) * math.cos(ELEVATION),
            math.sin(ELEVATION),
        ]
    )
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    R = np.stack([right, np.cross(forward, right), forward], axis=1)
    corners = (np.stack(np.meshgrid(*bounds.T), axis=-1).reshape(-1, 3) - center) @ R
    half = np.array([camera.width / 2.0 / camera.fx, camera.height / 2.0 / camera.fy]) / MARGIN
    # Along each axis of the picture the box has two sides, x <= half (z + far - low) and its like: the nearest camera
    # is where both hold, and between them lies its middle.
    x, z = corners[:, :2], corners[:, 2:]
    above, below = (x - half * z).max(axis=0), (-x - half * z).max(axis=0)
    distance = float(((above + below) / 2.0 / half).max())
    aside = (above - below) / 2.0
    return se3(R, center + R @ np.append(aside, -distance))


def _rows(bounds: Array, camera: Camera, T_world_optical: Array) -> slice:
    """The rows of the picture in which the box lies, with a margin: above and below it is only sky or floor."""
    corners = np.stack(np.meshgrid(*bounds.T), axis=-1).reshape(-1, 3)
    _, y, z = transform(inverse(T_world_optical), corners).T
    v = camera.cy + camera.fy * y / z
    room = (MARGIN - 1.0) * camera.width / 2.0
    top, bottom = max(round(v.min() - room), 0), min(round(v.max() + room), camera.height)
    return slice(top, top + (bottom - top) // OVERSAMPLING * OVERSAMPLING)
