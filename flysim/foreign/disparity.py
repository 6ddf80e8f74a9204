"""Disparity maps and depths that another program wrote: PFM, 16-bit PNG, .npy."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from flysim.errors import FlysimError
from flysim.foreign.arrays import parse_npy
from flysim.foreign.files import read_bytes
from flysim.foreign.image import MAX_PIXELS, PNG_SIGNATURE, parse_png16
from flysim.plain import shown_path

MAX_BYTES = 2**28  # of a map: 30 megapixels of 8 bytes
KITTI_STEP = 256.0  # a 16-bit PNG of KITTI counts in 1/256 px, or 1/256 m; 0 is none
_PFM = re.compile(rb"(P[fF])\s+(\d{1,6})\s+(\d{1,6})\s+(-?\d{0,6}(?:\.\d{1,9})?(?:[eE][-+]?\d{1,2})?)[ \t\r]*\n")


def parse_pfm(data: bytes) -> NDArray[np.float32]:
    """`[H, W]` of a PFM file of one channel, from the top row down; the order of its bytes is what its scale says.

    Raises:
        ValueError: it is none, has three channels, or another size than its header says.
    """
    found = _PFM.match(data)
    if found is None or found[1] != b"Pf":
        raise ValueError("it is no PFM of one channel")
    width, height, scale = int(found[2]), int(found[3]), float(found[4] or 0.0)
    if not (width and height and scale) or not math.isfinite(scale):
        raise ValueError("its header has no size or no scale")
    if width * height * 4 != len(data) - found.end():
        raise ValueError(f"it holds {len(data) - found.end()} bytes, not {width}x{height} numbers")
    order = "<" if scale < 0.0 else ">"
    rows = np.frombuffer(data, f"{order}f4", offset=found.end()).reshape(height, width)
    return np.ascontiguousarray(rows[::-1], np.float32)


def pfm(image: NDArray[np.float32]) -> bytes:
    """A PFM file, little-endian, of `[H, W]` float32."""
    height, width = image.shape
    return b"Pf\n%d %d\n-1.0\n" % (width, height) + np.ascontiguousarray(image[::-1], "<f4").tobytes()


def png16(image: NDArray[np.uint16]) -> Image.Image:
    """A grey picture of 16 bits, for whoever saves it."""
    return Image.fromarray(np.ascontiguousarray(image, np.uint16))


def parse_map(data: bytes) -> NDArray[np.float32]:
    """`[H, W]` float32, NaN where there is none: what is not finite or not above 0, and 0 of a PNG.

    Which format it is, the first bytes say. A 16-bit PNG counts in 1/256, as KITTI's.

    Raises:
        ValueError: it is none of the three, or damaged.
    """
    if data.startswith(PNG_SIGNATURE):
        values: NDArray[Any] = parse_png16(data) / np.float32(KITTI_STEP)
    elif data.startswith(b"\x93NUMPY"):
        values = parse_npy(data)
        if values.ndim == 3 and 1 in (values.shape[0], values.shape[2]):
            values = values[0] if values.shape[0] == 1 else values[..., 0]
    elif data.startswith((b"Pf", b"PF")):
        values = parse_pfm(data)
    else:
        raise ValueError("it is no PFM, no 16-bit PNG and no .npy")
    if values.ndim != 2 or values.size > MAX_PIXELS:
        raise ValueError(f"it has the shape {values.shape}, not that of one image")
    with np.errstate(invalid="ignore", over="ignore"):
        values = values.astype(np.float32)
        return np.where(np.isfinite(values) & (values > 0.0), values, np.float32(np.nan))


def read_map(path: Path, what: str, error: type[FlysimError] = FlysimError) -> NDArray[np.float32]:
    """The map of a file, as `parse_map`. `what` names it in errors: "disparity".

    Raises:
        error: the file cannot be read, is too large, or as `parse_map`.
    """
    data = read_bytes(path, what, MAX_BYTES, error)
    try:
        return parse_map(data)
    except ValueError as refusal:
        raise error(f"{shown_path(path)}: cannot read the {what}: {refusal}.") from None
