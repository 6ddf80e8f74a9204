"""A stereo pair from two image files and a Middlebury calibration file."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from flysim.errors import FlysimError
from flysim.foreign.files import read_text
from flysim.foreign.image import read_image
from flysim.geometry.camera import Camera
from flysim.geometry.frames import se3
from flysim.geometry.rig import ImagePair, StereoRig
from flysim.plain import shown, shown_path

MAX_CALIB_BYTES = 2**16
MIN_FOCAL, MAX_NUMBER = 1e-3, 1e6  # [px] or [mm]: what is beyond is a typing error


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
    text, where = read_text(path, "calibration", MAX_CALIB_BYTES), shown_path(path)
    K0, K1 = _matrix(text, "cam0", where), _matrix(text, "cam1", where)
    baseline = _baseline_mm(text, where) / 1000.0
    _check_size(text, rgb_left, where, shown_path(left))
    try:
        cameras = [
            Camera(width=im.shape[1], height=im.shape[0], fx=K[0, 0], fy=K[1, 1], cx=K[0, 2], cy=K[1, 2])
            for im, K in ((rgb_left, K0), (rgb_right, K1))
        ]
        rig = StereoRig(left=cameras[0], right=cameras[1], T_right_left=se3(np.eye(3), (-baseline, 0.0, 0.0)))
    except ValueError as error:
        raise FlysimError(f"{where}: {error}.") from error
    if min(min(camera.fx, camera.fy) for camera in cameras) < MIN_FOCAL:
        raise FlysimError(f"{where}: focal lengths must be at least {MIN_FOCAL} px.")
    if rgb_left.shape != rgb_right.shape:
        raise FlysimError(
            f"{shown_path(right)}: {_size(rgb_right)} px, but {shown_path(left)} has {_size(rgb_left)} px. "
            "Rectify the pair."
        )
    return ImagePair(left=rgb_left, right=rgb_right, rig=rig)


def _size(image: np.ndarray) -> str:
    return f"{image.shape[1]}x{image.shape[0]}"


def _line(text: str, name: str, value: str) -> str | None:
    """What stands after `name =` at the start of a line, as far as the pattern `value` matches it."""
    found = re.search(rf"^[^\S\n]*{name}[^\S\n]*=[^\S\n]*{value}", text, re.MULTILINE)
    return found[1] if found else None


def _number(word: str) -> float:
    """The number that a word is; NaN for any other and for one that is too large."""
    try:
        value = float(word) if word.isascii() and "_" not in word else math.nan
    except ValueError:
        value = math.nan
    return value if abs(value) <= MAX_NUMBER else math.nan


def _matrix(text: str, name: str, where: str) -> np.ndarray:
    inside = _line(text, name, r"\[([^][]*)\]")
    values = [_number(word) for word in re.split(r"[\s;,]+", (inside or "").strip())]
    if len(values) != 9 or not all(map(math.isfinite, values)):
        raise FlysimError(f"{where}: needs a line '{name}=[fx 0 cx; 0 fy cy; 0 0 1]' of numbers up to {MAX_NUMBER:g}.")
    return np.array(values).reshape(3, 3)


def _baseline_mm(text: str, where: str) -> float:
    word = _line(text, "baseline", r"(\S+)")
    if word is None:
        raise FlysimError(f"{where}: needs a line 'baseline=<millimetres>'.")
    # A negative one would put the right camera on the left.
    if not _number(word) > 0.0:
        raise FlysimError(f"{where}: baseline must be a number of millimetres > 0, got {shown(word)}.")
    return _number(word)


def _check_size(text: str, image: np.ndarray, where: str, of: str) -> None:
    """Refuses the calibration of another size: a scaled image has another focal length."""
    words = [_line(text, name, r"(\S+)") for name in ("width", "height")]
    for word in words:
        if word is not None and not re.fullmatch(r"[0-9]{1,9}", word):
            raise FlysimError(f"{where}: width and height must be whole numbers of pixels, got {shown(word)}.")
    if any(word is not None and int(word) != got for word, got in zip(words, image.shape[1::-1], strict=True)):
        size = "x".join(word or "?" for word in words)
        raise FlysimError(f"{where}: is for {size} px, {of} has {_size(image)} px. Scale one of them.")
