"""Colours of 16 bits, which Pillow cuts to 8: PNG and TIFF by OpenCV, PPM as it lies in the file.

OpenCV makes room for what a header says, so headers are read here first, and only what they leave no doubt about is
handed on: a PNG of one frame; a TIFF each of whose tags stands there once, whose tiles are no larger than it is.
"""

from __future__ import annotations

import re
from struct import error as StructError
from struct import unpack_from

import numpy as np
from numpy.typing import NDArray

from flysim.foreign.muted import muted

PNG = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"
PNG_COLOURS = (2, 6)  # red, green and blue; with alpha
TIFF = {b"II*\0": "<", b"MM\0*": ">"}
TIFF_TYPES = {3: "H", 4: "I"}  # of 16 and of 32 bits
WIDTH, HEIGHT, BITS, KIND, ORIENTATION, SAMPLES, PLANAR = 256, 257, 258, 262, 274, 277, 284
TILE_WIDTH, TILE_HEIGHT, NUMBERS = 322, 323, 339
READ = {WIDTH, HEIGHT, BITS, KIND, ORIENTATION, SAMPLES, PLANAR, TILE_WIDTH, TILE_HEIGHT, NUMBERS}
PPM = re.compile(rb"P6(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,5})\s")
HEAD = 2**12  # bytes that tell whether a picture may be one


def may_be_deep(head: bytes) -> bool:
    """Whether a file that begins so is no PPM, and may have colours of 16 bits."""
    return head[:4] in TIFF or (head[: len(PNG)] == PNG and head[24:25] == b"\x10")


def deep_colours(data: bytes, size: tuple[int, int]) -> NDArray[np.uint16] | None:
    """`[H, W, 3]` RGB of a sound PNG's or TIFF's bytes; None where it has no colours of 16 bits, or they cannot be had.

    Args:
        data: of a picture that Pillow decodes.
        size: width and height [px] that Pillow found.
    """
    if size not in (_png(data), _tiff(data)):
        return None
    import cv2

    with muted():
        try:
            found = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
        except cv2.error:
            return None
    if (
        found is None
        or found.dtype != np.uint16
        or found.shape[:2] != size[::-1]
        or found.shape[2:] not in ((3,), (4,))
    ):
        return None
    if found.shape[2] == 4:
        return np.ascontiguousarray(found[..., 2::-1], np.uint16)
    cv2.cvtColor(found, cv2.COLOR_BGR2RGB, dst=found)  # in place: it is large
    return np.asarray(found, np.uint16)


def deep_ppm(head: bytes) -> tuple[int, int, int, int] | None:
    """Width, height, brightest level and where the pixels begin, of a PPM that begins so and has 16 bits a colour."""
    found = PPM.match(head)
    if found is None or not 255 < int(found[3]) < 65536:
        return None
    return int(found[1]), int(found[2]), int(found[3]), found.end()


def ppm_colours(data: bytes, about: tuple[int, int, int, int]) -> NDArray[np.uint16]:
    """`[H, W, 3]` RGB of a PPM, as `deep_ppm` has told about it; the brightest level becomes 65535.

    Raises:
        ValueError: it ends too soon.
    """
    width, height, most, begin = about
    if len(data) - begin < 6 * width * height:
        raise ValueError(f"it ends after {len(data)} bytes")
    levels = np.frombuffer(data, ">u2", 3 * width * height, begin).astype(np.uint16)
    if most != 65535:
        for part in np.array_split(levels, 64):
            part[:] = np.minimum(part, most) * np.uint32(65535) // np.uint32(most)
    return levels.reshape(height, width, 3)


def _png(data: bytes) -> tuple[int, int] | None:
    """Width and height of a PNG with colours of 16 bits that do not move."""
    if not data.startswith(PNG) or len(data) < 33 or data[24] != 16 or data[25] not in PNG_COLOURS or b"acTL" in data:
        return None
    width, height = unpack_from(">II", data, len(PNG))
    return width, height


def _tiff(data: bytes) -> tuple[int, int] | None:
    """Width and height of a TIFF with colours of 16 bits, pixel by pixel, from the top left."""
    if (order := TIFF.get(data[:4])) is None:
        return None
    tags: dict[int, tuple[int, ...]] = {}
    try:
        (at,) = unpack_from(f"{order}I", data, 4)
        (count,) = unpack_from(f"{order}H", data, at)
        rows = [(*unpack_from(f"{order}HHI", data, at + 2 + 12 * k), at + 10 + 12 * k) for k in range(count)]
        for tag, kind, many, place in rows:
            if tag in READ:
                if kind not in TIFF_TYPES or not 1 <= many <= 4:
                    return None
                if many * (2 if kind == 3 else 4) > 4:
                    (place,) = unpack_from(f"{order}I", data, place)
                tags[tag] = unpack_from(f"{order}{many}{TIFF_TYPES[kind]}", data, place)
    except StructError:
        return None
    names = [row[0] for row in rows]
    (width, *_), (height, *_), (samples, *_) = (tags.get(tag, (0,)) for tag in (WIDTH, HEIGHT, SAMPLES))
    plain = (
        names == sorted(set(names)),
        samples in (3, 4) and tags.get(BITS) == (16,) * samples,
        tags.get(KIND) == (2,),
        *(tags.get(tag, (1,)) == (1,) for tag in (ORIENTATION, PLANAR)),
        set(tags.get(NUMBERS, (1,))) == {1},
        *(tags.get(tag, (1,))[0] <= max(side, 256) for tag, side in ((TILE_WIDTH, width), (TILE_HEIGHT, height))),
    )
    return (width, height) if all(plain) else None
