"""Photographs that somebody else took: 8 and 16 bits, grey or colour, TIFF too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.foreign.files import opened
from flysim.foreign.image import FORMATS, MAX_BYTES, read_pixels
from flysim.foreign.muted import muted

ENDINGS = (".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".pnm", ".bmp", ".tif", ".tiff")
TIFF = (b"II*\0", b"MM\0*")
# Neighbouring pixels of a 16-bit picture whose bytes are in the wrong order differ by a third of all there is.
NOISY, SMOOTHER = 0.15, 0.5


def read_picture(path: Path) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """`[H, W, 3]` uint8 RGB, or `[H, W]` uint16 of a 16-bit grey picture; 16-bit colours lose their lower bytes.

    Raises:
        FlysimError: the file cannot be read, is damaged or of another format, has floating-point pixels, bytes in the
            wrong order, or more than `MAX_PIXELS`.
    """
    with opened(path, "picture", MAX_BYTES) as stream:
        tiff = stream.read(4) in TIFF
    with muted(tiff):  # libtiff tells stderr what it thinks of a file
        return read_pixels(path, "picture", (*FORMATS, "TIFF"), _pixels)


def _pixels(image: Any, where: str) -> NDArray[np.uint8] | NDArray[np.uint16]:
    if image.mode.startswith("F"):
        raise FlysimError(f"{where}: a picture of floating-point numbers. Convert it to 8 or 16 bits.")
    if not image.mode.startswith("I"):
        return np.asarray(image if image.mode == "RGB" else image.convert("RGB"))
    values = np.asarray(image)
    if values.min() < 0 or values.max() > 65535:
        raise FlysimError(f"{where}: a picture of 32-bit numbers. Convert it to 8 or 16 bits.")
    deep = values.astype(np.uint16)
    rough, turned = _roughness(deep), _roughness(deep.byteswap())
    if rough > NOISY and turned < SMOOTHER * rough:
        raise FlysimError(f"{where}: the bytes of its 16-bit pixels are in the wrong order. Save it again as PNG.")
    return deep


def _roughness(deep: NDArray[np.uint16]) -> float:
    """How much neighbours in a row differ, as a share of all that the picture spans."""
    values = deep[:: max(len(deep) // 200, 1)].astype(np.float64)
    span = np.ptp(values)
    return float(np.abs(np.diff(values, axis=1)).mean() / span) if span > 0.0 and values.shape[1] > 1 else 0.0


def eight_bits(*pictures: NDArray[Any]) -> tuple[NDArray[np.uint8], ...]:
    """Pictures of one camera as `[H, W, 3]` uint8 RGB: those of 16 bits by as many bits as the brightest one uses."""
    brightest = max((int(one.max(initial=0)) for one in pictures if one.dtype == np.uint16), default=0)
    shift = max(brightest.bit_length() - 8, 0)
    return tuple(
        np.repeat((one >> shift).astype(np.uint8)[..., None], 3, axis=2) if one.dtype == np.uint16 else one
        for one in pictures
    )
