"""Photographs that somebody else took: 8 and 16 bits, grey or colour, TIFF too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.foreign.deep import HEAD, TIFF, deep_colours, deep_ppm, may_be_deep, ppm_colours
from flysim.foreign.files import opened, read_bytes
from flysim.foreign.image import FORMATS, MAX_BYTES, MAX_PIXELS, read_pixels
from flysim.foreign.muted import muted
from flysim.plain import shown_path

ENDINGS = (".png", ".jpg", ".jpeg", ".pgm", ".ppm", ".pnm", ".bmp", ".tif", ".tiff")
# Neighbouring pixels of a 16-bit picture whose bytes are in the wrong order differ by a third of all there is.
NOISY, SMOOTHER = 0.15, 0.5


def read_picture(path: Path) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """`[H, W, 3]` uint8 RGB; of a picture of 16 bits `[H, W]` or `[H, W, 3]` uint16.

    Raises:
        FlysimError: the file cannot be read, is damaged or of another format, has floating-point pixels, bytes in the
            wrong order, or more than `MAX_PIXELS`.
    """
    with opened(path, "picture", MAX_BYTES) as stream:
        head = stream.read(HEAD)
    if (about := deep_ppm(head)) is not None:  # Pillow takes a minute for each, and cuts it to 8 bits
        return _in_order(_ppm(path, about), shown_path(path))
    with muted(head[:4] in TIFF):  # libtiff tells stderr what it thinks of a file
        found = read_pixels(path, "picture", (*FORMATS, "TIFF"), _pixels)
    if found.dtype == np.uint8 and may_be_deep(head):  # Pillow has found it to be sound
        deep = deep_colours(read_bytes(path, "picture", MAX_BYTES), (found.shape[1], found.shape[0]))
        return found if deep is None else _in_order(deep, shown_path(path))
    return found


def _ppm(path: Path, about: tuple[int, int, int, int]) -> NDArray[np.uint16]:
    where, (width, height) = shown_path(path), about[:2]
    if not 0 < width * height <= MAX_PIXELS:
        raise FlysimError(f"{where}: {width}x{height} px; at most {MAX_PIXELS} are read.")
    try:
        return ppm_colours(read_bytes(path, "picture", MAX_BYTES), about)
    except ValueError as error:
        raise FlysimError(f"{where}: cannot read the picture: {error}.") from None


def _pixels(image: Any, where: str) -> NDArray[np.uint8] | NDArray[np.uint16]:
    if image.mode.startswith("F"):
        raise FlysimError(f"{where}: a picture of floating-point numbers. Convert it to 8 or 16 bits.")
    if not image.mode.startswith("I"):
        return np.asarray(image if image.mode == "RGB" else image.convert("RGB"))
    values = np.asarray(image)
    if values.min() < 0 or values.max() > 65535:
        raise FlysimError(f"{where}: a picture of 32-bit numbers. Convert it to 8 or 16 bits.")
    return _in_order(values.astype(np.uint16), where)


def _in_order(deep: NDArray[np.uint16], where: str) -> NDArray[np.uint16]:
    """The picture, unless its bytes are in the wrong order."""
    grey = deep if deep.ndim == 2 else deep[..., 1]
    rough, turned = _roughness(grey), _roughness(grey.byteswap())
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
    return tuple(_coloured(_shifted(one, shift) if one.dtype == np.uint16 else one) for one in pictures)


def _shifted(deep: NDArray[np.uint16], shift: int) -> NDArray[np.uint8]:
    return np.right_shift(deep, shift, out=np.empty(deep.shape, np.uint8), casting="unsafe")


def _coloured(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return picture if picture.ndim == 3 else np.repeat(picture[..., None], 3, axis=2)
