"""A stereo pair from two image files and a Middlebury calibration file."""

from __future__ import annotations

import math
import re
import warnings
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
        left: image file of the left camera; any 8-bit mode Pillow reads becomes RGB.
        right: image file of the right camera, of the same size.
        calib: `calib.txt` of the Middlebury 2014 sets: cam0, cam1 as 3x3 matrices, baseline in millimetres;
            width and height may be left out.

    Raises:
        FlysimError: a file cannot be read, sizes differ, or the calibration lacks a figure.
    """
    rgb_left, rgb_right = _read_image(Path(left)), _read_image(Path(right))
    text = _read_text(Path(calib))
    K0, K1 = _matrix(text, "cam0", calib), _matrix(text, "cam1", calib)
    baseline = _baseline_mm(text, calib) / 1000.0
    _check_size(text, rgb_left, calib)
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
        with warnings.catch_warnings():
            # Pillow warns of a large image and refuses a larger one; both are far above MAX_PIXELS.
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path) as image:
                if image.width * image.height > MAX_PIXELS:
                    raise FlysimError(f"{path}: {image.width}x{image.height} px; at most {MAX_PIXELS} are read.")
                if image.mode.startswith(("I", "F")):  # Pillow would clip, not scale: nearly all becomes white
                    raise FlysimError(f"{path}: a 16-bit or float image ({image.mode}). Convert it to 8-bit.")
                return np.asarray(image.convert("RGB"))
    except OSError as error:
        raise FlysimError(f"{path}: cannot read the image: {error.strerror or error}.") from error
    except (Image.DecompressionBombError, Image.DecompressionBombWarning) as error:
        raise FlysimError(f"{path}: cannot read the image: more than {MAX_PIXELS} px.") from error


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


def _baseline_mm(text: str, path: str | Path) -> float:
    found = re.search(r"^baseline\s*=\s*(\S+)", text, re.MULTILINE)
    if not found:
        raise FlysimError(f"{path}: needs a line 'baseline=<millimetres>'.")
    try:
        value = float(found.group(1))
    except ValueError:
        value = math.nan
    # A negative one would put the right camera on the left.
    if not (math.isfinite(value) and value > 0.0):
        raise FlysimError(f"{path}: baseline must be a number of millimetres > 0, got {found.group(1)!r}.")
    return value


def _check_size(text: str, image: np.ndarray, path: str | Path) -> None:
    """Refuses the calibration of another size: a scaled image has another focal length."""
    width, height = (re.search(rf"^{name}\s*=\s*(\d+)\s*$", text, re.MULTILINE) for name in ("width", "height"))
    if width and height and (int(height.group(1)), int(width.group(1))) != image.shape[:2]:
        size = f"{width.group(1)}x{height.group(1)}"
        raise FlysimError(f"{path}: is for {size} px, the images have {_size(image)} px. Scale one of them.")
