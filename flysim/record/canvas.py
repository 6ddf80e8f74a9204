"""A figure to draw on without pyplot: made, divided in inches, and packed as a PNG."""

from __future__ import annotations

import io
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flysim.plain import plain

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 110


def label(text: str) -> str:
    """Somebody else's name as a figure shows it: as it stands, its dollar signs no mathematics."""
    return plain(text).replace("$", r"\$")


def blank(width: float, height: float) -> Figure:
    """A figure [inch] without pyplot: nothing global, so threads and notebooks are left alone."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), dpi=DPI)


def place(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """Axes at a place in inches. Automatic layouts draw everything twice."""
    whole_width, whole_height = figure.get_size_inches()
    return figure.add_axes((left / whole_width, bottom / whole_height, width / whole_width, height / whole_height))


def fit(width: float, height: float, most_width: float, most_height: float) -> tuple[float, float]:
    """Width and height [inch] of a picture of this aspect that fills the given room, at least 1 thick."""
    scale = min(most_width / width, most_height / height)
    return max(width * scale, 1.0), max(height * scale, 1.0)


def drawn(figure: Figure) -> NDArray[np.uint8]:
    """`[H, W, 3]` RGB picture of a figure."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].copy()


def png(picture: NDArray[np.uint8]) -> bytes:
    """A picture as a PNG file's bytes."""
    from PIL import Image

    sink = io.BytesIO()
    Image.fromarray(picture).save(sink, format="png", compress_level=3, dpi=(DPI, DPI))
    return sink.getvalue()


def write_pngs(folder: Path, figures: Mapping[str, Figure]) -> None:
    """Write each figure under its name.

    Raises:
        OSError: the disk is full or refuses.
    """
    # Compression leaves Python's lock, so one picture is packed while the next is drawn.
    with ThreadPoolExecutor(max_workers=2) as pool:
        packed = {name: pool.submit(png, drawn(figure)) for name, figure in figures.items()}
        for name, file in packed.items():
            (folder / name).write_bytes(file.result())
