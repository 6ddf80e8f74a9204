"""Textures out of PNG files: the one place that decodes what somebody else wrote for a renderer.

Pillow's PNG decoder alone reads them: left to guess, Pillow tries all its formats, of which some start other programs,
and what is handed on are pixels, never the file.
"""

from __future__ import annotations

import io
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flysim.errors import WorldError
from flysim.world.elements import shown_path

if TYPE_CHECKING:
    from PIL.Image import Image

MAX_FILE_BYTES = 64 * 2**20
MAX_SIDE = 8192  # [px]
SIGNATURE = b"\x89PNG\r\n\x1a\n"


def png_size(data: bytes) -> tuple[int, int]:
    """Width and height [px] by the header, nothing decoded.

    Raises:
        ValueError: no PNG, a damaged header, or more than 8192 px a side or 8 bits a channel.
    """
    if not data.startswith(SIGNATURE):
        raise ValueError("is not a PNG file: convert it to an 8-bit PNG")
    width, height = int.from_bytes(data[16:20]), int.from_bytes(data[20:24])
    if data[12:16] != b"IHDR" or len(data) < 33 or not (width and height):
        raise ValueError("is a damaged PNG file (no size in its header): write it again")
    if max(width, height) > MAX_SIDE:
        raise ValueError(f"is {width}x{height} px, over {MAX_SIDE}x{MAX_SIDE}: scale it down")
    if data[24] > 8:
        raise ValueError(f"has {data[24]} bits a channel: convert it to an 8-bit PNG")
    return width, height


def check_png(data: bytes) -> None:
    """Decodes a PNG once, so that no renderer meets a damaged one.

    Raises:
        ValueError: as `png_size`, or damaged further on.
    """
    _decoded(data)


def _decoded(data: bytes) -> Image:
    from PIL import Image

    png_size(data)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about colour profiles and the like: the pixels are what counts
            with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
                image.verify()  # every chunk by its checksum, which decoding does not look at
            image = Image.open(io.BytesIO(data), formats=["PNG"])
            image.load()
            return image
    except Exception as error:  # Pillow's decoders raise whatever the damaged bytes lead them to
        raise ValueError(f"is a damaged PNG file ({type(error).__name__}): write it again") from None


def read_png(path: Path) -> NDArray[np.uint8]:
    """`[H, W, 3]` RGB of a texture, from the top row down.

    Raises:
        WorldError: it cannot be read, or is no sound 8-bit PNG; it may have changed since the world was read.
    """
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_FILE_BYTES + 1)
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise WorldError(f"{shown_path(path)}: the texture cannot be read ({reason}): put it back.") from None
    try:
        if len(data) > MAX_FILE_BYTES:
            raise ValueError(f"is larger than {MAX_FILE_BYTES >> 20} MB: make it smaller")
        image = _decoded(data)
    except ValueError as error:
        raise WorldError(f"{shown_path(path)}: the texture {error}.") from None
    return np.asarray(image if image.mode == "RGB" else image.convert("RGB"))
