"""A stereo pair from two image files and a Middlebury calibration file."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
from PIL import Image

from flysim.errors import FlysimError
from flysim.geometry.camera import Camera
from flysim.geometry.frames import se3
from flysim.geometry.rig import ImagePair, StereoRig

MAX_PIXELS = 64_000_000


def read_pair(left: str | Path, right: str | Path, *, calib: str | Path) -> ImagePair:
    """Reads a rectified pair.

    Args:
        left: image file of the left camera; any mode Pillow reads becomes 8-bit RGB.
        right: image file of the right camera, of the same size.
        calib: `calib.txt` of the Middlebury 2014 sets: cam0, cam1 as 3x3 matrices, baseline in millimetres.

    Raises:
        FlysimError: a file cannot be read, sizes differ, or the calibration lacks a figure.
    """
    rgb_left, rgb_right = _read_image(Path(left)), _read_image(Path(right))
    text = _read_text(Path(calib))
    K0, K1 = _matrix(text, "cam0", calib), _matrix(text, "cam1", calib)
    baseline = _number(text, "baseline", calib) / 1000.0
    try:
        cameras = [
            Camera(width=im.shape[1], height=im.shape[0], fx=K[0, 0], fy=K[1, 1], cx=K[0, 2], cy=K[1, 2])
            for im, K in ((rgb_left, K0), (rgb_right, K1))
        ]
        rig = StereoRig(left=cameras[0], right=cameras[1], T_right_left=se3(np.eye(3), (-baseline, 0.0, 0.0)))
    except ValueError as error:
        raise FlysimError(f"{calib}: {error}.") from error
    if rgb_left.shape != rgb_right.shape:
        raise FlysimError(f"{right}: {_size(rgb_right)} px, but {left} has {_size(rgb_left)} px. Rectify the pair.")
    return ImagePair(left=rgb_left, right=rgb_right, rig=rig)


def _size(image: np.ndarray) -> str:
    return f"{image.shape[1]}x{image.shape[0]}"


def _read_image(path: Path) -> np.ndarray:
    try:
        with Image.open(path) as image:
            if image.width * image.height > MAX_PIXELS:
                raise FlysimError(f"{path}: {image.width}x{image.height} px; at most {MAX_PIXELS} are read.")
            return np.asarray(image.convert("RGB"))
    except OSError as error:
        raise FlysimError(f"{path}: cannot read the image: {error.strerror or error}.") from error


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise FlysimError(f"{path}: cannot read the calibration: {error}.") from error


def _matrix(text: str, name: str, path: str | Path) -> np.ndarray:
    found = re.search(rf"^{name}\s*=\s*\[(.*?)\]", text, re.MULTILINE | re.DOTALL)
    try:
        values = [float(word) for word in re.split(r"[\s;,]+", found.group(1).strip())] if found else []
    except ValueError:
        values = []
    if len(values) != 9 or not all(map(math.isfinite, values)):
        raise FlysimError(f"{path}: needs a line '{name}=[fx 0 cx; 0 fy cy; 0 0 1]'.")
    return np.array(values).reshape(3, 3)


def _number(text: str, name: str, path: str | Path) -> float:
    found = re.search(rf"^{name}\s*=\s*(\S+)", text, re.MULTILINE)
    try:
        return float(found.group(1)) if found else math.nan
    except ValueError:
        raise FlysimError(f"{path}: {name} must be a number, got {found and found.group(1)!r}.") from None
