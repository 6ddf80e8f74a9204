"""Pictures that somebody else made, through Pillow with the formats named."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from flysim.errors import FlysimError
from flysim.foreign.files import opened
from flysim.plain import shown_path

# None of these decoders starts another program, as that of EPS does, reads a file that the picture names, or writes to
# the terminal past us, as that of TIFF does.
FORMATS = ("PNG", "JPEG", "PPM", "BMP")
MAX_PIXELS = 64_000_000
MAX_BYTES = 2**28
MAX_PLAIN_BYTES = 2**22  # of a PPM or PGM in decimal digits, which are read one by one


def read_image(path: Path) -> NDArray[np.uint8]:
    """`[H, W, 3]` RGB of an 8-bit picture in one of `FORMATS`.

    Raises:
        FlysimError: the file cannot be read, is damaged or of another format, has more than 8 bits a channel, or more
            than `MAX_PIXELS`.
    """
    where = shown_path(path)
    with opened(path, "image", MAX_BYTES) as stream:
        if stream.read(2) in (b"P1", b"P2", b"P3") and stream.seek(0, 2) > MAX_PLAIN_BYTES:
            raise FlysimError(f"{where}: cannot read the image: plain text of such a size. Save it as PNG.")
        stream.seek(0)
        try:
            with _quiet(), Image.open(stream, formats=FORMATS) as image:
                if image.width * image.height > MAX_PIXELS:
                    raise FlysimError(f"{where}: {image.width}x{image.height} px; at most {MAX_PIXELS} are read.")
                if image.mode.startswith(("I", "F")):  # Pillow would clip, not scale: nearly all becomes white
                    raise FlysimError(f"{where}: a 16-bit or float image ({image.mode}). Convert it to 8-bit.")
                return np.asarray(image if image.mode == "RGB" else image.convert("RGB"))
        except FlysimError:
            raise
        except Image.UnidentifiedImageError:
            raise FlysimError(
                f"{where}: cannot read the image: it is none of {', '.join(FORMATS)}, or damaged."
            ) from None
        except MemoryError:
            raise
        except Exception as error:  # Pillow's decoders raise whatever the damaged bytes lead them to
            raise FlysimError(f"{where}: cannot read the image: {str(error) or type(error).__name__}.") from error


def check_png(data: bytes) -> None:
    """Decodes a PNG once.

    Raises:
        ValueError: it is damaged; the message is what sort of error the decoder met.
    """
    try:
        with _quiet():
            with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
                image.verify()
            with Image.open(io.BytesIO(data), formats=["PNG"]) as image:
                image.load()
    except MemoryError:
        raise
    except Exception as error:  # as above
        raise ValueError(type(error).__name__) from None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """No warnings: about colour profiles, odd chunks and large pictures; what counts is checked here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
