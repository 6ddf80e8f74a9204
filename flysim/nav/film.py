"""An episode as a moving picture: animated WebP, which browsers play and which needs nothing but Pillow."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from flysim.nav.drive import PERIOD_S

EVERY = 2  # steps from one picture to the next
HEIGHT = 240  # [px]
QUALITY = 60


class Film:
    """Pictures of an episode, one after the other. A minute of them takes some 120 MB until `done`."""

    def __init__(self) -> None:
        self._steps, self._pictures = 0, list[Image.Image]()

    def wants(self) -> bool:
        """Whether the next step is to be shown; asked once a step."""
        self._steps += 1
        return (self._steps - 1) % EVERY == 0

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Shows `[H, W, 3]` RGB next."""
        height, width = picture.shape[:2]
        small = round(width * HEIGHT / height), HEIGHT
        self._pictures.append(Image.fromarray(picture).resize(small, Image.Resampling.BILINEAR))

    def done(self) -> bytes:
        """The file, at the speed at which it was driven; its end stands still for a second."""
        shown = [round(1000 * EVERY * PERIOD_S)] * (len(self._pictures) - 1)
        how: dict[str, Any] = {"duration": [*shown, 1000], "loop": 0, "quality": QUALITY, "method": 0}
        sink, (first, *rest) = io.BytesIO(), self._pictures
        first.save(sink, format="webp", save_all=True, append_images=rest, **how)
        return sink.getvalue()
