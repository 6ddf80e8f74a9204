"""Videos that somebody else made, picture by picture, through OpenCV: containers that name no other file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flysim.errors import FlysimError
from flysim.foreign.files import opened
from flysim.foreign.image import MAX_PIXELS
from flysim.foreign.muted import muted
from flysim.plain import shown_path

ENDINGS = (".mp4", ".m4v", ".mov", ".avi", ".mkv", ".webm")
MAX_BYTES = 2**34
MAX_PICTURES = 100_000


@contextmanager
def video(path: Path) -> Iterator[Video]:
    """A video that is open for a while.

    Raises:
        FlysimError: it cannot be read, is no MP4, MOV, AVI, MKV or WebM, or has too large pictures.
    """
    where = shown_path(path)
    with opened(path, "video", MAX_BYTES) as stream:
        start = stream.read(12)
    known = start[4:8] == b"ftyp" or (start[:4], start[8:]) == (b"RIFF", b"AVI ") or start[:4] == b"\x1a\x45\xdf\xa3"
    if not known:  # a playlist would have it open other files
        raise FlysimError(f"{where}: no video: it is no MP4, MOV, AVI, MKV or WebM, or damaged.")
    import cv2

    with muted():
        capture = cv2.VideoCapture(str(path.absolute()), cv2.CAP_FFMPEG)
    try:
        one = Video(capture, where)
        if not capture.isOpened() or one.width * one.height == 0:
            raise FlysimError(f"{where}: cannot read the video: it is damaged, or cut off before its index.")
        if one.width * one.height > MAX_PIXELS:
            raise FlysimError(f"{where}: {one.width}x{one.height} px; at most {MAX_PIXELS} are read.")
        yield one
    finally:
        with muted():
            capture.release()


class Video:
    """Its pictures, one after the other."""

    def __init__(self, capture: Any, where: str) -> None:
        self._capture, self._where = capture, where
        size = (int(capture.get(3)), int(capture.get(4)))
        self.width, self.height = max(size[0], 0), max(size[1], 0)
        self.planned = min(max(int(capture.get(7)), 0), MAX_PICTURES)
        self.rate = float(capture.get(5)) or 1.0  # [1/s]

    def pictures(self) -> Iterator[NDArray[np.uint8]]:
        """`[H, W, 3]` RGB each.

        Raises:
            FlysimError: it ends before the picture that its index says is the last.
        """
        for count in range(MAX_PICTURES):
            with muted():
                there, picture = self._capture.read()
            if not there:
                if count < self.planned:
                    raise FlysimError(
                        f"{self._where}: the video ends in the middle: picture {count + 1} of {self.planned} cannot be "
                        "read."
                    )
                return
            yield np.ascontiguousarray(picture[..., ::-1])
