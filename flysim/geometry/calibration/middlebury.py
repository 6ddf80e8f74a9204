"""Middlebury's calibrations: calib.txt of 2014 and 2021, and the offset of the pictures of 2005 and 2006.

Scharstein et al., "High-resolution stereo datasets with subpixel-accurate ground truth", GCPR 2014. Sets of 2001 and
2003 have no calibration. Depth is f B / (d + doffs).
"""

from __future__ import annotations

import math
import re

import numpy as np

from flysim.errors import FlysimError
from flysim.geometry.calibration.calibration import MAX_NUMBER, Calibration, LevelPair, Size, number
from flysim.geometry.frames import Array
from flysim.plain import shown

FOCAL_2006, BASELINE_2006, WIDE_2006 = 3740.0, 0.16, 1100  # [px] at full size, [m]; full pictures are wider than this
THIRD, HALF = 3.0, 2.0


def middlebury(text: str, where: str) -> Calibration:
    """The calibration of a calib.txt.

    Args:
        text: of the file. Spaces before names and round the equals signs do not matter; width, height, ndisp, vmin
            and vmax may be left out.
        where: it is, for errors.

    Raises:
        FlysimError: a figure is missing or nonsense.
    """
    K0, K1 = _matrix(text, "cam0", where), _matrix(text, "cam1", where)
    baseline = _baseline_mm(text, where) / 1000.0
    size = _size(text, where)
    level = LevelPair(left=K0, right=K1, baseline=baseline, size=size)
    return Calibration(name="Middlebury", level=level, disparities=_disparities(text, where))


def middlebury_2006(text: str, where: str, width: int) -> Calibration:
    """The calibration of a dmin.txt of 2005 or 2006: how far the right picture was cut off, at full size.

    Args:
        text: of the file: one number [px].
        where: it is, for errors.
        width: of the pictures [px], which tells whether they are of full, half or third size.

    Raises:
        FlysimError: it is no number.
    """
    cut = number(text.strip())
    if not 0.0 <= cut <= 4000.0:
        raise FlysimError(f"{where}: needs one number of pixels >= 0, got {shown(text.strip())}.")
    scale = 1.0 if width > WIDE_2006 else HALF if width > WIDE_2006 / HALF else THIRD
    focal, middle = FOCAL_2006 / scale, (width - 1) / 2.0
    left = np.array([[focal, 0.0, middle], [0.0, focal, middle], [0.0, 0.0, 1.0]])
    right = left.copy()
    right[0, 2] += cut / scale
    told = f"Middlebury 2005 and 2006 at 1/{scale:g} of full size, principal point taken to be the middle"
    level = LevelPair(left=left, right=right, baseline=BASELINE_2006)
    return Calibration(name="Middlebury 2006", level=level, notes=(told,))


def _line(text: str, name: str, value: str) -> str | None:
    """What stands after `name =` at the start of a line, as far as the pattern `value` matches it."""
    found = re.search(rf"^[^\S\n]*{name}[^\S\n]*=[^\S\n]*{value}", text, re.MULTILINE)
    return found[1] if found else None


def _matrix(text: str, name: str, where: str) -> Array:
    inside = _line(text, name, r"\[([^][]*)\]")
    values = [number(word) for word in re.split(r"[\s;,]+", (inside or "").strip())]
    if len(values) != 9 or not all(map(math.isfinite, values)):
        raise FlysimError(f"{where}: needs a line '{name}=[fx 0 cx; 0 fy cy; 0 0 1]' of numbers up to {MAX_NUMBER:g}.")
    return np.array(values).reshape(3, 3)


def _baseline_mm(text: str, where: str) -> float:
    word = _line(text, "baseline", r"(\S+)")
    if word is None:
        raise FlysimError(f"{where}: needs a line 'baseline=<millimetres>'.")
    # A negative one would put the right camera on the left.
    if not number(word) > 0.0:
        raise FlysimError(f"{where}: baseline must be a number of millimetres > 0, got {shown(word)}.")
    return number(word)


def _size(text: str, where: str) -> Size:
    words = [_line(text, name, r"(\S+)") for name in ("width", "height")]
    for word in words:
        if word is not None and not re.fullmatch(r"[0-9]{1,9}", word):
            raise FlysimError(f"{where}: width and height must be whole numbers of pixels, got {shown(word)}.")
    width, height = (None if word is None else int(word) for word in words)
    return width, height


def _disparities(text: str, where: str) -> tuple[float, float] | None:
    """`vmin` to `vmax`, which are tight, else what `ndisp` says."""
    found = {}
    for name in ("ndisp", "vmin", "vmax"):
        word = _line(text, name, r"(\S+)")
        if word is None:
            continue
        found[name] = number(word)
        if not 0.0 <= found[name] <= MAX_NUMBER:
            raise FlysimError(f"{where}: {name} must be a number of pixels >= 0, got {shown(word)}.")
    if 0.0 <= found.get("vmin", -1.0) < found.get("vmax", -1.0):
        return found["vmin"], found["vmax"]
    return (0.0, found["ndisp"] - 1.0) if found.get("ndisp", 0.0) > 1.0 else None
