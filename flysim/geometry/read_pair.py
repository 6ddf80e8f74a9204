"""A stereo pair from two image files and a Middlebury calibration file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flysim.errors import FlysimError
from flysim.foreign.files import read_text
from flysim.foreign.image import read_image
from flysim.geometry.calibration.calibration import MAX_CALIB_BYTES, check_size
from flysim.geometry.calibration.middlebury import middlebury
from flysim.geometry.rig import ImagePair
from flysim.plain import shown_path


def read_pair(left: str | Path, right: str | Path, *, calib: str | Path) -> ImagePair:
    """Reads a rectified pair.

    Args:
        left: image file of the left camera, PNG, JPEG, PPM, PGM or BMP; any 8-bit mode becomes RGB.
        right: image file of the right camera, of the same size.
        calib: `calib.txt` of the Middlebury 2014 sets: cam0, cam1 as 3x3 matrices, baseline in millimetres;
            width and height may be left out. Spaces before names and round the equals signs do not matter.

    Raises:
        FlysimError: a file cannot be read, sizes differ, or the calibration lacks a figure.
    """
    left, right = Path(left), Path(right)
    rgb_left, rgb_right = read_image(left), read_image(right)
    path = Path(calib)
    where = shown_path(path)
    level = middlebury(read_text(path, "calibration", MAX_CALIB_BYTES), where).level
    assert level is not None
    height, width = rgb_left.shape[:2]
    check_size(level.size, (width, height), where, shown_path(left))
    try:
        rig = level.rig(width, height)
    except ValueError as error:
        raise FlysimError(f"{where}: {error}.") from error
    if rgb_left.shape != rgb_right.shape:
        raise FlysimError(
            f"{shown_path(right)}: {_size(rgb_right)} px, but {shown_path(left)} has {_size(rgb_left)} px. "
            "Rectify the pair."
        )
    return ImagePair(left=rgb_left, right=rgb_right, rig=rig)


def _size(image: np.ndarray) -> str:
    return f"{image.shape[1]}x{image.shape[0]}"
