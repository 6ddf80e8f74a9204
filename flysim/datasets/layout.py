"""What a format of data sets is: it writes frames into a folder, knows such a folder, and reads its frames again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from flysim.common.registry import Registry
from flysim.errors import FlysimError
from flysim.geometry.calibration.calibration import Calibration
from flysim.geometry.frames import Array
from flysim.geometry.rig import StereoRig
from flysim.products.frame import Frame
from flysim.truth.obstacles import TrueObstacle
from flysim.truth.stop import Stop

PICTURES = (".png", ".jpg", ".jpeg", ".ppm", ".pgm", ".bmp")
MAX_FRAMES = 100_000
MAX_TEXT = 2**26  # bytes of a list of frames or poses
Eyes = tuple[NDArray[np.uint8], NDArray[np.uint8]]

FORMATS = Registry(
    "format",
    "flysim.formats",
    {
        "kitti": "flysim.datasets.kitti:Kitti",
        "euroc": "flysim.datasets.euroc:Euroc",
        "tum": "flysim.datasets.tum:Tum",
        "middlebury": "flysim.datasets.middlebury:Middlebury",
        "mcap": "flysim.datasets.mcap:Mcap",
    },
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Header:
    """What all frames of a data set that is to be written share.

    Attributes:
        believed, true: the cameras as the robot takes them to be, and as they are.
        T_base_left: `[4, 4]` where the left camera is mounted.
        min_depth, max_depth: the range of depths that is searched [m].
        fps: frames a second [1/s]; None: one a stop.
    """

    believed: StereoRig
    true: StereoRig
    T_base_left: Array
    min_depth: float
    max_depth: float
    fps: float | None = None


class Writer(Protocol):
    """Writes the frames of one data set in a format's own files."""

    def add(self, number: int, frame: Frame, stop: Stop) -> None:
        """Writes the next frame: what was taken and believed, and what truly was."""
        ...

    def add_obstacles(self, time: float, obstacles: tuple[TrueObstacle, ...]) -> None:
        """Told after each frame: its time [s], and the obstacles as they stood. Most formats have no place for them."""
        ...

    def finish(self) -> None:
        """Writes what is known when all frames are there."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Recorded:
    """The frames of a data set, as the files of its format tell of them.

    Attributes:
        times: [s] of each.
        eyes: the left and the right picture of a frame, read when asked for.
        rig: of rectified pictures; None: the format says nothing of it.
        calibration: reads that of pictures as they are, where `rig` is not known; None: the format says nothing of it.
        T_world_left: where the left camera was believed to be, frame by frame; None: nothing is said.
        T_world_base: the same of base_link, where the format tells that.
        first_is_origin: whether those poses are told from the first one, which is where nobody says.
        notes: what a reader of the figures should know.
    """

    times: tuple[float, ...]
    eyes: Callable[[int], Eyes]
    rig: StereoRig | None = None
    calibration: Callable[[], Calibration] | None = None
    T_world_left: tuple[Array, ...] | None = None
    T_world_base: tuple[Array, ...] | None = None
    first_is_origin: bool = False
    notes: tuple[str, ...] = ()


class Layout(Protocol):
    """One format."""

    def writer(self, folder: Path, header: Header) -> Writer:
        """Who writes a data set into a folder that is there and empty."""
        ...

    def holds(self, folder: Path) -> bool:
        """Whether a folder looks like one of this format."""
        ...

    def read(self, folder: Path) -> Recorded:
        """The frames of a folder that `holds`.

        Raises:
            FlysimError: a file is missing or damaged, or says something else than another.
        """
        ...


def layout(name: str) -> Layout:
    """The format of a name.

    Raises:
        FlysimError: there is none.
    """
    return FORMATS.load(name)()


def layout_of(folder: Path) -> str:
    """The name of the format that a folder has.

    Raises:
        FlysimError: it has none that is known.
    """
    for name in FORMATS.names:
        if layout(name).holds(folder):
            return name
    raise FlysimError(f"{folder}: no data set of a known format: {', '.join(FORMATS.names)}. Name its top folder.")


def save_picture(path: Path, image: NDArray[np.uint8]) -> None:
    """Write a PNG, without any loss.

    Raises:
        OSError: the disk is full or refuses.
    """
    Image.fromarray(image).save(path, compress_level=3)


def plain_line(values: object) -> str:
    """Numbers with all their digits, spaces between."""
    return " ".join(repr(float(value)) for value in np.ravel(np.asarray(values, np.float64)))
