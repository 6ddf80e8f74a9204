"""Pictures that somebody else made, through Pillow with the formats named."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from flysim.errors import FlysimError, WorldError
from flysim.foreign.files import opened, read_bytes
from flysim.plain import shown_path

# None of these decoders starts another program, as that of EPS does, reads a file that the picture names, or writes to
# the terminal past us, as that of TIFF does.
FORMATS = ("PNG", "JPEG", "PPM", "BMP")
MAX_PIXELS = 30_000_000  # a pair of that size takes less than 500 MB to read, 900 MB where its colours have 16 bits
MAX_BYTES = 2**28
PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"
TEXTURE_FORMATS = ("PNG", "JPEG", "BMP", "WEBP", "GIF", "PPM", "TGA")  # the last has no mark of its own
MAX_TEXTURE_BYTES = 64 * 2**20
MAX_TEXTURE_SIDE = 8192  # [px]
MAX_PLAIN_BYTES = 2**22  # of a PPM or PGM in decimal digits, which are read one by one


def read_image(path: Path) -> NDArray[np.uint8]:
    """`[H, W, 3]` RGB of an 8-bit picture in one of `FORMATS`.

    Raises:
        FlysimError: the file cannot be read, is damaged or of another format, has more than 8 bits a channel, or more
            than `MAX_PIXELS`.
    """
    return read_pixels(path, "image", FORMATS, _eight_bits)


def read_pixels(path: Path, what: str, formats: Sequence[str], of: Callable[[Image.Image, str], Any]) -> Any:
    """What a function makes of a picture in one of some formats; it is given where the picture is, for errors.

    Raises:
        FlysimError: the file cannot be read, is damaged or of another format, or has more than `MAX_PIXELS`; or as the
            function.
    """
    where = shown_path(path)
    with opened(path, what, MAX_BYTES) as stream:
        if stream.read(2) in (b"P1", b"P2", b"P3") and stream.seek(0, 2) > MAX_PLAIN_BYTES:
            raise FlysimError(f"{where}: cannot read the {what}: plain text of such a size. Save it as PNG.")
        stream.seek(0)
        try:
            with _quiet(), Image.open(stream, formats=list(formats)) as image:
                if image.width * image.height > MAX_PIXELS:
                    raise FlysimError(f"{where}: {image.width}x{image.height} px; at most {MAX_PIXELS} are read.")
                return of(image, where)
        except FlysimError:
            raise
        except Image.UnidentifiedImageError:
            raise FlysimError(
                f"{where}: cannot read the {what}: it is none of {', '.join(formats)}, or damaged."
            ) from None
        except MemoryError:
            raise
        except Exception as error:  # Pillow's decoders raise whatever the damaged bytes lead them to
            raise FlysimError(f"{where}: cannot read the {what}: {str(error) or type(error).__name__}.") from error


def _eight_bits(image: Image.Image, where: str) -> NDArray[np.uint8]:
    if image.mode.startswith(("I", "F")):  # Pillow would clip, not scale: nearly all becomes white
        raise FlysimError(f"{where}: a 16-bit or float image ({image.mode}). Convert it to 8-bit.")
    return np.asarray(image if image.mode == "RGB" else image.convert("RGB"))


def texture_size(data: bytes) -> tuple[int, int]:
    """Width and height [px] of a texture by its header, nothing decoded. What it is its content says, not its name.

    Raises:
        ValueError: no picture, a damaged header, or more than 8192 px a side or 8 bits a channel.
    """
    if not data.startswith(PNG_SIGNATURE):
        with _quiet(), _opened(data) as image:
            width, height = image.size
        if max(width, height) > MAX_TEXTURE_SIDE:
            raise ValueError(_too_wide(width, height))
        return width, height
    width, height = int.from_bytes(data[16:20]), int.from_bytes(data[20:24])
    if data[12:16] != b"IHDR" or len(data) < 33 or not (width and height):
        raise ValueError("is a damaged PNG file (no size in its header): write it again")
    if max(width, height) > MAX_TEXTURE_SIDE:
        raise ValueError(_too_wide(width, height))
    if data[24] > 8:
        raise ValueError(f"has {data[24]} bits a channel: convert it to an 8-bit PNG")
    return width, height


def _too_wide(width: int, height: int) -> str:
    return f"is {width}x{height} px, over {MAX_TEXTURE_SIDE}x{MAX_TEXTURE_SIDE}: scale it down"


def _opened(data: bytes) -> Image.Image:
    """A picture that is no PNG, its header read."""
    if data[:2] in (b"P1", b"P2", b"P3") and len(data) > MAX_PLAIN_BYTES:
        raise ValueError("is plain text of such a size: save it as PNG")
    try:
        image = Image.open(io.BytesIO(data), formats=TEXTURE_FORMATS)
    except MemoryError:
        raise
    except Exception:  # Pillow's decoders raise whatever the damaged bytes lead them to
        raise ValueError(f"is none of {', '.join(TEXTURE_FORMATS)}, or damaged: convert it to an 8-bit PNG") from None
    if image.mode.startswith(("I", "F")):
        image.close()
        raise ValueError(f"has more than 8 bits a channel ({image.mode}): convert it to an 8-bit PNG")
    return image


def check_texture(data: bytes) -> None:
    """Decodes a texture once, so that no renderer meets a damaged one.

    Raises:
        ValueError: as `texture_size`, or damaged further on.
    """
    _decoded(data)


def parse_png16(data: bytes) -> NDArray[np.uint16]:
    """`[H, W]` of a 16-bit grey PNG's bytes.

    Raises:
        ValueError: it is none, or damaged.
    """
    if not data.startswith(PNG_SIGNATURE) or len(data) < 33:
        raise ValueError("it is no PNG")
    width, height = int.from_bytes(data[16:20]), int.from_bytes(data[20:24])
    if (data[24], data[25]) != (16, 0):
        raise ValueError("it is no PNG of 16 bits and one channel")
    if not 0 < width * height <= MAX_PIXELS:
        raise ValueError(f"it has {width}x{height} px; at most {MAX_PIXELS} are read")
    try:
        with _quiet():
            with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
                image.verify()
            with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
                return np.array(image).astype(np.uint16)
    except MemoryError:
        raise
    except Exception as error:  # as above
        raise ValueError(f"it is damaged ({type(error).__name__})") from None


def read_texture(path: Path) -> NDArray[np.uint8]:
    """`[H, W, 3]` RGB of a texture, from the top row down: what is handed on to a renderer are pixels, never the file.

    Raises:
        WorldError: it cannot be read, or is no sound 8-bit picture; it may have changed since the world was read.
    """
    try:
        image = _decoded(read_bytes(path, "texture", MAX_TEXTURE_BYTES, WorldError))
    except ValueError as error:
        raise WorldError(f"{shown_path(path)}: the texture {error}.") from None
    return np.asarray(image if image.mode == "RGB" else image.convert("RGB"))


def _decoded(data: bytes) -> Image.Image:
    texture_size(data)
    png = data.startswith(PNG_SIGNATURE)
    try:
        with _quiet():
            if png:
                with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
                    image.verify()  # every chunk by its checksum, which decoding does not look at
            image = Image.open(io.BytesIO(data), formats=["PNG"]) if png else _opened(data)
            image.load()
            return image
    except MemoryError:
        raise
    except Exception as error:  # as above
        kind = "PNG file" if png else "picture"
        raise ValueError(f"is a damaged {kind} ({type(error).__name__}): write it again") from None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """No warnings: about colour profiles, odd chunks and large pictures; what counts is checked here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
